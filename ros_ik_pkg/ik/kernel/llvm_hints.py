"""Hints to LLVM on the compiled function in which they are called."""

from __future__ import annotations

from numba import types
from numba.extending import intrinsic


@intrinsic
def small_loops(_typing):
    """Do not vectorise loops over a few joints, in this function and what is inlined into it.

    As vectors of eight they take as long to run and three times as long to compile, and every loop is preceded by
    checks whether arrays overlap.
    """
    return _attribute('noimplicitfloat')


@intrinsic
def on_its_own(_typing):
    """Keep this function from being inlined, so that its long loops are vectorised wherever it is called."""
    return _attribute('noinline')


def _attribute(name):
    """Return signature and code of an intrinsic that only gives its caller an LLVM attribute."""

    def build(context, builder, _signature, _arguments):
        builder.function.attributes.add(name)
        return context.get_dummy_value()

    return types.void(), build
