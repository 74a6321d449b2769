"""Publishes answers: the command first, the result next, and in the gaps between targets what people look at."""

from __future__ import annotations

from rclpy.node import Node

from ros_ik_pkg.ros import interface
from ros_ik_pkg.ros.answer import Answer
from ros_ik_pkg.ros.interface import heard, publisher
from ros_ik_pkg.ros.messages import commands_message, path_message, solution_message, trace_message, trajectory_message
from ros_ik_pkg.ros.statuses import iterations_message, result_message
from ros_ik_pkg.ros.worker import Worker

REPORTS = 10  # that may wait


class Outputs:
    """The publishers of the node's own topics."""

    def __init__(self, node: Node) -> None:
        self._name = node.get_name()
        self._solution = publisher(node, interface.SOLUTION)
        self._trajectory = publisher(node, interface.JOINT_TRAJECTORY)
        self._commands = publisher(node, interface.POSITION_COMMANDS)
        self._result = publisher(node, interface.RESULT)
        self._iterations = publisher(node, interface.ITERATIONS)
        self.trace = publisher(node, interface.TRACE)
        self._tcp_path = publisher(node, interface.TCP_PATH)
        self.reports: Worker[Answer] = Worker(node, 'reports', self._report, REPORTS)

    def want_trace(self) -> bool:
        """Whether anybody listens to what a trace is needed for."""
        return any(map(heard, (self._iterations, self.trace, self._tcp_path)))

    def publish_command(self, answer: Answer, trajectory_time: float) -> None:
        """Publish the command of an answer, if it has one, in every form that somebody listens to."""
        if answer.command is None:
            return
        self._solution.publish(solution_message(answer))
        if heard(self._trajectory):
            self._trajectory.publish(trajectory_message(answer, trajectory_time))
        if heard(self._commands):
            self._commands.publish(commands_message(answer))

    def publish_result(self, answer: Answer) -> None:
        """Publish the result now, and the iterations, in every form that somebody listens to, when there is time."""
        if heard(self._result):
            self._result.publish(result_message(answer, self._name))
        if answer.solution is not None and answer.solution.trace is not None:
            self.reports.submit(answer)

    def _report(self, answer: Answer) -> None:
        """Publish the iterations of an answer."""
        if heard(self.trace):
            self.trace.publish(trace_message(answer, answer.solution.trace, answer.method, 'solve'))
        if heard(self._tcp_path):
            self._tcp_path.publish(path_message(answer))
        if heard(self._iterations):
            self._iterations.publish(iterations_message(answer, self._name))
