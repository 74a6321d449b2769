"""Publishes /diagnostics once a second (REP 107): the health of the node, and what it waits for."""

from __future__ import annotations

import time
from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

from ros_ik_pkg.ik.text import list_names
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.output.health import Health
from ros_ik_pkg.ros.output.publisher import Publisher
from ros_ik_pkg.ros.output.statuses import key_values
from ros_ik_pkg.ros.runtime.node_names import name_in_statuses
from ros_ik_pkg.ros.runtime.timers import steady_timer

PERIOD = 1.0  # s


class Diagnostics:
    """Reports what `health` counts.

    waiting: returns what is missing, or ''. take_dropped: returns how many reports were dropped since the last call.
    """

    def __init__(
        self, node: Node, handler: TargetHandler, waiting: Callable[[], str], take_dropped: Callable[[], int]
    ) -> None:
        self.health = Health()
        self._node, self._handler, self._waiting, self._take_dropped = node, handler, waiting, take_dropped
        self._publisher = Publisher(node, topics.DIAGNOSTICS)
        self._period_began = time.monotonic()
        steady_timer(node, PERIOD, self._publish)

    def _publish(self) -> None:
        arm = self._handler.arm
        waiting = self._waiting()
        began, self._period_began = self._period_began, time.monotonic()
        status = self.health.report(
            self._handler.settings.health_limits,
            self._period_began - began,
            waiting,
            self._handler.joint_states_age(),
            self._doubts(),
        )
        status.name = f'{name_in_statuses(self._node)}: health'
        status.hardware_id = arm.name if arm else ''
        status.values += key_values({'reports_dropped': self._take_dropped()})
        message = DiagnosticArray(status=[status])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)

    def _doubts(self) -> tuple[int, str]:
        """Return for how many targets joint states were doubted, and why; log the reason."""
        count, reason = self._handler.joint_state_check.take_doubts()
        if not count:
            return 0, ''
        topic = self._node.resolve_topic_name(topics.JOINT_STATES.name)
        publishers = sorted({f'{info.node_namespace.rstrip("/")}/{info.node_name}'
                             for info in self._node.get_publishers_info_by_topic(topic)})  # fmt: skip
        text = (
            f'contradictory joint states on {topic}, published by {list_names(publishers)}: {reason}; '
            'steps continue from the last command'
        )
        self._node.get_logger().warning(text)
        return count, text
