"""What a solve returns: the stop reason, the joint positions, the figures that belong to them."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Any

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


ROW_NAMES = ('x', 'y', 'z', 'rx', 'ry', 'rz')  # of a task


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
    COLLISION = 9

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


STATUSES = tuple(Status)
CONVERGED = int(Status.CONVERGED)

_TEXTS = {
    Status.CONVERGED: 'within both tolerances',
    Status.MAX_ITERATIONS: 'the iterations ran out while the error was still falling',
    Status.STALLED: 'the error no longer falls: a local minimum, joint limits in the way, or out of reach',
    Status.OSCILLATING: 'the error goes up and down without falling',
    Status.DIVERGED: 'the error grew: the step left the region where the linear model holds',
    Status.NOT_FINITE: 'the step was not a finite number: the Jacobian is singular and the method has no damping',
    Status.DEADLINE: 'the time ran out',
    Status.UNREACHABLE: 'out of reach: no joint positions within the limits lead to the target',
    Status.JOINT_JUMP: 'answers exist, but each is further from the reference than max_joint_jump allows',
    Status.COLLISION: 'configurations within both tolerances exist, but in each that was found something touches',
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


# What the compiled code writes behind the n joint positions of a row.
FIGURES = (
    'status',
    'found',
    'iterations',
    'attempts',
    'position_error',
    'orientation_error',
    'joint_distance',
    'sigma_min',
    'limits_mask',
    'seed_clipped',
    'completeness',
    'solve_time',
    'wished_rows',
    'wished_position_error',
    'wished_orientation_error',
)
# What a search knows of the solutions that it does not return, by the number that the compiled code writes.
COMPLETENESS = ('', 'exhaustion', 'family', 'proof')
NOT_KNOWN, BY_EXHAUSTION, FAMILY, BY_PROOF = range(len(COMPLETENESS))


def _figure(name: str, kind: Any, text: str) -> Any:
    """Make a property that reads one figure of the row, so that unused figures cost nothing."""
    place = FIGURES.index(name) - len(FIGURES)
    return property(lambda self: kind(self.row[place]), doc=text)


class Solution:
    """The best configuration that a search found; every figure is that of `q`.

    Attributes
    ----------
    row : (n + len(FIGURES),) array
        q and the figures, as the compiled code wrote them.
    solutions : (k, n) array or None
        With choice='all' the distinct answers by their distance from the reference, q the first.
    trace : Trace or None
        Every iterate, if it was asked for.
    room : contacts.Room or None
        What the arm was kept clear of; None if contact did not count.

    """

    __slots__ = ('_contact', 'room', 'row', 'solutions', 'trace')

    def __init__(
        self, row: np.ndarray, solutions: np.ndarray | None = None, trace: Trace | None = None, room: Any = None
    ) -> None:
        self.row = row
        self.solutions = solutions
        self.trace = trace
        self.room = room
        self._contact: Any = None

    @property
    def q(self) -> np.ndarray:
        """Joint positions (n,) [rad, m] in the arm's joint order."""
        return self.row[: -len(FIGURES)]

    @property
    def status(self) -> Status:
        """Why the search stopped."""
        return STATUSES[int(self.row[-len(FIGURES)])]

    @property
    def converged(self) -> bool:
        """Whether q is a solution, within tolerances and limits; otherwise it is only the closest approach."""
        return bool(self.row[-len(FIGURES)] == CONVERGED)

    @property
    def clearance(self) -> float:
        """Distance of the nearest two bodies at q [m], by coal; negative if they overlap, inf if there is no pair to
        check, NaN if contact did not count."""
        return self.contact.clearance if self.room is not None else math.nan

    @property
    def nearest_links(self) -> tuple[str, ...]:
        """Names of the nearest two bodies: links, obstacles or 'floor'."""
        return self.contact.links if self.room is not None else ()

    @property
    def contact(self) -> Any:
        """The nearest two bodies as a Contact, computed at first use; only if contact counted."""
        if self._contact is None:
            self._contact = self.room.look(self.q)
        return self._contact

    iterations = _figure('iterations', int, 'Steps taken over all attempts.')
    attempts = _figure('attempts', int, 'Descents made, the one from the seed included.')
    position_error = _figure('position_error', float, 'Norm of the position rows of the task error [m].')
    orientation_error = _figure('orientation_error', float, 'Norm of the orientation rows of the task error [rad].')
    joint_distance = _figure('joint_distance', float, 'Largest ``|q - reference|`` over the joints [rad, m].')
    sigma_min = _figure(
        'sigma_min', float, 'Smallest singular value of the task Jacobian at q; NaN if the search converged.'
    )
    wished_position_error = _figure(
        'wished_position_error', float, 'Norm of the wished position rows of the error [m]; NaN without wished rows.'
    )
    wished_orientation_error = _figure(
        'wished_orientation_error', float,
        'Norm of the wished orientation rows of the error [rad]; NaN without wished rows.',
    )
    limits_mask = _figure('limits_mask', int, 'Number whose bit i is set if joint i is at a limit.')
    seed_clipped = _figure('seed_clipped', bool, 'The seed was outside the limits and was brought inside first.')
    completeness = _figure(
        'completeness', lambda number: COMPLETENESS[int(number)] if number > 0 else '',
        "What is known of other solutions. 'proof': there are none within the limits but those in `solutions`, with "
        "choice='nearest' none is nearer than q, and after a failure there is none at all. 'exhaustion': so it is very "
        "likely, for further attempts found nothing. 'family': the pose is singular, and solutions form a continuous "
        "family, of which some are listed. '': nothing. With contact, 'nearest' leaves out what only coal calls clear.",
    )
    solve_time = _figure('solve_time', float, 'Seconds inside the compiled search.')

    @property
    def wished(self) -> tuple[str, ...]:
        """Names of the rows that were wished for only: their errors are as small as the demanded rows allow."""
        mask = self.row[FIGURES.index('wished_rows') - len(FIGURES)]
        return tuple(name for r, name in enumerate(ROW_NAMES) if int(mask) >> r & 1) if mask > 0 else ()

    @property
    def joints_at_limits(self) -> tuple[int, ...]:
        """Indices of the joints of q that are at a limit."""
        mask = self.limits_mask
        return tuple(i for i in range(len(self.q)) if mask >> i & 1)

    def __repr__(self) -> str:
        figures = ', '.join(f'{name}={getattr(self, name)}' for name in FIGURES if hasattr(type(self), name))
        return f'Solution(q={self.q.tolist()}, {figures})'
