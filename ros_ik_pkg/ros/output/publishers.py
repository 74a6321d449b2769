"""Publishes results: the command first, the result next, and between targets what people look at."""

from __future__ import annotations

from array import array

import numpy as np
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ros.handling.result import Result
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.output.contact_markers import contact_markers
from ros_ik_pkg.ros.output.messages import (
    commands_message,
    motion_trajectory_message,
    path_message,
    positions_message,
    trace_message,
    trajectory_message,
)
from ros_ik_pkg.ros.output.publisher import Publisher
from ros_ik_pkg.ros.output.solution_writer import SolutionWriter
from ros_ik_pkg.ros.output.statuses import iterations_message, result_message
from ros_ik_pkg.ros.runtime.background_worker import BackgroundWorker
from ros_ik_pkg.ros.runtime.node_names import name_in_statuses
from ros_ik_pkg.ros.servo.limiter import Motion

REPORTS = 10  # that may wait


class Publishers:
    """The publishers of the node's own topics."""

    def __init__(self, node: Node) -> None:
        self._name, self._clock = name_in_statuses(node), node.get_clock()
        self._solution = Publisher(node, topics.SOLUTION)
        self._trajectory = Publisher(node, topics.JOINT_TRAJECTORY)
        self._commands = Publisher(node, topics.POSITION_COMMANDS)
        self._result = Publisher(node, topics.RESULT)
        self._iterations = Publisher(node, topics.ITERATIONS)
        self.trace = Publisher(node, topics.TRACE)
        self._tcp_path = Publisher(node, topics.TCP_PATH)
        self._contacts = Publisher(node, topics.CONTACTS)
        self._writer: SolutionWriter | None = None
        self._arm: Arm | None = None  # of the writer
        self.reports: BackgroundWorker[Result] = BackgroundWorker(node, 'reports', self._report, REPORTS)

    @property
    def results_heard(self) -> bool:
        """Whether a topic that is published for every result has subscribers."""
        return self._result.heard or self._contacts.heard

    def want_trace(self) -> bool:
        """Return whether a topic that needs a trace has subscribers."""
        return self._iterations.heard or self.trace.heard or self._tcp_path.heard

    def publish_command(self, result: Result, trajectory_time: float) -> None:
        """Publish the command of a result, if it has one, on every topic that has subscribers."""
        if result.command is None:
            return
        target = result.target
        self._solution.publish(self._solution_of(result.arm, result.command.q, target.sec, target.nanosec))
        if self._trajectory.heard:
            self._trajectory.publish(trajectory_message(result, trajectory_time))
        if self._commands.heard:
            self._commands.publish(commands_message(result))

    def publish_motion(self, arm: Arm, motion: Motion, period: float) -> None:
        """Publish a command of the stream, to be reached in a period [s], on every topic that has subscribers."""
        self._solution.publish(self._solution_of(arm, motion.position))
        if self._trajectory.heard:
            self._trajectory.publish(motion_trajectory_message(arm, motion, period))
        if self._commands.heard:
            self._commands.publish(Float64MultiArray(data=array('d', motion.position.tobytes())))

    def _solution_of(self, arm: Arm, q: np.ndarray, sec: int = 0, nanosec: int = 0) -> bytes:
        """Return the message of a solution as bytes; one writer serves all solutions of an arm.

        Its stamp is that of the target, or now for a target with stamp 0.
        """
        if not arm.same_robot(self._arm):
            self._writer, self._arm = SolutionWriter(positions_message(arm, q)), arm
        if sec == nanosec == 0:  # robot_state_publisher and RViz ignore what is not newer than the last
            sec, nanosec = self._clock.now().seconds_nanoseconds()
        return self._writer.write(sec, nanosec, q)

    def publish_result(self, result: Result) -> None:
        """Publish the result now, and what people look at later, on every topic that has subscribers."""
        if self._result.heard:
            self._result.publish(result_message(result, self._name))
        if result.solution is not None and (result.solution.trace is not None or self._wants_contact(result)):
            self.reports.submit(result)

    def _wants_contact(self, result: Result) -> bool:
        return self._contacts.heard and result.room is not None

    def _report(self, result: Result) -> None:
        """Publish contact and iterations of a result."""
        if self._wants_contact(result):
            self._contacts.publish(contact_markers(result))
        if result.solution.trace is None:
            return
        if self.trace.heard:
            self.trace.publish(trace_message(result, result.solution.trace, result.method, 'solve'))
        if self._tcp_path.heard:
            self._tcp_path.publish(path_message(result))
        if self._iterations.heard:
            self._iterations.publish(iterations_message(result, self._name))
