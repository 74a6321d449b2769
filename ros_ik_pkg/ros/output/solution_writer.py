"""Writes solutions as bytes, without creating Python objects."""

from __future__ import annotations

import numpy as np
from builtin_interfaces.msg import Time
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from ros_ik_pkg.ros.interface.wire_format import HEAD, LITTLE_ENDIAN, STAMP


class SolutionWriter:
    """Serialises one JointState repeatedly, changing only stamp and positions (at least one joint)."""

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
    """Return whether rclpy reads the message from these bytes."""
    try:
        return deserialize_message(data, JointState) == message
    except RuntimeError:
        return False
