"""A target as it was received."""

from __future__ import annotations

from typing import NamedTuple

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped


class Target(NamedTuple):
    """The content of a PoseStamped without its eight Python objects, whose creation takes longer than a solve.

    Its numbers are neither checked nor corrected.
    """

    sec: int
    nanosec: int
    frame_id: str
    position: tuple[float, ...]  # x y z [m]
    orientation: tuple[float, ...]  # quaternion x y z w

    @classmethod
    def of(cls, message: PoseStamped) -> Target:
        """Return the target in a message."""
        header, p, q = message.header, message.pose.position, message.pose.orientation
        return cls(header.stamp.sec, header.stamp.nanosec, header.frame_id, (p.x, p.y, p.z), (q.x, q.y, q.z, q.w))

    @property
    def stamp(self) -> Time:
        """The stamp as messages hold it."""
        return Time(sec=self.sec, nanosec=self.nanosec)


UNREAD = Target(0, 0, '', (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))  # stands for a target that could not be read
