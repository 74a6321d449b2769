"""The IK node: targets in, solutions and results out."""

from __future__ import annotations

import contextlib
import time
import traceback
from functools import partial
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import qos_policy_name_from_kind
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool

from ros_ik_pkg.ik import Arm, Compilation, IkError
from ros_ik_pkg.ik.kernel.cache_folder import CACHE_FOLDER
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.handling.result import NOT_TRACED, REFUSED, SOLVED, STREAM, Result
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.handling.target_queue import TargetQueue
from ros_ik_pkg.ros.handling.tip_targets import TipTargets
from ros_ik_pkg.ros.handling.tools import Tools
from ros_ik_pkg.ros.input.joint_states import JointStates
from ros_ik_pkg.ros.input.robot_source import RobotSource, check_options, follows_topic
from ros_ik_pkg.ros.input.target import UNREAD, Target
from ros_ik_pkg.ros.input.target_reader import read_target
from ros_ik_pkg.ros.input.tf_frames import TfFrames
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.interface.parameters import Parameters, Settings
from ros_ik_pkg.ros.output.comparison import Comparison
from ros_ik_pkg.ros.output.diagnostics import Diagnostics
from ros_ik_pkg.ros.output.moveit_services import MoveItServices
from ros_ik_pkg.ros.output.paths import Paths
from ros_ik_pkg.ros.output.publisher import Publisher
from ros_ik_pkg.ros.output.publishers import Publishers
from ros_ik_pkg.ros.output.reach import Reach
from ros_ik_pkg.ros.output.statuses import servo_message
from ros_ik_pkg.ros.runtime.companion_node import let_owner_destroy
from ros_ik_pkg.ros.runtime.node_names import name_in_statuses
from ros_ik_pkg.ros.runtime.timers import OneShot, steady_timer
from ros_ik_pkg.ros.servo.stream import Stream

# s from a solution to the reports about it, so that its receiver gets the processor first
REPORT_DELAY = 0.0005
LOG_PERIOD = 1.0  # s between log lines of one kind, however fast targets come
SERVO_PERIOD = 0.05  # s between two messages on ~/servo_status


class IkNode(Node):
    """Solves each target pose with the present settings and joint states.

    Raises OptionError or ModelError if the parameters at the start are wrong.
    """

    def __init__(self) -> None:
        # Undeclared ones are refused by Parameters, by name; rclpy's own refusal does not say which.
        super().__init__(topics.NODE_NAME, allow_undeclared_parameters=True)
        let_owner_destroy(self)
        self._frames = TfFrames(self)
        self._robot_source = RobotSource(self.resolve_topic_name(topics.ROBOT_DESCRIPTION.name))
        joint_states = JointStates(self.resolve_topic_name(topics.JOINT_STATES.name))
        self._handler = TargetHandler(self.get_clock(), self._frames, joint_states, self._robot_source.awaited)
        self._stream: Stream | None = None
        self._tips = TipTargets(self, self._handler, self._robot_source, self._answer)
        self._said = ''  # the last about a robot that is missing or ignored
        self._tools = Tools(self, lambda: self._handler.arm)
        if CACHE_FOLDER is None:
            self.get_logger().warning('compiled code stays in memory, every start compiles: nothing can be written to '
                                      'NUMBA_CACHE_DIR, XDG_CACHE_HOME or ~/.cache')  # fmt: skip
        # Before the arm is loaded, which needs compiled code that a helper compiles meanwhile
        self._compilation = Compilation(report=self.get_logger().info)
        with contextlib.ExitStack() as if_wrong:
            if_wrong.callback(self._compilation.close)
            parameters = Parameters(self, self._arm_for, self._take_over)
            if_wrong.pop_all()
        self._outputs = Publishers(self)
        self._comparison = Comparison(self, self._outputs.trace)
        self._paths = Paths(self, self._handler)
        self._reach = Reach(self, self._handler)
        self._diagnostics = Diagnostics(
            self, self._handler, self._what_is_missing, self._outputs.reports.take_dropped
        )  # fmt: skip
        self._servo_status = Publisher(self, topics.SERVO_STATUS)
        self._results: list[tuple[Result, Settings, float]] = []  # and its latency [s]; not reported yet
        self._report_timer, self._report_due = OneShot(self, REPORT_DELAY, self._report_results), 0.0
        self._stream = Stream(
            self, self._handler, self._outputs.publish_motion, lambda: self._compilation.stream_ready
        )  # fmt: skip
        self._handler.streamed = lambda: self._stream.position
        self._stream.take_over(self._handler.settings, self._handler.arm)
        self._targets = TargetQueue(self, self._handle, self._answer, self._give_up)
        self._subscribe(topics.ROBOT_DESCRIPTION, self._on_robot_description)
        self._subscribe(topics.ROBOT_DESCRIPTION_SEMANTIC, self._on_semantic)
        self._subscribe(topics.OBSTACLES, self._on_obstacles)
        self._subscribe(topics.TOOL, self._tools.take)
        self._subscribe(topics.TOOL_POSE, self._tools.take)
        for topic in topics.PLANNING_SCENE_TOPICS:
            try:
                self._subscribe(topic, self._on_obstacles)
            except RuntimeError as error:  # of rcl: types that the middleware cannot take end no node
                self.get_logger().warning(f'not listening on {topic.name}: {error}')
        self._subscribe(topics.JOINT_STATES, self._on_joint_state)
        self._subscribe(topics.TARGET_TWIST, self._stream.on_twist)
        self.create_service(SetBool, topics.PAUSE, self._on_pause)
        MoveItServices(self, self._handler, self._report_service)
        steady_timer(self, SERVO_PERIOD, self._report_servo)
        self._subscribe(topics.TARGET_POSE, self._targets.put, raw=True)
        self._subscribe(topics.TARGET_PATH, self._paths.take)
        self._subscribe(topics.FIRST_TARGET_POSE, partial(self._tips.put, 0), raw=True)
        self._subscribe(topics.SECOND_TARGET_POSE, partial(self._tips.put, 1), raw=True)
        for text in parameters.refuse_unknown():
            self.get_logger().warning(text)
        self._say_what_runs()

    def _subscribe(self, topic: topics.Topic, callback, raw: bool = False) -> None:
        def on_incompatible_qos(event: Any) -> None:
            policy = qos_policy_name_from_kind(event.last_policy_kind)
            self.get_logger().warning(topics.advice_on_qos(self.resolve_topic_name(topic.name), policy))

        self.create_subscription(
            topic.type,
            topic.name,
            callback,
            topic.qos,
            event_callbacks=SubscriptionEventCallbacks(incompatible_qos=on_incompatible_qos),
            qos_overriding_options=QoSOverridingOptions(topics.OVERRIDABLE),
            raw=raw,
        )

    def _on_joint_state(self, message: JointState) -> None:
        self._handler.joint_states.keep(message)
        self._stream.on_joint_state(message)

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success, response.message = True, self._stream.pause(request.data)
        return response

    def _handle(self, data: bytes, waited: float) -> Result | None:
        """Return the result of a target, the bytes of a PoseStamped; an unforeseen error must not end the node."""
        if self._results and self._report_timer.overdue():  # while targets queue up, the timer is not called
            self._report_timer.cancel()
            self._report_results()
        target = UNREAD
        try:
            target = read_target(data)
            self._tools.take_waiting()
            trace = self._outputs.want_trace()
            result = self._handler.handle(target, trace and self._compilation.complete, waited)
            if trace and result is not None and not self._compilation.complete:
                result.notes += (NOT_TRACED,)
            return result
        except Exception as error:
            return self._internal_error(target, error)

    def _give_up(self, data: bytes, status: str, why: str) -> Result:
        return self._handler.given_up(read_target(data), status, why)

    def _answer(self, result: Result, arrived: float) -> bool:
        """Publish the command now, and the reports soon after; return whether there is a command."""
        settings = self._handler.settings
        try:
            if not self._stream.on:
                self._outputs.publish_command(result, settings.trajectory_time)
            elif result.command is not None:
                self._follow(result)
            else:
                self._stream.on_no_goal(result.reason)
        except Exception as error:  # the target still gets its result
            result = self._internal_error(result.target, error)
        self._say_later(result, time.perf_counter() - arrived)
        return result.command is not None

    def _say_later(self, result: Result, latency: float) -> None:
        """Report a result soon, with its latency [s]."""
        self._results.append((result, self._handler.settings, latency))
        if len(self._results) == 1:
            self._report_due = time.perf_counter() + REPORT_DELAY
            self._report_timer.start()

    def _follow(self, result: Result) -> None:
        """Make the command of a result the goal of the stream, if the stream accepts it."""
        why_not = self._stream.on_pose(result.arm, result.command.q)
        if why_not:
            result.notes += (f'not followed: {why_not}',)
            result.command = None
        else:
            result.command.published = STREAM

    def _internal_error(self, target: Target, error: Exception) -> Result:
        self.get_logger().error(traceback.format_exc(), throttle_duration_sec=LOG_PERIOD)
        return self._handler.internal_error(target, error)

    def _report_service(self, result: Result, latency: float) -> None:
        """Report the result of a request if somebody listens; the timer alone costs a third of a call."""
        if result.outcome != SOLVED or self._outputs.results_heard:
            self._say_later(result, latency)

    def _report_results(self) -> None:
        """Report the results since the last call."""
        self._targets.all_had_their_turn(self._report_due)
        answered, self._results = self._results, []
        for result, settings, latency in answered:
            try:
                self._report(result, settings, latency)
            except Exception:
                self.get_logger().error(traceback.format_exc(), throttle_duration_sec=LOG_PERIOD)

    def _report(self, result: Result, settings: Settings, latency: float) -> None:
        self._outputs.publish_result(result)
        if not result.service:
            self._diagnostics.health.count(result, latency)
            if self._compilation.complete:
                self._comparison.submit(result, settings.compare, settings.options)
        what = result.service or 'target'
        if result.outcome == REFUSED:
            self.get_logger().warning(f'{what} refused: {result.reason}', throttle_duration_sec=LOG_PERIOD)
        elif result.outcome != SOLVED:
            self.get_logger().warning(f'{what} not solved: {result.reason}', throttle_duration_sec=LOG_PERIOD)

    def _arm_for(self, settings: Settings, arm_changes: bool) -> Arm | None:
        """Return the arm of the settings, reloaded if they change it; raise IkError."""
        arm = self._robot_source.load(settings) if arm_changes else self._handler.arm
        if self._tips.prepare(settings, arm_changes) is None and arm is not None:
            check_options(settings, arm, arm_changes)
            arm = self._tools.mounted(arm, settings)
        self._handler.surroundings.read(settings)
        return arm

    def _take_over(self, settings: Settings, arm: Arm | None) -> None:
        """Use checked settings and the arm for them."""
        previous = self._handler.arm
        _complete(arm)
        new = arm is not None and not arm.same_robot(previous)
        arm_changed = self._handler.settings is not None and (new or (arm is None) != (previous is None))
        self._leave_aside(self._handler.take_over(settings, arm))
        self._tips.take_over()
        if self._stream is not None:
            self._stream.take_over(settings, arm)
        if arm is not None and new:
            contacts = arm.contacts if settings.options.avoid_collisions else None  # read before a target needs them
            for text in (*arm.warnings, *(contacts.warnings if contacts else ())):
                self.get_logger().warning(f'robot {arm.name}: {text}')
            if self._robot_source.semantic_fault:
                self.get_logger().warning(self._robot_source.semantic_fault)
            if contacts and contacts.left_out:
                self.get_logger().info(f'links that may touch: {contacts.described()}')
        if arm_changed:
            self._say_what_runs()

    def _on_robot_description(self, message: String) -> None:
        """Load the arm of the topic if the parameters name none; after a malformed text the old arm is kept."""
        if message.data and message.data == self._robot_source.topic_text:
            return
        settings = self._handler.parameters
        try:
            name = self._robot_source.take(message.data)
            if follows_topic(settings):
                self._take_over(settings, self._load_from_topic(settings))
            elif self._handler.arm is None or name != self._handler.arm.name:
                self._say_once(self._robot_source.ignored(name, settings))
        except IkError as error:
            kept = f'keeping {self._handler.arm.name}' if self._handler.arm else 'still without a robot'
            self.get_logger().error(f'{shorten(str(error), 1000)}; {kept}', throttle_duration_sec=LOG_PERIOD)

    def _on_semantic(self, message: String) -> None:
        """Use the SRDF of the topic if the parameters name none; one for another robot is ignored."""
        if message.data == self._robot_source.semantic:
            return
        self._robot_source.semantic = message.data
        settings = self._handler.parameters
        if self._handler.arm is not None and not settings.srdf:
            self._take_over(settings, self._arm_for(settings, arm_changes=True))

    def _on_obstacles(self, message: Any) -> None:
        self._leave_aside(self._handler.take_obstacles(message))

    def _leave_aside(self, reasons: list[str]) -> None:
        for reason in reasons:
            self.get_logger().warning(f'obstacle left aside: {reason}', throttle_duration_sec=LOG_PERIOD)

    def _load_from_topic(self, settings: Settings) -> Arm | None:
        try:
            return self._arm_for(settings, arm_changes=True)
        except IkError as error:
            raise self._robot_source.reject(error) from error

    def get_parameter_type(self, name: str) -> int:
        """Return the type of a parameter as messages have it; rclpy's own fails for unknown names."""
        return self.get_parameter(name).type_.value

    def destroy_node(self) -> None:
        """Publish the last reports, end the threads, then destroy the node."""
        self._stream.close()
        self._targets.close()
        self._report_results()
        self._paths.close()
        self._reach.close()
        self._compilation.close()
        self._outputs.reports.close()
        self._comparison.worker.close()
        self._frames.close()
        super().destroy_node()

    def _what_is_missing(self) -> str:
        """Return what the node waits for, and log it; empty if it can solve targets."""
        if self._handler.arm is not None:
            return self._robot_source.rejected if follows_topic(self._handler.parameters) else ''
        waiting = self._robot_source.awaited()
        self._say_once(waiting)
        return waiting

    def _report_servo(self) -> None:
        """Pass the present room to the stream of commands, and publish its state if somebody listens."""
        self._stream.look_around()
        if self._stream.on and self._servo_status.heard:
            message = servo_message(self._stream.look(), self._handler.arm, name_in_statuses(self))
            message.header.stamp = self.get_clock().now().to_msg()
            self._servo_status.publish(message)

    def _say_what_runs(self) -> None:
        """Log that the node is ready and with which arm, or why it is not."""
        arm, method = self._handler.arm, self._handler.settings.options.method
        if arm is None:
            self._say_once(self._robot_source.awaited())
            return
        self._said = ''
        target = ' and '.join(map(self.resolve_topic_name, self._tips.topics))
        self.get_logger().info(
            f'ready: arm {arm.name}, {arm.n} joints from {arm.base_frame} to {arm.moving_frame}, method {method}, '
            f'targets on {target}'
        )

    def _say_once(self, text: str) -> None:
        """Log a warning, unless it is the same as the last one."""
        if text != self._said:
            self._said = text
            self.get_logger().warning(text)


def _complete(arm: Arm | None) -> None:
    """Compute what an arm computes once, so that no target's deadline has to cover it."""
    if arm is not None:
        _ = arm.packed
