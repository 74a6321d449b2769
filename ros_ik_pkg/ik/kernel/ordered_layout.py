"""The memory of a search for two tasks in strict order, beside the workspace that every search has."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kernel.data_layout import Task
from ros_ik_pkg.ik.kernel.numba_insides import shaped

PICKS = 96  # starts that are looked at together


class Wish(NamedTuple):
    """The rows that a solution comes as near to as the demanded rows allow, and memory for that."""

    task: Task  # the same pose; its weights are above 0 in the wished rows only
    columns: np.ndarray  # (n, 6) Jacobian of those rows, by columns
    curvature: np.ndarray  # (n, n) K of ordered_step.py, lower triangle
    factors: np.ndarray  # (n, n) of K
    inverse: np.ndarray  # (6, n) K^-1 J^T, by rows
    left: np.ndarray  # (n,) b without what joints that are fixed contribute
    given: np.ndarray  # (6,) error of the demanded rows without what such joints contribute
    picks: np.ndarray  # (PICKS,) numbers of starts


@inlined
def wish_size(n):
    """Return how many numbers make_wish cuts up for n variables."""
    return n * (2 * n + 6 + 6 + 1) + 6 + PICKS


@inlined
def make_wish(task, n, memory):
    """Cut a Wish for an arm of n variables from a block of memory; to be called by kernels only."""
    by_column, by_row = shaped(memory, 0, (n, 6)), shaped(memory, 6 * n, (6, n))
    squares = shaped(memory, 12 * n, (2, n, n))
    a = 12 * n + 2 * n * n
    return Wish(
        task, by_column, squares[0], squares[1], by_row, shaped(memory, a, (n,)), shaped(memory, a + n, (6,)),
        shaped(memory, a + n + 6, (PICKS,)),
    )  # fmt: skip
