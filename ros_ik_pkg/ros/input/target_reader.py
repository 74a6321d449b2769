"""The two messages of every target as bytes: PoseStamped is read, JointState written, without their Python objects.

For rclpy, creating the PoseStamped and serialising the JointState take several times as long as the solve between them
(see docs/performance.md). So the node receives and publishes bytes. Both are in the Common Data Representation
(OMG CDR, version 1), which all middlewares of ROS 2 send: a head of four bytes, then the fields in order, each aligned
to its size, counted from the end of the head; a text or a list is its length and its elements. Messages in another
encoding, from a big-endian machine or of a later version, are read and written by rclpy. So are all messages if the
bytes that rclpy writes are not as expected here.
"""

from __future__ import annotations

from functools import cache
from struct import Struct, error

from geometry_msgs.msg import PoseStamped
from rclpy.serialization import deserialize_message, serialize_message

from ros_ik_pkg.ros.input.target import Target
from ros_ik_pkg.ros.interface.wire_format import HEAD, LITTLE_ENDIAN

STAMP_AND_LENGTH = Struct('<iII')  # of the text frame_id, with the zero at its end
POSE = Struct('<7d')


def read_target(data: bytes) -> Target:
    """Return the target in the bytes of a PoseStamped.

    Raises struct.error or RuntimeError if they are no PoseStamped, which no middleware delivers.
    """
    if data.startswith(LITTLE_ENDIAN) and reads_what_rclpy_writes():
        return _read(data)
    return Target.of(deserialize_message(data, PoseStamped))


@cache
def reads_what_rclpy_writes() -> bool:
    """Return whether a message that rclpy serialises is read with the numbers and the text that it holds."""
    message = PoseStamped()
    message.header.stamp.sec, message.header.stamp.nanosec, message.header.frame_id = 1, 2, 'frame'
    p, q = message.pose.position, message.pose.orientation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = (float(k) for k in range(3, 10))
    try:
        return _read(serialize_message(message)) == Target.of(message)
    except error:
        return False


def _read(data: bytes) -> Target:
    """Return the target in the bytes of a little-endian PoseStamped."""
    sec, nanosec, length = STAMP_AND_LENGTH.unpack_from(data, HEAD)
    begin = HEAD + STAMP_AND_LENGTH.size
    text = data[begin : begin + max(length - 1, 0)].decode(errors='replace')
    aligned = (STAMP_AND_LENGTH.size + length + 7) // 8 * 8
    numbers = POSE.unpack_from(data, HEAD + aligned)
    return Target(sec, nanosec, text, numbers[:3], numbers[3:])
