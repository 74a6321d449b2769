"""The records that the compiled functions hand to each other: named tuples of arrays and numbers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik.compiled import compiled
from ros_ik_pkg.ik.solution import TRACE_COLUMNS

TRACE_WIDTH = len(TRACE_COLUMNS)


class Geometry(NamedTuple):
    """One chain (see Arm): nj joints, n variables."""

    placements: np.ndarray  # (nj + 1, 12)
    prismatic: np.ndarray  # (nj,)
    variable: np.ndarray  # (nj,)
    multiplier: np.ndarray  # (nj,)
    offset: np.ndarray  # (nj,)
    lower: np.ndarray  # (n,)
    upper: np.ndarray  # (n,)
    wraps: np.ndarray  # (n,)


class Starts(NamedTuple):
    """Well-spread configurations to start from, and the poses that they reach, in single precision."""

    q: np.ndarray  # (m, n)
    positions: np.ndarray  # (3, m) in units of the arm's spread
    quaternions: np.ndarray  # (4, m)
    spread: float  # [m]


class Reach(NamedTuple):
    """A bound on where the arm can be (see reach.py)."""

    in_base: np.ndarray  # (3,) fixed point of the base [m]
    in_tip: np.ndarray  # (3,) fixed point of the tip frame [m]
    length: float  # largest distance of the two [m]
    tip_length: float  # largest distance of the tip from in_base [m]


class Tuning(NamedTuple):
    """SolveOptions as numbers; `SolveOptions.numbers` has the same order."""

    method: float
    max_iterations: float
    max_attempts: float
    deadline: float
    position_tolerance: float
    orientation_tolerance: float
    step_size: float
    max_joint_step: float
    dls_damping: float
    adaptive_dls_damping: float
    adaptive_dls_gain: float
    sdls_max_step: float
    respect_limits: float
    choice: float
    max_joint_jump: float


class Task(NamedTuple):
    """What is asked for: a pose in the base frame and the weights of its six error components."""

    R: tuple[float, ...]  # 9, row by row
    p: tuple[float, ...]  # 3 [m]
    weights: np.ndarray  # (6,)


class Workspace(NamedTuple):
    """Everything that a descent writes to, made once for a search."""

    axes: np.ndarray  # (nj, 6) axis and a point of each joint
    columns: np.ndarray  # (n, 6) Jacobian by columns
    e: np.ndarray  # (6,) weighted twist error
    y: np.ndarray  # (6,) solution of the Gram system
    A: np.ndarray  # (6, 6) Gram matrix
    diagonal: np.ndarray  # (6,) what is added to its diagonal
    U: np.ndarray  # (6, 6) left singular vectors, by rows
    W: np.ndarray  # (6, n) sigma_i v_i, by rows
    sigma: np.ndarray  # (6,)
    dq: np.ndarray  # (n,) step
    q: np.ndarray  # (n,) iterate
    best: np.ndarray  # (n,) iterate of smallest error over all attempts
    scores: np.ndarray  # (m,) how far each start is from the target
    clock: np.ndarray  # (2,) seconds and nanoseconds


class Recorder(NamedTuple):
    """Where the iterates go when somebody wants them; of length 0 when nobody does."""

    rows: np.ndarray  # (k, TRACE_WIDTH)
    q: np.ndarray  # (k, n)
    p: np.ndarray  # (k, 3)
    count: np.ndarray  # (1,) rows that would have been written
    U: np.ndarray  # (6, 6) scratch of the singular values
    W: np.ndarray  # (6, n)
    sigma: np.ndarray  # (6,)


@compiled
def make_workspace(joints, n, starts):
    """Allocate a Workspace for nj joints, n variables and m starts."""
    return Workspace(
        np.empty((joints, 6)), np.empty((n, 6)), np.empty(6), np.empty(6), np.empty((6, 6)), np.empty(6),
        np.empty((6, 6)), np.empty((6, n)), np.empty(6), np.empty(n), np.empty(n), np.empty(n),
        np.empty(starts, np.float32), np.empty(2, np.int64),
    )  # fmt: skip


@compiled
def make_recorder(capacity, n):
    """Allocate a Recorder for `capacity` iterates."""
    return Recorder(
        np.empty((capacity, TRACE_WIDTH)), np.empty((capacity, n)), np.empty((capacity, 3)), np.zeros(1, np.int64),
        np.empty((6, 6)), np.empty((6, n)), np.empty(6),
    )  # fmt: skip
