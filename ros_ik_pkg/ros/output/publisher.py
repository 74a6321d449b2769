"""A publisher that knows whether it has subscribers."""

from __future__ import annotations

from typing import Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions

from ros_ik_pkg.ros.interface.topics import OVERRIDABLE, Topic


class Publisher:
    """A publisher of a topic that knows whether it has subscribers.

    The middleware reports when subscribers come and go; asking it for every target would take as long as a solve.
    """

    def __init__(self, node: Node, topic: Topic) -> None:
        events = PublisherEventCallbacks(matched=self._matched)
        publisher = node.create_publisher(
            topic.type,
            topic.name,
            topic.qos,
            event_callbacks=events,
            qos_overriding_options=QoSOverridingOptions(OVERRIDABLE),
        )
        self.heard = publisher.get_subscription_count() > 0
        self.publish = publisher.publish

    def _matched(self, listeners: Any) -> None:
        self.heard = listeners.current_count > 0
