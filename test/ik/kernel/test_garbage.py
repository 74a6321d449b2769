"""Garbage collection while something compiles."""

from __future__ import annotations

import gc

import numba
import pytest

from ros_ik_pkg.ik.kernel import garbage


def test_garbage_is_collected_less_while_something_compiles_and_as_before_afterwards():
    usual, seen = gc.get_threshold(), []

    @numba.extending.overload(abs_of := lambda x: abs(x))
    def _(x):
        seen.append(gc.get_threshold())
        return lambda x: abs(x)

    @numba.njit
    def function(x):
        return abs_of(x)

    assert function(-2.0) == 2.0
    assert seen and set(seen) == {garbage.THRESHOLDS}
    assert gc.get_threshold() == usual


def test_thresholds_are_restored_if_a_compilation_fails():
    usual = gc.get_threshold()
    with pytest.raises(numba.TypingError):
        numba.njit(lambda: no_such_name)()  # noqa: F821
    assert gc.get_threshold() == usual
