"""The functions of array_views.py and llvm_hints.py in plain Numba: slower, but for every version of it."""

from __future__ import annotations

import numba
import numpy as np

plain = numba.njit(error_model='numpy', nogil=True, fastmath={'contract'}, forceinline=True)


@plain
def shaped(array, start, shape):
    """Return a view of a contiguous array's numbers from the one at `start` on, in the given shape."""
    size = 1
    for length in shape:
        size *= length
    return array.reshape(array.size)[start : start + size].reshape(shape)


@plain
def on_stack(count):
    """Return uninitialised memory for `count` float64."""
    return np.empty(count)


@plain
def small_loops():
    """Leave loops to the compiler."""


@plain
def on_its_own():
    """Leave inlining to the compiler."""
