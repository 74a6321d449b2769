"""What becomes of one target: an answer with an outcome and a reason, or a refusal on the way there."""

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
    fraction and step_time [s]: how much of the step was taken, and in what time; None if steps are not limited.
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
    """What the node has to say about one target.

    `cause` is one word: the label of the solver's status, the cause of a refusal, or INTERNAL_ERROR.
    What was solved is `base_from_target` (4, 4) from `seed` (n,); what goes out to the arm is `command`. Fields are
    None if the target did not get that far. `service`: the one that asked; nothing is commanded for that.
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
    service: str = ''
    least_clearance: float | None = None  # as `clearance` found it

    @property
    def clearance(self) -> float:
        """Distance from contact of the configuration that was found [m]: by coal if it touches, else a lower bound,
        computed in microseconds when it is first asked for. NaN if contact did not count."""
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
        """Names of the two that touch if that is why there is no solution: links, obstacles or 'floor'."""
        touches = self.room is not None and self.solution.status == Status.COLLISION
        return self.solution.nearest_links if touches else ()

    @property
    def room(self) -> Room | None:
        """What the arm was kept clear of, None if contact did not count."""
        return None if self.solution is None else self.solution.room

    def fail(self, status: str, reason: str) -> None:
        """Take back what was called solved."""
        self.outcome, self.status, self.reason = FAILED, status, reason
