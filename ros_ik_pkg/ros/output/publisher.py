"""A publisher that knows whether anybody listens."""

from __future__ import annotations

from typing import Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node

from ros_ik_pkg.ros.interface.topics import Topic


class Publisher:
    """A publisher of a topic that knows whether anybody listens.

    The middleware tells as listeners come and go; to ask it for every target takes as long as a solve.
    """

    def __init__(self, node: Node, topic: Topic) -> None:
        events = PublisherEventCallbacks(matched=self._matched)
        publisher = node.create_publisher(topic.type, topic.name, topic.qos, event_callbacks=events)
        self.heard = publisher.get_subscription_count() > 0
        self.publish = publisher.publish

    def _matched(self, listeners: Any) -> None:
        self.heard = listeners.current_count > 0
