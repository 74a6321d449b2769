"""The result of one target: outcome, cause, reason, solution and command."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ros_ik_pkg.ik import Arm, Solution, Status
from ros_ik_pkg.ik.contacts.contacts import Room
from ros_ik_pkg.ros.handling.velocity_limiting import travel_time
from ros_ik_pkg.ros.input.target import Target

SOLVED, FAILED, REFUSED = 'solved', 'failed', 'refused'
INTERNAL_ERROR = 'internal_error'
NOT_TRACED = 'no iterations, they are still being compiled'  # a note
# What is published on ~/solution; a target that is a goal of the stream has no message of its own.
SOLUTION, STEP, CLOSEST, STREAM, NOTHING = 'solution', 'step', 'closest', 'stream', 'nothing'


@dataclass(slots=True)
class Command:
    """Joint positions that are published for a target.

    q: (n,) [rad, m], reached from start (n,) with the velocity limits (n,) [rad/s, m/s]. published: SOLUTION,
    STEP towards it, CLOSEST, to which q leads, or STREAM, whose goal q is.
    errors: of q [m, rad], None if it is the solution itself.
    fraction and step_time [s]: the share of the step that was taken, and its time; None if steps are not limited.
    """

    q: np.ndarray
    start: np.ndarray
    velocity_limits: np.ndarray
    published: str = SOLUTION
    errors: tuple[float, float] | None = None
    fraction: float | None = None
    step_time: float | None = None

    @property
    def duration(self) -> float:
        """The shortest time from start to q within the velocity limits [s], 0 if none is known."""
        return travel_time(self.start, self.q, self.velocity_limits)


@dataclass(slots=True)
class Result:
    """Everything that the node reports about one target.

    `cause` is one word: the label of the solver's status, the cause of a refusal, or INTERNAL_ERROR. The solve began
    at `seed` (n,) and had the goal `base_from_target` (4, 4). Fields that the target did not reach are None.
    `service`: the service that asked, for which there is no command; else empty.
    """

    target: Target
    outcome: str
    status: str
    reason: str
    method: str
    arm: Arm | None = None
    solution: Solution | None = None
    notes: tuple[str, ...] = ()
    base_from_target: np.ndarray | None = None
    seed: np.ndarray | None = None
    command: Command | None = None
    demanded_rows: tuple[str, ...] = ()  # if other rows were wished for only
    service: str = ''
    least_clearance: float | None = None  # cached by `clearance`

    @property
    def clearance(self) -> float:
        """Clearance of the solution [m]: by coal if it touches, else a lower bound that takes microseconds.

        It is computed at first use. NaN if contact did not count.
        """
        if self.least_clearance is None:
            room = self.room
            if room is None:
                self.least_clearance = math.nan
            elif self.solution.status == Status.COLLISION:
                self.least_clearance = self.solution.clearance
            else:
                self.least_clearance = room.least_clearance(self.solution.q)
        return self.least_clearance

    @property
    def touching(self) -> tuple[str, ...]:
        """Names of the two bodies whose contact prevents a solution: links, obstacles or 'floor'; else empty."""
        touches = self.room is not None and self.solution.status == Status.COLLISION
        return self.solution.nearest_links if touches else ()

    @property
    def room(self) -> Room | None:
        """The arm in its world, None if contact did not count."""
        return None if self.solution is None else self.solution.room

    def fail(self, status: str, reason: str) -> None:
        """Turn a solved result into a failed one, without a command."""
        self.outcome, self.status, self.reason = FAILED, status, reason
