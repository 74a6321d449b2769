"""Publishes answers: the solution first, the result next, the rest only where somebody listens."""

from __future__ import annotations

from typing import Any

from rclpy.node import Node

from ros_ik_pkg.ros import interface
from ros_ik_pkg.ros.answer import SOLVED, Answer
from ros_ik_pkg.ros.messages import path_message, solution_message, trace_message
from ros_ik_pkg.ros.statuses import iterations_message, result_message


class Outputs:
    """The publishers of the node's own topics."""

    def __init__(self, node: Node) -> None:
        self._name = node.get_name()
        self._solution = _publisher(node, interface.SOLUTION)
        self._result = _publisher(node, interface.RESULT)
        self._iterations = _publisher(node, interface.ITERATIONS)
        self._trace = _publisher(node, interface.TRACE)
        self._tcp_path = _publisher(node, interface.TCP_PATH)

    def want_trace(self) -> bool:
        """Whether anybody listens to what a trace is needed for."""
        return any(_heard(publisher) for publisher in (self._iterations, self._trace, self._tcp_path))

    def publish_solution(self, answer: Answer) -> None:
        """Publish the joints of a solved target, and nothing of another."""
        if answer.outcome == SOLVED:
            self._solution.publish(solution_message(answer))

    def publish_report(self, answer: Answer) -> None:
        """Publish the result, then the iterations in every form that somebody listens to."""
        if _heard(self._result):
            self._result.publish(result_message(answer, self._name))
        if answer.solution is None or answer.solution.trace is None:
            return
        if _heard(self._trace):
            self._trace.publish(trace_message(answer))
        if _heard(self._tcp_path):
            self._tcp_path.publish(path_message(answer))
        if _heard(self._iterations):
            self._iterations.publish(iterations_message(answer, self._name))


def _publisher(node: Node, topic: interface.Topic) -> Any:
    return node.create_publisher(topic.type, topic.name, topic.qos)


def _heard(publisher: Any) -> bool:
    return publisher.get_subscription_count() > 0
