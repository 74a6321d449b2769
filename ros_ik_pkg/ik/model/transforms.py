"""Homogeneous transforms for the model files; used while a robot is loaded, not while it is solved."""

from __future__ import annotations

import numpy as np


def transform(rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    """Put a rotation (3, 3) and a translation (3,) [m] into a (4, 4) matrix."""
    result = np.eye(4)
    result[:3, :3] = rotation
    result[:3, 3] = translation
    return result


def rotation_about(axis: str, angle: float) -> np.ndarray:
    """Rotation (3, 3) about 'x', 'y' or 'z' by an angle [rad]."""
    first, second = {'x': (1, 2), 'y': (2, 0), 'z': (0, 1)}[axis]
    cosine, sine = np.cos(angle), np.sin(angle)
    result = np.eye(3)
    result[first, first] = result[second, second] = cosine
    result[second, first], result[first, second] = sine, -sine
    return result


def rotation_from_rpy(rpy: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) Rz(yaw) Ry(pitch) Rx(roll) from fixed-axis roll, pitch, yaw [rad] (REP 103)."""
    roll, pitch, yaw = rpy
    return rotation_about('z', yaw) @ rotation_about('y', pitch) @ rotation_about('x', roll)


def rotation_from_quaternion(quaternion: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) of a quaternion (x, y, z, w) of any length but zero."""
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def rotation_from_z(axis: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) whose z axis is the unit vector `axis`; the identity for z itself."""
    helper = np.array([0.0, 1.0, 0.0]) if abs(axis[1]) < 0.9 else np.array([1.0, 0.0, 0.0])
    x = np.cross(helper, axis)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])
