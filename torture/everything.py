"""Listens to all that a node publishes, so that it has to make all of it."""

from __future__ import annotations

from collections import Counter

from ros_ik_pkg.ros.interface import topics
from torture.peer import Peer


class Everything:
    """Counts the messages of every topic that a node publishes, while the peer spins."""

    def __init__(self, peer: Peer) -> None:
        self.counts: Counter[str] = Counter()
        self._topics = [topic for topic in topics.TOPICS if topic.direction == 'out']
        for topic in self._topics:
            peer.node.create_subscription(topic.type, topic.of(peer.name), self._counter(topic.name), topic.qos)

    def _counter(self, name: str):
        def count(message: object) -> None:
            self.counts[name] += 1

        return count

    def missing(self) -> list[str]:
        """Return the topics without messages."""
        return [topic.name for topic in self._topics if not self.counts[topic.name]]
