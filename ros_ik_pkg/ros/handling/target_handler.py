"""From one target to one result: pose, frame, seed, solve, final check."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time as Stamp
from rclpy.clock import ROSClock
from std_msgs.msg import Header

from ros_ik_pkg.ik import ArgumentError, Arm, NotCompiledError, Solution, SolveOptions, Status, solve
from ros_ik_pkg.ik.solution import ROW_NAMES
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.handling.commands import Commands
from ros_ik_pkg.ros.handling.final_check import contact_of, describe, fault_of
from ros_ik_pkg.ros.handling.held_posture import HeldPosture
from ros_ik_pkg.ros.handling.joint_state_check import DoubtedError, JointStateCheck
from ros_ik_pkg.ros.handling.result import FAILED, INTERNAL_ERROR, REFUSED, SOLVED, Result
from ros_ik_pkg.ros.handling.surroundings import Surroundings
from ros_ik_pkg.ros.input.joint_states import JointStates
from ros_ik_pkg.ros.input.pose import target_pose
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.input.target import Target
from ros_ik_pkg.ros.input.tf_frames import TfFrames
from ros_ik_pkg.ros.interface.parameters import Settings

IDENTITY = np.eye(4)
CONVERGED = SOLVED, Status.CONVERGED.label, Status.CONVERGED.text


class TargetHandler:
    """Solves targets with the present arm, settings and joint states.

    awaited: returns why there is no robot, if there is none.
    streamed: returns the last command (n,) of the stream [rad, m], from which solves start; None without a stream.
    """

    def __init__(
        self, clock: ROSClock, frames: TfFrames, joint_states: JointStates, awaited: Callable[[], str]
    ) -> None:
        self.joint_states = joint_states
        self.joint_state_check = JointStateCheck()
        self._frames, self._awaited = frames, awaited
        self.arm: Arm | None = None
        self.parameters: Settings | None = None
        self.settings: Settings | None = None  # the parameters, with the held posture
        self._clock = clock
        self._commands = Commands(clock)
        self.streamed: Callable[[], np.ndarray | None] = lambda: None
        self._posture = HeldPosture()
        self.surroundings = Surroundings(joint_states)

    def take_over(self, settings: Settings, arm: Arm | None) -> list[str]:
        """Use these settings and this arm from the next target on; return why obstacles are left aside."""
        self._frames.set_timeout(settings.tf_timeout)
        self._commands.take_over(settings, arm)
        self.parameters, self.arm = settings, arm
        self.settings = self._posture.take_over(settings, arm)
        return [] if arm is None else self.surroundings.take_over(arm, self.base_from_header)

    def handle(self, target: Target, trace: bool, waited: float = math.inf) -> Result | None:
        """Return the result of a target, refused or not; None if it can still wait for its transform.

        waited: time since the target arrived [s].
        """
        try:
            return self._solve(target, trace, waited)
        except RefusedError as error:
            return self.without_solution(target, REFUSED, error.status, str(error))
        except ArgumentError as error:
            return self.without_solution(target, REFUSED, 'argument', str(error))
        except NotCompiledError as error:
            return self.without_solution(target, REFUSED, 'compiling', str(error))

    def base_from_target(self, target: Target) -> np.ndarray:
        """Return the pose (4, 4) of a target in the base frame, without waiting for its transform.

        Raises RefusedError if the target is malformed, its frame is not known, or there is no robot.
        """
        arm = self.require_arm()
        frame_from_target, _ = target_pose(target)
        base_from_frame, _ = self.base_from_frame(target.frame_id, target.stamp, arm)
        return base_from_frame @ frame_from_target

    def require_arm(self) -> Arm:
        """Return the arm; raise RefusedError if there is no robot, or two tips of it have targets of their own."""
        if self.arm is None:
            raise RefusedError('no_robot', self._awaited())
        if self.parameters.tip_frames:
            raise RefusedError('tip_frames', 'tip_frames names two tips; their targets come on first_target_pose and '
                               'second_target_pose')  # fmt: skip
        return self.arm

    def seed(self) -> np.ndarray:
        """Return the configuration (n,) from which a solve would start now; raise RefusedError if it is unknown."""
        return self._seed(self.require_arm())[0]

    def given_up(self, target: Target, status: str, why: str) -> Result:
        """Return the refusal of a target that no longer waits for its transform, for a given reason."""
        reason = f'{why} while this target waited for the transform of {target.frame_id!r}'
        return self.without_solution(target, REFUSED, status, reason)

    def internal_error(self, target: Target, error: Exception) -> Result:
        """Return the result of a target whose handling raised an unforeseen error."""
        reason = f'internal error {type(error).__name__}: {error}'
        return self.without_solution(target, FAILED, INTERNAL_ERROR, reason)

    def joint_states_age(self) -> float | None:
        """Return the age of the joint positions that seeds come from [s]; None if no seed needs them."""
        if self.arm is None or self.settings.seed_source != 'joint_states':
            return None
        if self.joint_states.empty and self.settings.home_until_joint_states:
            return None
        return self.joint_states.age(self.arm.joint_names)

    def without_solution(self, target: Target, outcome: str, status: str, reason: str) -> Result:
        """Return the result of a target that was not solved."""
        return Result(target, outcome, status, shorten(reason, 1000), self.settings.options.method, self.arm)

    def _solve(self, target: Target, trace: bool, waited: float) -> Result | None:
        arm = self.require_arm()
        self.refuse_stale(target.sec, target.nanosec, self.settings.target_timeout, 'target', 'target_timeout')
        frame_from_target, notes = target_pose(target)
        base_from_frame, frame_notes = self.base_from_frame(target.frame_id, target.stamp, arm, waited)
        if base_from_frame is None:
            return None
        base_from_target = frame_from_target if base_from_frame is IDENTITY else base_from_frame @ frame_from_target
        seed, seed_notes = self._seed(arm)
        if self._posture.awaited:
            self.settings = self._posture.hold(self.settings, seed)
        options = self.settings.options
        start = self._start(arm, seed)
        reference = self._reference(arm, seed, start)
        world, room_notes = self.surroundings.world(arm, self.settings)
        solution = solve(arm, base_from_target, seed, options, None if reference is seed else reference, trace, world)
        outcome, status, reason = judge(solution, base_from_target, arm, options)
        if solution.seed_clipped:
            seed_notes += ('seed outside the limits brought inside', *_degrees_note(arm, seed))
        result = Result(
            target, outcome, status, reason, options.method, arm, solution,
            notes + frame_notes + seed_notes + room_notes, base_from_target, seed,
            demanded_rows=options.demanded_rows(arm.n),
        )
        self._commands.complete(result, start, reference, self.settings)
        return result

    def take_obstacles(self, message: Any) -> list[str]:
        """Take obstacles of a MarkerArray or of MoveIt's messages; return why some are left aside."""
        return self.surroundings.take(message, self.arm, self.base_from_header)

    def base_from_header(self, header: Header) -> np.ndarray:
        """Return the pose (4, 4) of the frame of a header in the base frame; raise RefusedError if it is not known."""
        if self.arm is None:
            raise RefusedError('no_robot', self._awaited())
        return self.base_from_frame(header.frame_id, header.stamp, self.arm)[0]

    def refuse_stale(self, sec: int, nanosec: int, limit: float, what: str, parameter: str) -> None:
        """Refuse a message whose stamp is further than `limit` [s] from now, 0 for no limit; a stamp of 0 is now."""
        if not limit or not (sec or nanosec):
            return
        age = self._clock.now().nanoseconds / 1e9 - (sec + nanosec / 1e9)
        if age > limit:
            raise RefusedError('stale', f'{what} is {age:.3f} s old; {parameter} is {limit:g} s')
        if age < -limit:
            raise RefusedError(
                'future',
                f'{what} has a stamp {-age:.3f} s ahead of now; {parameter} is {limit:g} s: the clocks of two '
                'machines differ, or one of the nodes runs on simulated time (use_sim_time)',
            )

    def base_from_frame(
        self, frame: str, stamp: Stamp, arm: Arm, waited: float = math.inf
    ) -> tuple[np.ndarray | None, tuple[str, ...]]:
        """Return the pose (4, 4) of a frame of the robot or of TF in the base frame at a stamp, and notes.

        None if TF does not have it yet, and a message that has waited for `waited` [s] can still wait.
        """
        frame = frame.removeprefix('/')
        if frame in ('', arm.base_frame):
            return IDENTITY, ()
        if frame not in arm.frame_names and frame != arm.tool_frame and not self._frames.why_not:
            found = self._frames.base_from_frame(arm.base_frame, frame, stamp, waited)
            return found, ('frame of the target by TF',)
        return self._base_from_own_frame(arm, frame), ()

    def start(self, arm: Arm) -> np.ndarray:
        """Return the joint positions (n,) [rad, m] at which a motion starts; refuse it if they are not known."""
        seed, _ = self._seed(arm)
        return self._start(arm, seed)

    def _base_from_own_frame(self, arm: Arm, frame: str) -> np.ndarray:
        """Return the pose (4, 4) of a frame of the robot, by the joint states."""
        try:
            return arm.base_from_frame(frame, self.joint_states.positions(arm.joints_to(frame)))
        except ArgumentError as error:
            why_not = '' if frame in arm.frame_names else f'; {self._frames.why_not}'
            raise RefusedError('frame', f'target frame: {error}{why_not}') from error

    def _seed(self, arm: Arm) -> tuple[np.ndarray, tuple[str, ...]]:
        """Return the configuration (n,) to start from, as seed_source says."""
        source, streamed = self.settings.seed_source, self.streamed()
        if streamed is not None and source != 'home':
            return streamed, ()
        if source == 'last_solution' and self._commands.last is not None:
            return self._commands.last, ()
        if source != 'joint_states':
            return arm.home, ()
        if self.joint_states.empty and self.settings.home_until_joint_states:
            return arm.home, ('no joint state yet, started from home',)
        notes = self.joint_states.take_notes()
        try:
            return self._joint_state(arm), notes
        except DoubtedError as error:
            if self._commands.last is None:
                raise
            return self._commands.last, (*notes, f'continued from the last command: {error}')

    def _start(self, arm: Arm, seed: np.ndarray) -> np.ndarray:
        """Return the joint positions (n,) from which a step is measured: the seed, unless that is home."""
        if seed is not arm.home:
            return seed
        last = self._commands.last
        return self._joint_state_or(arm, seed if last is None else last)

    def _reference(self, arm: Arm, seed: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Return the configuration (n,) from which max_joint_jump, 'nearest' and whole turns are measured."""
        if self.settings.velocity_limiting != 'none':
            return start
        return self._joint_state_or(arm, seed) if self.settings.options.max_joint_jump > 0.0 else seed

    def _joint_state_or(self, arm: Arm, otherwise: np.ndarray) -> np.ndarray:
        """Return the joint state (n,), or `otherwise` if it is unknown or doubted."""
        try:
            return self._joint_state(arm)
        except RefusedError:
            return otherwise

    def _joint_state(self, arm: Arm) -> np.ndarray:
        """Return the joint state (n,); if steps are limited, only one that is not doubted."""
        if self.settings.velocity_limiting == 'none':
            return self.joint_states.seed(arm.joint_names)
        return self.joint_state_check.believed(self.joint_states, arm)


def _degrees_note(arm: Arm, seed: np.ndarray) -> tuple[str, ...]:
    """Return a note if a seed (n,) looks like degrees: an angle beyond two turns and twice its limits."""
    far = (np.abs(seed) > 4.0 * np.pi) & ((seed > 2.0 * arm.upper) | (seed < 2.0 * arm.lower))
    turning = [i for i in np.flatnonzero(far) if not arm.prismatic[arm.variable == i].any()]
    if not turning:
        return ()
    names = ', '.join(f'{arm.joint_names[i]} = {seed[i]:.4g}' for i in turning)
    return (f'the seed looks like degrees; radians are expected: {names}',)


def judge(solution: Solution, target: np.ndarray, arm: Arm, options: SolveOptions) -> tuple[str, str, str]:
    """Return outcome, cause and reason; a converged solution must pass the final check."""
    if not solution.converged:
        return FAILED, solution.status.label, _why(solution, arm, options)
    if fault := fault_of(solution.q, target, arm, options):
        return FAILED, INTERNAL_ERROR, f'internal error: an answer did not pass the final check, {fault}'
    if contact := contact_of(solution.q, None, solution.room, options):
        return FAILED, INTERNAL_ERROR, f'internal error: an answer did not pass the final check, {contact}'
    return CONVERGED if not solution.wished else (SOLVED, Status.CONVERGED.label, how_near(solution))


def how_near(solution: Solution) -> str:
    """Say how near a solution came to the rows that were wished for."""
    errors = [
        f'{error:.3g} {unit}'
        for error, unit, first in (
            (solution.wished_position_error, 'm', 0), (solution.wished_orientation_error, 'rad', 3)
        ) if set(ROW_NAMES[first : first + 3]) & set(solution.wished)
    ]  # fmt: skip
    return (f'within both tolerances in the demanded rows; in those wished for, {" ".join(solution.wished)}, '
            f'{" and ".join(errors)} off')


def _why(solution: Solution, arm: Arm, options: SolveOptions) -> str:
    """Return in words why there is no solution, and how near the best attempt came."""
    parts = [
        solution.status.text,
        (f'the best of {solution.attempts} attempts' if solution.attempts > 1 else 'the tip')
        + f' is {solution.position_error:.3g} m and {solution.orientation_error:.3g} rad off',
    ]
    if solution.status == Status.COLLISION:
        links = ' and '.join(solution.nearest_links)
        return f'{solution.status.text}; in the one with the least penetration {links} {describe(solution.contact)}'
    rows = np.count_nonzero(options.task_weights)
    if arm.n < rows and not solution.wished:
        parts.append(f'the arm has {arm.n} joints, fewer than the {rows} rows of the task: it cannot reach most poses; '
                     'set secondary to orientation, set entries of task_weights to 0, or allow an error with '
                     'task_tolerances')
    if solution.joints_at_limits:
        parts.append('at their limits: ' + ', '.join(arm.joint_names[i] for i in solution.joints_at_limits))
    if np.isfinite(solution.sigma_min):
        parts.append(f'smallest singular value {solution.sigma_min:.2g}')
    return '; '.join(parts)
