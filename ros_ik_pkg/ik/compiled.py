"""The decorators for compiled functions, so that all share the same arithmetic and cache policy."""

from __future__ import annotations

from numba import njit

# error_model='numpy': division by zero gives inf or NaN, which the loop detects, instead of a branch and a raise.
# nogil: batches run on threads. contract: a*b+c may become one fused instruction; nothing is reordered.
_COMMON = {'cache': True, 'error_model': 'numpy', 'nogil': True, 'fastmath': {'contract'}}

# What callers enter by: may allocate.
compiled = njit(**_COMMON)

# Inside the loop: no reference counts (atomic instructions, which would cost more than the arithmetic), and so
# no allocation either, which Numba then refuses to compile.
kernel = njit(_nrt=False, **_COMMON)

# Small kernels that return tuples: inlined, so that the numbers stay in registers.
inlined = njit(_nrt=False, forceinline=True, **_COMMON)
