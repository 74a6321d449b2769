"""The IK node: targets in, solutions and results out."""

from __future__ import annotations

import time
import traceback

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from std_msgs.msg import String

from ros_ik_pkg.ik import Arm, IkError, OptionError, warm_up
from ros_ik_pkg.ik.kernel.compiled import CACHE_FOLDER
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.handling.result import REFUSED, SOLVED, Result
from ros_ik_pkg.ros.handling.target_handler import AWAITING_ROBOT, TargetHandler
from ros_ik_pkg.ros.input.robot_source import RobotSource, follows_topic
from ros_ik_pkg.ros.input.target import UNREAD, Target
from ros_ik_pkg.ros.input.target_reader import read_target
from ros_ik_pkg.ros.input.tf_frames import TfFrames
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.interface.parameters import Parameters, Settings, warnings_about_unknown
from ros_ik_pkg.ros.output.comparison import Comparison
from ros_ik_pkg.ros.output.health import Health
from ros_ik_pkg.ros.output.publishers import Publishers
from ros_ik_pkg.ros.output.statuses import key_values

# s from a solution to all that is said about it: whoever waits for the solution, often with one core left, has it first
REPORT_DELAY = 0.0005
LOG_PERIOD = 1.0  # s between log lines of one kind, however fast targets come
HEALTH_PERIOD = 1.0  # s, REP 107
WAITING_LOG_PERIOD = 5.0  # s


class IkNode(Node):
    """Solves each target pose that comes in, with the settings and the joint state of that moment.

    Raises OptionError or ModelError where the parameters at the start are wrong.
    """

    def __init__(self) -> None:
        # Undeclared ones are refused by Parameters, by name; rclpy's own refusal does not say which.
        super().__init__(topics.NODE_NAME, allow_undeclared_parameters=True)
        self._frames = TfFrames(self)
        self._handler = TargetHandler(self.get_clock(), self._frames)
        self._robot_source = RobotSource()
        self._health = Health()
        Parameters(self, self._arm_for, self._take_over)
        for text in warnings_about_unknown(self):
            self.get_logger().warning(text)
        if CACHE_FOLDER is None:
            self.get_logger().warning('compiled code stays in memory, every start compiles: nothing can be written to '
                                      'NUMBA_CACHE_DIR, XDG_CACHE_HOME or ~/.cache')  # fmt: skip
        warm_up(report=self.get_logger().info)
        _complete(self._handler.arm)
        self._outputs = Publishers(self)
        self._comparison = Comparison(self, self._outputs.trace)
        self._diagnostics = self.create_publisher(
            DiagnosticArray, topics.DIAGNOSTICS.name, topics.DIAGNOSTICS.qos
        )
        self._results: list[tuple[Result, Settings, float]] = []  # and its latency [s]; not reported yet
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._report_timer = self.create_timer(REPORT_DELAY, self._report_results, clock=steady, autostart=False)
        self.create_timer(HEALTH_PERIOD, self._report_health, clock=steady)
        self._subscribe(topics.ROBOT_DESCRIPTION, self._on_robot_description)
        self._subscribe(topics.JOINT_STATES, self._handler.joint_states.keep)
        self._subscribe(topics.TARGET_POSE, self._on_target, raw=True)
        self.get_logger().info(f'ready: {self._described()}')

    def _subscribe(self, topic: topics.Topic, callback, raw: bool = False) -> None:
        self.create_subscription(topic.type, topic.name, callback, topic.qos, raw=raw)

    def _on_target(self, data: bytes) -> None:
        """Answer one target, the bytes of a PoseStamped: the solution leaves now, everything about it soon after."""
        started = time.perf_counter()
        if self._results and self._report_timer.is_ready():  # where targets queue up, it does not get its turn
            self._report_results()
        result = self._handle(data)
        settings = self._handler.settings
        try:
            self._outputs.publish_command(result, settings.trajectory_time)
        except Exception as error:  # the target gets its result all the same
            result = self._internal_error(result.target, error)
        self._results.append((result, settings, time.perf_counter() - started))
        if len(self._results) == 1:
            self._report_timer.reset()

    def _handle(self, data: bytes) -> Result:
        """Answer a target whatever happens: an error that nobody foresaw must not end the node."""
        target = UNREAD
        try:
            target = read_target(data)
            return self._handler.handle(target, self._outputs.want_trace())
        except Exception as error:
            return self._internal_error(target, error)

    def _internal_error(self, target: Target, error: Exception) -> Result:
        self.get_logger().error(traceback.format_exc(), throttle_duration_sec=LOG_PERIOD)
        return self._handler.internal_error(target, error)

    def _report_results(self) -> None:
        """Say what there is to say about the answers since the last time."""
        self._report_timer.cancel()
        answered, self._results = self._results, []
        for result, settings, latency in answered:
            try:
                self._report(result, settings, latency)
            except Exception:
                self.get_logger().error(traceback.format_exc(), throttle_duration_sec=LOG_PERIOD)

    def _report(self, result: Result, settings: Settings, latency: float) -> None:
        self._health.count(result, latency)
        self._outputs.publish_result(result)
        self._comparison.submit(result, settings.compare, settings.options)
        if result.outcome == REFUSED:
            self.get_logger().warning(f'target refused: {result.reason}', throttle_duration_sec=LOG_PERIOD)
        elif result.outcome != SOLVED:
            self.get_logger().warning(f'target not solved: {result.reason}', throttle_duration_sec=LOG_PERIOD)

    def _arm_for(self, settings: Settings, arm_changes: bool) -> Arm | None:
        """Return the arm that the settings mean, loaded anew where they change it; raise IkError."""
        arm = self._robot_source.load(settings) if arm_changes else self._handler.arm
        if arm is not None:
            _check_lengths(settings, arm, arm_changes)
        return arm

    def _take_over(self, settings: Settings, arm: Arm | None) -> None:
        """Use settings and arm that were found good."""
        previous = self._handler.arm
        arm_changed = self._handler.settings is not None and arm is not previous
        self._handler.take_over(settings, arm)
        if arm is not None and arm is not previous:
            for text in arm.warnings:
                self.get_logger().warning(f'robot {arm.name}: {text}')
        if arm_changed:
            _complete(arm)
            self.get_logger().info(self._described(), throttle_duration_sec=LOG_PERIOD)

    def _on_robot_description(self, message: String) -> None:
        """Load the arm of the topic where the parameters name none; a malformed one leaves the old arm."""
        if message.data and message.data == self._robot_source.topic_text:
            return
        settings = self._handler.parameters
        try:
            self._robot_source.take(message.data)
            if follows_topic(settings):
                self._take_over(settings, self._arm_for(settings, arm_changes=True))
        except IkError as error:
            kept = f'keeping {self._handler.arm.name}' if self._handler.arm else 'still without a robot'
            self.get_logger().error(f'{shorten(str(error), 1000)}; {kept}', throttle_duration_sec=LOG_PERIOD)

    def get_parameter_type(self, name: str) -> int:
        """Return a type as messages hold it; of a name that is not known, rclpy's own returns what no message takes."""
        return self.get_parameter(name).type_.value

    def destroy_node(self) -> None:
        """Say what is left to say, end the threads, then the node."""
        self._report_results()
        self._outputs.reports.close()
        self._comparison.worker.close()
        self._frames.close()
        super().destroy_node()

    def _report_health(self) -> None:
        """Publish /diagnostics once a second, and say what the node waits for."""
        arm = self._handler.arm
        waiting = '' if arm else AWAITING_ROBOT
        if waiting:
            self.get_logger().info(waiting, throttle_duration_sec=WAITING_LOG_PERIOD)
        status = self._health.report(
            self._handler.settings.health_limits, HEALTH_PERIOD, waiting, self._handler.joint_states_age()
        )
        status.name = f'{self.get_fully_qualified_name()}: health'
        status.hardware_id = arm.name if arm else ''
        status.values += key_values({'reports_dropped': self._outputs.reports.take_dropped()})
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def _described(self) -> str:
        """Describe the arm and what is done with it, in one line."""
        arm, method = self._handler.arm, self._handler.settings.options.method
        if arm is None:
            return AWAITING_ROBOT
        target = self.resolve_topic_name(topics.TARGET_POSE.name)
        return (
            f'arm {arm.name}, {arm.n} joints from {arm.base_frame} to {arm.tip_frame}, method {method}, '
            f'targets on {target}'
        )


def _check_lengths(settings: Settings, arm: Arm, arm_changes: bool) -> None:
    """Refuse lists that are not as long as the arm has joints; where it is the arm that changes, say the way out."""
    try:
        settings.options.check_lengths(arm.n)
    except OptionError as error:
        way_out = ': for another robot set posture and joint_weights to [] before or in the same call'
        raise OptionError(f'robot {arm.name!r}: {error}{way_out if arm_changes else ""}') from error


def _complete(arm: Arm | None) -> None:
    """Make what an arm makes once, in milliseconds that no target's deadline covers."""
    if arm is not None:
        _ = arm.packed
