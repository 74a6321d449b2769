"""From one path to one result: poses in the base frame, joint positions, solve, final check."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from nav_msgs.msg import Path

from ros_ik_pkg.ik import (
    ArgumentError,
    Arm,
    NotCompiledError,
    PathOptions,
    PathSolution,
    SolveOptions,
    World,
    solve_path,
)
from ros_ik_pkg.ik.contacts.contacts import Contacts, Room
from ros_ik_pkg.ik.options import all_demanded
from ros_ik_pkg.ik.path.clear_of_room import ClearOfRoom
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.handling.path_check import fault_of_motion
from ros_ik_pkg.ros.handling.result import FAILED, INTERNAL_ERROR, REFUSED, SOLVED
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.input.target import Target

PARTIAL = 'partial'
MOST_SOLVES = 3  # of one path in a room that changes meanwhile


@dataclass(frozen=True)
class PathJob:
    """A path with everything that its solve depends on, at the time when the path arrived.

    arm: with the share of its velocity limits that velocity_scale leaves; source: the node's own. poses: (N, 4, 4) in
    the base frame [m].
    stamps: (N,) [s], None if the tip has no times to keep. seed: (n,). world: what the arm must stay clear of, None if
    contact does not count; contacts: the shapes of the arm.
    """

    message: Path
    arm: Arm
    poses: np.ndarray
    stamps: np.ndarray | None
    seed: np.ndarray
    options: SolveOptions
    path: PathOptions
    world: World | None = None
    contacts: Contacts | None = None
    source: Arm | None = None

    def room(self) -> Room | None:
        """Return the arm among what it must stay clear of: one of its own, since targets are checked meanwhile."""
        return None if self.world is None or self.contacts is None else Room(self.contacts, self.world)


@dataclass(frozen=True)
class PathResult:
    """What the node reports about one path; only a solved one has a motion that is published."""

    message: Path
    outcome: str
    status: str
    reason: str
    job: PathJob | None = None
    solution: PathSolution | None = None


def read_path(message: Path, handler: TargetHandler) -> PathJob | PathResult:
    """Return the job, or the result with the reason why the path is refused."""
    try:
        source = arm = handler.require_arm()
        poses = np.array([_base_from_pose(message, k, handler) for k in range(len(message.poses))]).reshape(-1, 4, 4)
        settings = handler.settings
        world, _ = handler.surroundings.world(arm, settings)
        contacts = arm.contacts if world is not None else None
        if settings.velocity_scale < 1.0:
            arm = replace(arm, velocity_limits=settings.velocity_scale * arm.velocity_limits)
        # A lead-in begins at the joint positions, whatever seed_source says.
        seed = handler.start(source) if settings.path.lead_in else handler.seed()
        options = all_demanded(settings.options)
        return PathJob(message, arm, poses, _stamps(message), seed, options, settings.path, world, contacts, source)
    except RefusedError as error:
        return refused(message, error.status, str(error))


def _base_from_pose(message: Path, k: int, handler: TargetHandler) -> np.ndarray:
    """Return pose k (4, 4) in the base frame; a pose without a frame is in that of the path.

    Transforms are those at the stamp of the path: the stamps of poses are times for the tip.
    """
    target, header = Target.of(message.poses[k]), message.header
    frame = target.frame_id or header.frame_id
    target = target._replace(sec=header.stamp.sec, nanosec=header.stamp.nanosec, frame_id=frame)
    try:
        return handler.base_from_target(target)
    except RefusedError as error:
        raise RefusedError(error.status, f'pose {k}: {error}') from None


def _stamps(message: Path) -> np.ndarray | None:
    """Return the stamps of the poses [s] from the first one, None if all are the same."""
    stamps = [pose.header.stamp for pose in message.poses]
    nanoseconds = [stamp.sec * 10**9 + stamp.nanosec for stamp in stamps]
    if len(set(nanoseconds)) < 2:
        return None
    return np.array([1e-9 * (value - nanoseconds[0]) for value in nanoseconds])


def answer_path(
    job: PathJob, go_on: Callable[[int], object], newest: Callable[[], World | None]
) -> PathResult:
    """Solve a path in the room as it is at the end.

    If the room has changed meanwhile, the motion is judged once more, and the path is solved again unless it passes.
    `go_on` is called repeatedly, and may raise RefusedError to end the solve; `newest` returns the World of the moment,
    the same object while nothing changes.
    """
    for _ in range(MOST_SOLVES):
        result, world = _answer_path(job, go_on), newest()
        if world is job.world:
            return result
        job = replace(job, world=world, contacts=None if world is None else job.source.contacts)
        if result.outcome == SOLVED and not _fault_in(job, result.solution):
            return replace(result, job=job)
    if result.outcome != SOLVED:
        return result
    return refused(job.message, 'room', f'the room changed while the path was solved, {MOST_SOLVES} times; the motions '
                   'touch what is there now')  # fmt: skip


def _fault_in(job: PathJob, solution: PathSolution) -> str:
    """Return why a motion must not be published in the room of a job, empty if it may."""
    try:
        return fault_of_motion(solution, job.arm, job.options, job.path, job.room())
    except ArgumentError as error:
        return str(error)


def _answer_path(job: PathJob, go_on: Callable[[int], object]) -> PathResult:
    """Solve a path in the room of the job."""
    try:
        room = job.room()
        solution = solve_path(
            job.arm, job.poses, job.seed, job.options, job.path, job.stamps, clear=_clear(room, job),
            progress=go_on,
        )  # fmt: skip
    except ArgumentError as error:
        return refused(job.message, 'argument', str(error))
    except RefusedError as error:
        return refused(job.message, error.status, str(error))
    except NotCompiledError as error:
        return refused(job.message, 'compiling', str(error))
    if not solution.complete:
        found = solution.breaks[0]
        outcome = PARTIAL if len(solution.q) > 1 else FAILED
        return PathResult(job.message, outcome, found.reason.value, shorten(found.text, 1000), job, solution)
    if fault := fault_of_motion(solution, job.arm, job.options, job.path, room):
        reason = f'internal error: the motion did not pass the final check, {fault}'
        return PathResult(job.message, FAILED, INTERNAL_ERROR, reason, job, solution)
    return PathResult(job.message, SOLVED, SOLVED, _described(solution), job, solution)


def _clear(room: Room | None, job: PathJob) -> Callable[[np.ndarray], np.ndarray]:
    """Return what says whether configurations (k, n) are free of contact."""
    if room is None:
        return lambda q: np.ones(len(q), dtype=bool)
    return ClearOfRoom(room, job.options, job.path)


def refused(message: Path, status: str, reason: str) -> PathResult:
    """Return the result of a path that is refused."""
    return PathResult(message, REFUSED, status, shorten(reason, 1000))


def _described(solution: PathSolution) -> str:
    """Describe a motion in a sentence."""
    count = len(solution.reconfigurations)
    return (
        f'{len(solution.q)} points, {solution.times[-1]:.3g} s, joints travel {solution.length:.3g} rad or m, '
        f'{count} reconfiguration{"" if count == 1 else "s"}'
    )
