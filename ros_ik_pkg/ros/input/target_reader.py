"""The two messages of every target as bytes: PoseStamped is read, JointState written, without their Python objects.

To make a PoseStamped and to take a JointState apart takes rclpy several times as long as the solve between them (see
docs/performance.md). So the node asks for the bytes that came, and publishes bytes. Both are in the Common Data
Representation (OMG CDR, version 1), which all middlewares of ROS 2 send: a head of four bytes, then the fields in
their order, each aligned to its size, counted from behind the head; a text or a list is its length and its elements.
What is encoded in another way, by a big-endian machine or a later version, rclpy reads and writes.
"""

from __future__ import annotations

from struct import Struct

from geometry_msgs.msg import PoseStamped
from rclpy.serialization import deserialize_message

from ros_ik_pkg.ros.input.target import Target
from ros_ik_pkg.ros.interface.wire_format import HEAD, LITTLE_ENDIAN

STAMP_AND_LENGTH = Struct('<iII')  # of the text frame_id, with the zero at its end
POSE = Struct('<7d')


def read_target(data: bytes) -> Target:
    """Return the target in the bytes of a PoseStamped.

    Raises struct.error or RuntimeError where they hold none, which no middleware delivers.
    """
    if not data.startswith(LITTLE_ENDIAN):
        return Target.of(deserialize_message(data, PoseStamped))
    sec, nanosec, length = STAMP_AND_LENGTH.unpack_from(data, HEAD)
    begin = HEAD + STAMP_AND_LENGTH.size
    text = data[begin : begin + max(length - 1, 0)].decode(errors='replace')
    aligned = (STAMP_AND_LENGTH.size + length + 7) // 8 * 8
    numbers = POSE.unpack_from(data, HEAD + aligned)
    return Target(sec, nanosec, text, numbers[:3], numbers[3:])
