"""Listens to all that a node publishes, so that it has to make all of it."""

from __future__ import annotations

from collections import Counter

from ros_ik_pkg.ros.interface import topics
from torture.peer import Peer

NOT_BY_TARGETS = (
    topics.CONTACTS, topics.PATH_SOLUTION, topics.PATH_RESULT, topics.PATH_MARKERS, topics.SERVO_STATUS,
    topics.REACH, topics.REACH_POSES,
)  # fmt: skip


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
        """Return the topics without messages, except those that targets for a robot without shapes do not bring."""
        return [topic.name for topic in self._topics if topic not in NOT_BY_TARGETS and not self.counts[topic.name]]
