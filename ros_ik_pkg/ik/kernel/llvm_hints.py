"""Hints to LLVM on the compiled function in which they are called."""

from __future__ import annotations

from numba import types
from numba.extending import intrinsic


@intrinsic
def small_loops(_typing):
    """Keep loops over a few joints as they are, in this function and what is inlined into it.

    As vectors of eight they would take as long, ask for thousands of checks whether arrays overlap before the first
    one begins, and three times as long to compile.
    """
    return _attribute('noimplicitfloat')


@intrinsic
def on_its_own(_typing):
    """Keep this function from being inlined, so that the long loops in it become vectors wherever it is called."""
    return _attribute('noinline')


def _attribute(name):
    """Return signature and code of an intrinsic that gives its caller an attribute, and does nothing when it runs."""

    def build(context, builder, _signature, _arguments):
        builder.function.attributes.add(name)
        return context.get_dummy_value()

    return types.void(), build
