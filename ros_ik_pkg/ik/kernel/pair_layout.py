"""The records of two chains over the same variables, each chain with its own task.

These types select the variants of compiled functions for a pair (see `compiled.variant_of`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kernel.data_layout import Geometry, Reach, Task, Workspace, joints_size, make_joints
from ros_ik_pkg.ik.kernel.numba_insides import shaped

ROWS = 12  # of both tasks, one below the other


class PairGeometry(NamedTuple):
    """Two chains over n variables, which have one set of limits."""

    first: Geometry
    second: Geometry
    lower: np.ndarray  # (n,)
    upper: np.ndarray  # (n,)
    wraps: np.ndarray  # (n,)


class PairReach(NamedTuple):
    """The bounds of both chains."""

    first: Reach
    second: Reach
    lengths: np.ndarray  # (2,) the longer ones [m]


class PairTask(NamedTuple):
    """The tasks of both chains."""

    first: Task
    second: Task
    first_in_base: Task  # the first target as the starts have it, in the base frame
    plain: float  # whether both tasks are


class PairStarts(NamedTuple):
    """The starts of searches: within a group the shared variables are the same, so the arms combine freely."""

    q: np.ndarray  # (n, m) float32 [rad, m]
    first: np.ndarray  # (7, m) float32: position and quaternion of the first tip in the base frame
    second: np.ndarray  # (7, m) float32
    side: np.ndarray  # (n,) which chain a variable moves: 0 both, 1 the first, 2 the second
    group: int  # starts in a group, one behind the other
    first_scores: np.ndarray  # (m,) float32: how far the first tip is from its target
    second_scores: np.ndarray  # (m,) float32


class PairWorkspace(NamedTuple):
    """The memory of a search for a pair: the workspaces of both tips, and their rows as one system.

    The fields are those of Workspace, without those for the null space, a trace and closed forms.
    """

    first: Workspace  # its q and dq are those of the pair
    second: Workspace
    columns: np.ndarray  # (n, 12)
    e: np.ndarray  # (12,)
    weights: np.ndarray  # (12,)
    y: np.ndarray  # (12,)
    rhs: np.ndarray  # (12,)
    sigma: np.ndarray  # (12,)
    A: np.ndarray  # (12, 12)
    U: np.ndarray  # (12, 12)
    W: np.ndarray  # (12, n)
    dq: np.ndarray  # (n,)
    q: np.ndarray  # (n,)
    near: np.ndarray  # (n,)
    best: np.ndarray  # (n,)
    seed: np.ndarray  # (n,)
    went: np.ndarray  # (n,)
    scales: np.ndarray  # (n,) or (0,)
    scores: np.ndarray  # (groups,) float32: how far the best combination of each group is from the targets
    clock: np.ndarray  # (2,)


SYSTEM = 5 * ROWS + 2 * ROWS * ROWS  # numbers besides those per variable
VECTORS = 7


@inlined
def pair_memory_size(first, second):
    """Return how many float64 make_pair_workspace needs."""
    n = int(first[0])
    return SYSTEM + n * (2 * ROWS + VECTORS) + tip_size(first) + tip_size(second)


@inlined
def tip_size(model):
    """Return how many float64 the workspace of one tip needs."""
    return joints_size(model) + 12 * int(model[0]) + 18


@inlined
def make_pair_workspace(first, second, memory, scores, integers, weighted):
    """Return a PairWorkspace in a block of memory; for kernels only."""
    n = int(first[0])
    rows, squares = shaped(memory, 0, (5, ROWS)), shaped(memory, 5 * ROWS, (2, ROWS, ROWS))
    a = SYSTEM + 2 * ROWS * n
    vectors = shaped(memory, a, (VECTORS, n))
    b = a + VECTORS * n
    c = b + tip_size(first)
    clock = shaped(integers, 0, (2,))
    one = make_tip(first, shaped(memory, b, (c - b,)), vectors, scores, clock)
    other = make_tip(second, shaped(memory, c, (tip_size(second),)), vectors, scores, clock)
    return PairWorkspace(
        one, other, shaped(memory, SYSTEM, (n, ROWS)), rows[0], rows[1], rows[2], rows[3], rows[4],
        squares[0], squares[1], shaped(memory, SYSTEM + ROWS * n, (ROWS, n)), vectors[0], vectors[1], vectors[2],
        vectors[3], vectors[4], vectors[5], shaped(memory, a + 6 * n, (weighted,)), scores, clock,
    )  # fmt: skip


@inlined
def make_tip(model, memory, vectors, scores, clock):
    """Return the workspace of one tip, without the memory for a system of its own."""
    n, a = int(model[0]), joints_size(model)
    by_column, sixes = shaped(memory, a, (2, n, 6)), shaped(memory, a + 12 * n, (3, 6))
    none, no_square = shaped(memory, 0, (0,)), shaped(memory, 0, (0, 0))
    return Workspace(
        make_joints(model, shaped(memory, 0, (a,))), by_column[0], sixes[0], sixes[1], sixes[2], no_square, none,
        no_square, no_square, none, vectors[0], vectors[1], none, none, none, none, none, by_column[1], none,
        no_square, scores, clock,
    )  # fmt: skip
