"""Publishes answers: the command first, the result next, and in the gaps between targets what people look at."""

from __future__ import annotations

from rclpy.node import Node

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ros import interface
from ros_ik_pkg.ros.answer import Answer
from ros_ik_pkg.ros.cdr import SolutionWriter
from ros_ik_pkg.ros.interface import Output
from ros_ik_pkg.ros.messages import (
    commands_message,
    path_message,
    solution_message,
    trace_message,
    trajectory_message,
)
from ros_ik_pkg.ros.names import name_in_statuses
from ros_ik_pkg.ros.statuses import iterations_message, result_message
from ros_ik_pkg.ros.worker import Worker

REPORTS = 10  # that may wait


class Outputs:
    """The publishers of the node's own topics."""

    def __init__(self, node: Node) -> None:
        self._name = name_in_statuses(node)
        self._solution = Output(node, interface.SOLUTION)
        self._trajectory = Output(node, interface.JOINT_TRAJECTORY)
        self._commands = Output(node, interface.POSITION_COMMANDS)
        self._result = Output(node, interface.RESULT)
        self._iterations = Output(node, interface.ITERATIONS)
        self.trace = Output(node, interface.TRACE)
        self._tcp_path = Output(node, interface.TCP_PATH)
        self._writer: SolutionWriter | None = None
        self._arm: Arm | None = None  # of the writer
        self.reports: Worker[Answer] = Worker(node, 'reports', self._report, REPORTS)

    def want_trace(self) -> bool:
        """Whether anybody listens to what a trace is needed for."""
        return self._iterations.heard or self.trace.heard or self._tcp_path.heard

    def publish_command(self, answer: Answer, trajectory_time: float) -> None:
        """Publish the command of an answer, if it has one, in every form that somebody listens to."""
        if answer.command is None:
            return
        self._solution.publish(self._solution_of(answer))
        if self._trajectory.heard:
            self._trajectory.publish(trajectory_message(answer, trajectory_time))
        if self._commands.heard:
            self._commands.publish(commands_message(answer))

    def _solution_of(self, answer: Answer) -> bytes:
        """Return the message of a solution as bytes, of which those of the names are the same for all of an arm."""
        if answer.arm is not self._arm:
            self._writer, self._arm = SolutionWriter(solution_message(answer)), answer.arm
        return self._writer.write(answer.target.sec, answer.target.nanosec, answer.command.q)

    def publish_result(self, answer: Answer) -> None:
        """Publish the result now, and the iterations, in every form that somebody listens to, when there is time."""
        if self._result.heard:
            self._result.publish(result_message(answer, self._name))
        if answer.solution is not None and answer.solution.trace is not None:
            self.reports.submit(answer)

    def _report(self, answer: Answer) -> None:
        """Publish the iterations of an answer."""
        if self.trace.heard:
            self.trace.publish(trace_message(answer, answer.solution.trace, answer.method, 'solve'))
        if self._tcp_path.heard:
            self._tcp_path.publish(path_message(answer))
        if self._iterations.heard:
            self._iterations.publish(iterations_message(answer, self._name))
