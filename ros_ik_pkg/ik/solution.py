"""What a solve returns: the stop reason, the joint positions, the figures that belong to them."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np

TRACE_COLUMNS = (
    'attempt',
    'iteration',
    'position_error',
    'orientation_error',
    'error_norm',
    'step_norm',
    'damping',
    'sigma_min',
    'condition_number',
    'manipulability',
    'joints_at_limits',
)


class Status(enum.IntEnum):
    """Why a descent or a whole search stopped; the compiled loop uses the same numbers."""

    CONVERGED = 0
    MAX_ITERATIONS = 1
    STALLED = 2
    OSCILLATING = 3
    DIVERGED = 4
    NOT_FINITE = 5
    DEADLINE = 6
    UNREACHABLE = 7
    JOINT_JUMP = 8

    @property
    def label(self) -> str:
        """Lower-case word used in messages, tables and docs, such as 'max_iterations'."""
        return self.name.lower()

    @property
    def text(self) -> str:
        """One sentence for people."""
        return _TEXTS[self]

    def __str__(self) -> str:
        return self.label

    def __format__(self, spec: str) -> str:
        return format(self.label, spec)


_TEXTS = {
    Status.CONVERGED: 'within both tolerances',
    Status.MAX_ITERATIONS: 'the iterations ran out while the error was still falling',
    Status.STALLED: 'the error no longer falls: a local minimum, joint limits in the way, or out of reach',
    Status.OSCILLATING: 'the error goes up and down without falling',
    Status.DIVERGED: 'the error grew: the step left the region where the linear model holds',
    Status.NOT_FINITE: 'the step was not a finite number: the Jacobian is singular and the method has no damping',
    Status.DEADLINE: 'the time ran out',
    Status.UNREACHABLE: 'out of reach: every descent ends at a distance from the target',
    Status.JOINT_JUMP: 'answers exist, but each is further from the reference than max_joint_jump allows',
}


@dataclass(frozen=True)
class Trace:
    """Every iterate of every attempt, and what the step taken from it was.

    `rows` is (k, len(TRACE_COLUMNS)) float64, one row for each configuration that was judged, start
    included, so an attempt of k steps has k + 1 rows; `step_norm` and `damping` are those of the step
    taken from the row's configuration (0 in an attempt's last row). `joint_positions` is (k, n) [rad, m],
    `tip_positions` is (k, 3) [m] in the base frame. `truncated` says that rows were lost to `capacity`.
    """

    rows: np.ndarray
    joint_positions: np.ndarray
    tip_positions: np.ndarray
    truncated: bool = False

    def column(self, name: str) -> np.ndarray:
        """Return the (k,) column called `name` (one of TRACE_COLUMNS)."""
        return self.rows[:, TRACE_COLUMNS.index(name)]

    def __len__(self) -> int:
        return len(self.rows)


@dataclass(slots=True)
class Solution:
    """The best configuration that a search found; every figure is that of `q`.

    q: (n,) joint positions [rad, m] in the arm's joint order.
    status: why the search stopped; `converged` is true only within both tolerances (and limits).
    position_error [m], orientation_error [rad]: norms of the two halves of the twist error of the task.
    iterations: steps taken over all attempts. attempts: descents made, the one from the seed included.
    joint_distance: largest |q - reference| over the joints [rad, m].
    sigma_min: smallest singular value of the task Jacobian at q; NaN where the search converged.
    seed_clipped: the seed was outside the limits and was brought inside first.
    solve_time: seconds inside the compiled search.
    solutions: (k, n) distinct answers by their distance from the reference, q the first, with choice='all'; else None.
    trace: every iterate, where it was asked for.
    """

    q: np.ndarray
    status: Status
    position_error: float
    orientation_error: float
    iterations: int
    attempts: int
    joint_distance: float
    sigma_min: float
    limits_mask: int
    seed_clipped: bool
    solve_time: float
    solutions: np.ndarray | None = None
    trace: Trace | None = None

    @property
    def joints_at_limits(self) -> tuple[int, ...]:
        """Indices of the joints of q that sit on a limit."""
        return tuple(i for i in range(len(self.q)) if self.limits_mask >> i & 1)

    @property
    def converged(self) -> bool:
        """Whether q is an answer; anything else is the best approach only."""
        return self.status is Status.CONVERGED
