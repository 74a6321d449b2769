"""The records of LANES descents side by side."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kernel.data_layout import Geometry, Reach
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.kernel.wide import LANES, wide_view

# The figures of a descent: error norm, the smallest so far, that of the mark, steps taken to the mark and in all, how
# many without progress it may take, whether there is a target in the lane, and whether the lane takes the next step.
NORM, NEAREST, MARK, MARK_STEP, STEP, PATIENCE, LIVE, MOVES = range(8)
FIGURES = 8


class Lanes(NamedTuple):
    """The descents: arrays of Wide numbers.

    Some have the names that they have in a Workspace, so that functions which are written for one target work here too.
    """

    q: np.ndarray  # (n,) iterates
    dq: np.ndarray  # (n,) steps
    sines: np.ndarray  # (nj,) of the joint values
    cosines: np.ndarray  # (nj,)
    axes: np.ndarray  # (nj, 6) axis and a point of each joint
    columns: np.ndarray  # (n, 6) Jacobians by columns
    e: np.ndarray  # (6,) errors
    goals: np.ndarray  # (12,) rotation, row by row, and position of each target
    figures: np.ndarray  # (FIGURES,)
    weights: np.ndarray  # (6,) float64, all 1
    # The same memory as float64, to read and write one lane
    q_of: np.ndarray  # (n, LANES)
    goal_of: np.ndarray  # (12, LANES)
    figure_of: np.ndarray  # (FIGURES, LANES)


class Batch(NamedTuple):
    """The arm and the targets, as `solve_range` takes them."""

    geometry: Geometry
    reach: Reach
    starts: np.ndarray
    tuning: Any
    weights: np.ndarray  # (6,), all 1
    tolerances: np.ndarray  # (6,), all 0
    scale: float  # the length of the arm in `score_starts` [m]
    close: float  # error norm from which `search` tries Levenberg-Marquardt
    targets: np.ndarray  # (4 N, 4)
    seeds: np.ndarray  # (N n,)
    references: np.ndarray  # (N n,)
    out: np.ndarray  # (N, n + figures)


class Desk(NamedTuple):
    """What is kept of the target in each lane beside its descent, and scratch for one configuration."""

    row: np.ndarray  # (LANES,) its place in the batch, -1 for none
    steps: np.ndarray  # (LANES,) taken in the attempts before this one
    attempts: np.ndarray  # (LANES,) before this one
    nearest: np.ndarray  # (LANES,) the start nearest to it, -1 before the starts are scored
    scores: np.ndarray  # (LANES, m) how far each start is from it
    began: np.ndarray  # (LANES,) when the lane took it [s]
    solved: np.ndarray  # (1,) when a target was solved last [s]
    next: np.ndarray  # (1,) place of the target that is taken next
    clock: np.ndarray  # (2,) int64
    q: np.ndarray  # (n,)


@inlined
def lanes_size(model):
    """Return how many float64 make_lanes cuts up for a packed arm."""
    return LANES * (8 * int(model[0]) + 8 * int(model[1]) + 18 + FIGURES)


@inlined
def make_lanes(model, memory, weights):
    """Cut the Lanes of a packed arm from aligned memory."""
    n, joints = int(model[0]), int(model[1])
    goals, figures = n, n + 12
    dq = figures + FIGURES
    e, columns = dq + n, dq + n + 6
    axes = columns + 6 * n
    sines = axes + 6 * joints
    return Lanes(
        wide_view(memory, 0, (n,)), wide_view(memory, dq, (n,)), wide_view(memory, sines, (joints,)),
        wide_view(memory, sines + joints, (joints,)), wide_view(memory, axes, (joints, 6)),
        wide_view(memory, columns, (n, 6)), wide_view(memory, e, (6,)), wide_view(memory, goals, (12,)),
        wide_view(memory, figures, (FIGURES,)), weights,
        shaped(memory, 0, (n, LANES)), shaped(memory, goals * LANES, (12, LANES)),
        shaped(memory, figures * LANES, (FIGURES, LANES)),
    )  # fmt: skip
