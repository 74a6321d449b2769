"""The reply to one target, collected from the messages about it."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

from diagnostic_msgs.msg import DiagnosticStatus
from trajectory_msgs.msg import JointTrajectory

from ros_ik_pkg.ros.handling.result import NOT_TRACED, NOTHING, STREAM
from ros_ik_pkg.ros.output.path_messages import row_time

MOTIONS = 16  # more than come between a motion and its result


@dataclass
class Reply:
    """Everything that the node published about one target.

    Attributes
    ----------
    stamp : (int, int)
        Seconds and nanoseconds of the target that was answered; every message about it carries them.
    status : DiagnosticStatus or None
        The status on `~/result`.
    joints : dict of str to float
        Joint positions by name [rad, m], as published; empty if nothing was published.
    iterations : list of dict
        The figures of every iteration, by name, if the client asked for them; empty while
        the node still compiles the code that records them.

    """

    stamp: tuple[int, int]
    status: DiagnosticStatus | None = None
    joints: dict[str, float] = field(default_factory=dict)
    iterations: list[dict[str, str]] = field(default_factory=list)

    @property
    def solved(self) -> bool:
        """Whether the target was solved; if not, `message` has the reason."""
        return self.status is not None and self.status.level == DiagnosticStatus.OK

    @property
    def published(self) -> str:
        """What `joints` are: the `solution`, a `step` towards it, the `closest` approach, or `nothing`.

        `stream`: the answer is the goal of the stream of commands, which comes under its own stamps.
        """
        return self.figures.get('published', NOTHING)

    @property
    def message(self) -> str:
        """The node's sentence about the target."""
        return self.status.message if self.status else 'no result'

    @property
    def figures(self) -> dict[str, str]:
        """The figures of the result, by name."""
        return values(self.status) if self.status else {}

    def is_whole(self, with_iterations: bool) -> bool:
        """Whether everything that belongs to the outcome has arrived."""
        figures = self.figures
        lacks_joints = self.published not in (NOTHING, STREAM) and not self.joints
        traced = 'iterations' in figures and NOT_TRACED not in figures.get('notes', '')
        lacks_iterations = with_iterations and traced and not self.iterations
        return self.status is not None and not lacks_joints and not lacks_iterations


@dataclass
class PathReply:
    """Everything that the node published about one path.

    Attributes
    ----------
    status : DiagnosticStatus
        The status on `~/path_result`.
    trajectory : JointTrajectory or None
        The motion; None if the path was not completely solved.

    """

    status: DiagnosticStatus
    trajectory: JointTrajectory | None = None

    @property
    def solved(self) -> bool:
        """Whether the whole path was solved; if not, `message` has the reason."""
        return self.status.level == DiagnosticStatus.OK

    @property
    def message(self) -> str:
        """The node's sentence about the path."""
        return self.status.message

    @property
    def figures(self) -> dict[str, str]:
        """The figures of the result, by name."""
        return values(self.status)


def values(status: DiagnosticStatus) -> dict[str, str]:
    """Return the key-value pairs of a diagnostic status."""
    return {pair.key: pair.value for pair in status.values}


class PathMotions:
    """The last few motions on `~/path_solution`, of whatever path: a result may come before its motion."""

    def __init__(self) -> None:
        self._motions: deque[JointTrajectory] = deque(maxlen=MOTIONS)

    def add(self, motion: JointTrajectory) -> None:
        """Keep a motion."""
        self._motions.append(motion)

    def clear(self) -> None:
        """Forget all motions."""
        self._motions.clear()

    def of(self, figures: Mapping[str, str]) -> JointTrajectory | None:
        """Return the motion of a path's result, if it is there.

        It is known by its points and its duration: its stamp is 0, which joint_trajectory_controller takes for now.
        """
        points, end = int(figures['points']), row_time(float(figures['duration']))
        return next((m for m in self._motions if len(m.points) == points and m.points[-1].time_from_start == end), None)
