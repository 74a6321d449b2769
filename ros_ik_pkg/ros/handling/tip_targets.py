"""Targets of two tips, if tip_frames names two: each target of either tip is answered by one solve of both."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable

import numpy as np
from rclpy.node import Node

from ros_ik_pkg.ik import ArgumentError, ArmTree, OptionError, Solution, SolveOptions, prepare_tips, solve_tips
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.handling.final_check import contact_of, describe, fault_of_command, fault_of_pose
from ros_ik_pkg.ros.handling.result import FAILED, INTERNAL_ERROR, REFUSED, SOLVED, Command, Result
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.input.pose import target_pose
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.input.robot_source import RobotSource
from ros_ik_pkg.ros.input.target import UNREAD, Target
from ros_ik_pkg.ros.input.target_reader import read_target
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.interface.parameters import Settings

HELD = 'the other tip has had no target: it is held where it is'
# Parameters for one tip only, and the values that switch them off
ONE_TIP_ONLY = {'velocity_limiting': 'none', 'out_of_reach': 'hold', 'compare': (), 'tool': ()}


class TipTargets:
    """Solves the targets of two tips, each together with the newest target or the present pose of the other tip.

    answer(result, arrived): publishes a result. A target of the first tip in the frame of the second one is relative.
    """

    def __init__(
        self, node: Node, handler: TargetHandler, source: RobotSource, answer: Callable[[Result, float], object]
    ) -> None:
        self._node, self._handler, self._source, self._answer = node, handler, source, answer
        self.arms: ArmTree | None = None
        self._pending: ArmTree | None = None
        self._last: np.ndarray | None = None
        self._newest: list[tuple[np.ndarray, bool] | None] = [None, None]  # pose in its frame, whether relative

    def prepare(self, settings: Settings, arm_changes: bool) -> ArmTree | None:
        """Return the arms of the settings, reloaded if they change, or None for one tip; raise IkError."""
        self._pending = self._source.load_tips(settings) if arm_changes else self.arms
        check_settings(settings, self._pending)
        return self._pending

    def take_over(self) -> None:
        """Use the arms that were prepared last, from the next target on."""
        arms = self._pending
        if arms is self.arms:
            return
        if arms is not None:
            self._node.get_logger().info(
                f'two tips, {" and ".join(arms.tip_frames)}, {arms.n} joints: {", ".join(arms.joint_names)}; '
                'their search is compiled once on a machine, in about a minute')
            _ = arms.packed, arms.packed_relative, arms.starts
            if self._handler.parameters.options.avoid_collisions:  # the shapes are read before a target needs them
                for text in arms.contacts.warnings:
                    self._node.get_logger().warning(text)
            prepare_tips()
        self.arms, self._last, self._newest = arms, None, [None, None]

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of the topics of targets."""
        tips = topics.FIRST_TARGET_POSE.name, topics.SECOND_TARGET_POSE.name
        return (topics.TARGET_POSE.name,) if self.arms is None else tips

    def put(self, tip: int, data: bytes) -> None:
        """Answer the target of a tip, 0 or 1, the bytes of a PoseStamped."""
        arrived, target = time.perf_counter(), UNREAD
        try:
            target = read_target(data)
            result = self.handle(tip, target)
        except Exception as error:  # an unforeseen error must not end the node
            self._node.get_logger().error(traceback.format_exc(), throttle_duration_sec=1.0)
            result = self._handler.internal_error(target, error)
        self._answer(result, arrived)

    def handle(self, tip: int, target: Target) -> Result:
        """Return the one result of a target of a tip, 0 or 1."""
        try:
            return self._solve(tip, target)
        except RefusedError as error:
            status, reason = error.status, str(error)
        except ArgumentError as error:
            status, reason = 'argument', str(error)
        method = self._handler.settings.options.method
        return Result(target, REFUSED, status, shorten(reason, 1000), method, self.arms)

    def _solve(self, tip: int, target: Target) -> Result:
        settings, arms = self._handler.settings, self.arms
        if arms is None:
            raise RefusedError('no_tips', 'tip_frames does not name two tips; targets of one tip come on target_pose')
        self._handler.refuse_stale(target.sec, target.nanosec, settings.target_timeout, 'target', 'target_timeout')
        pose, notes = target_pose(target)
        relative = tip == 0 and target.frame_id.removeprefix('/') == arms.tip_frames[1]
        if not relative:
            base_from_frame, frame_notes = self._handler.base_from_frame(target.frame_id, target.stamp, arms.arms[0])
            pose, notes = base_from_frame @ pose, notes + frame_notes
        seed = self._seed(arms)
        newest = [*self._newest]
        newest[tip] = pose, relative
        targets, relative, held = _targets(newest, arms, seed)
        world, room_notes = self._handler.surroundings.world(arms, settings)
        solution = solve_tips(arms, targets, seed, settings.options, relative=relative, world=world)
        outcome, status, reason = _judge(arms, solution, targets, relative, seed, settings)
        clipped = ('seed outside the limits brought inside',) if solution.seed_clipped else ()
        result = Result(target, outcome, status, reason, settings.options.method, arms, solution,
                        notes + room_notes + held + clipped, seed=seed)  # fmt: skip
        if outcome == SOLVED:
            self._last, self._newest = solution.q, newest
            result.command = Command(solution.q, seed, settings.velocity_scale * arms.velocity_limits)
        return result

    def _seed(self, arms: ArmTree) -> np.ndarray:
        """Return the configuration (n,) to start from, as seed_source says."""
        settings, joint_states = self._handler.settings, self._handler.joint_states
        if settings.seed_source == 'last_solution' and self._last is not None:
            return self._last
        unknown = joint_states.empty and settings.home_until_joint_states
        if settings.seed_source != 'joint_states' or unknown:
            return arms.home
        return joint_states.seed(arms.joint_names)


def check_settings(settings: Settings, arms: ArmTree | None) -> None:
    """Raise OptionError for settings that two tips do not support."""
    if arms is None:
        return
    for name, value in ONE_TIP_ONLY.items():
        if getattr(settings, name) != value:
            raise OptionError(f'{name} is {getattr(settings, name)!r}; with tip_frames it must be {value!r}')
    if settings.servo.command_rate > 0.0:
        raise OptionError('command_rate is above 0; with tip_frames it must be 0.0')
    if settings.options.null_space != 'none':
        raise OptionError("null_space is for one tip; with tip_frames it must be 'none'")
    settings.options.check_lengths(arms.n)


def _targets(
    newest: list[tuple[np.ndarray, bool] | None], arms: ArmTree, seed: np.ndarray
) -> tuple[tuple[np.ndarray, np.ndarray], bool, tuple[str, ...]]:
    """Return both targets, whether the first is relative, and notes; a tip without a target stays where it is."""
    first, second = (kept or (pose, False) for kept, pose in zip(newest, arms.forward(seed)))
    return (first[0], second[0]), first[1], (HELD,) if None in newest else ()


def _judge(
    arms: ArmTree, solution: Solution, targets: tuple[np.ndarray, np.ndarray], relative: bool, start: np.ndarray,
    settings: Settings,
) -> tuple[str, str, str]:
    """Return outcome, cause and reason; a converged solution must pass the final check of both tips."""
    options = settings.options
    if not solution.converged:
        reason = (f'{solution.status.text}; the tip that is further off is {solution.position_error:.3g} m and '
                  f'{solution.orientation_error:.3g} rad off')
        if solution.room is not None and solution.status.label == 'collision':
            reason = f'{solution.status.text}; {" and ".join(solution.nearest_links)} {describe(solution.contact)}'
        return FAILED, solution.status.label, reason
    fault = fault_of_pair(solution.q, targets, relative, arms, options)
    if fault or (fault := contact_of(solution.q, None, solution.room, options)):
        return FAILED, INTERNAL_ERROR, f'internal error: an answer did not pass the final check, {fault}'
    if settings.check_motion and (contact := contact_of(solution.q, start, solution.room, options, True)):
        return FAILED, 'collision', f'not published: {contact}'
    return SOLVED, solution.status.label, solution.status.text


def fault_of_pair(
    q: np.ndarray, targets: tuple[np.ndarray, np.ndarray], relative: bool, arms: ArmTree, options: SolveOptions
) -> str:
    """Return why q (n,) must not be published for both targets; empty if it may. By Pinocchio, which shares no code
    with the search."""
    if fault := fault_of_command(q, arms, options):
        return fault
    positions = dict(zip(arms.joint_names, q.tolist()))
    first, second = (arms.arms[0].base_from_frame(tip, positions) for tip in arms.tip_frames)
    first = np.linalg.inv(second) @ first if relative else first
    for name, pose, target in zip(arms.tip_frames, (first, second), targets):
        if fault := fault_of_pose(pose, target, options):
            return f'{name}: {fault}'
    return ''
