"""The two messages of every target as bytes: PoseStamped is read, JointState written, without their Python objects.

To make a PoseStamped and to take a JointState apart takes rclpy several times as long as the solve between them (see
docs/performance.md). So the node asks for the bytes that came, and publishes bytes. Both are in the Common Data
Representation (OMG CDR, version 1), which all middlewares of ROS 2 send: a head of four bytes, then the fields in
their order, each aligned to its size, counted from behind the head; a text or a list is its length and its elements.
What is encoded in another way, by a big-endian machine or a later version, rclpy reads and writes.
"""

from __future__ import annotations

from struct import Struct

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from ros_ik_pkg.ros.target import Target

HEAD = 4  # bytes
LITTLE_ENDIAN = b'\x00\x01'  # how the head begins; its other half are options, of no account here
STAMP = Struct('<iI')
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


class SolutionWriter:
    """Writes one message again and again, with other stamps and positions, of which it must have some."""

    def __init__(self, message: JointState) -> None:
        self._message = message
        positions = np.arange(1.0, 1.0 + len(message.position))
        data = self._by_rclpy(1, 2, positions)
        begin = data.find(positions.tobytes())
        self._head, self._before = data[:HEAD], data[HEAD + STAMP.size : begin]
        self._after = data[begin + positions.nbytes :]
        joined = self._joined(1, 2, positions)
        self._plain = data.startswith(LITTLE_ENDIAN) and begin > 0 and _same(joined, message)

    def write(self, sec: int, nanosec: int, positions: np.ndarray) -> bytes:
        """Return the message with this stamp and these positions (n,) float64 [rad, m]."""
        return (self._joined if self._plain else self._by_rclpy)(sec, nanosec, positions)

    def _joined(self, sec: int, nanosec: int, positions: np.ndarray) -> bytes:
        return b''.join((self._head, STAMP.pack(sec, nanosec), self._before, positions.tobytes(), self._after))

    def _by_rclpy(self, sec: int, nanosec: int, positions: np.ndarray) -> bytes:
        self._message.header.stamp = Time(sec=sec, nanosec=nanosec)
        self._message.position = positions.tolist()
        return serialize_message(self._message)


def _same(data: bytes, message: JointState) -> bool:
    """Whether rclpy reads the message in these bytes."""
    try:
        return deserialize_message(data, JointState) == message
    except RuntimeError:
        return False
