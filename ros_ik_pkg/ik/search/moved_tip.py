"""The reach and the starts of an arm whose tip is moved, for instance by a tool, without computing them again."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik.kernel.data_layout import Reach

POSE = 7  # the last rows of the starts: position, and quaternion w x y z


def moved_reach(reach: Reach, old_from_new: np.ndarray) -> Reach:
    """Return the bound for a tip at the pose old_from_new (4, 4) in the tip frame of `reach`.

    The points are fixed in the base and in the last link, so only their coordinates in the tip frame change.
    """
    in_tip = old_from_new[:3, :3].T @ (reach.in_tip - old_from_new[:3, 3])
    length = reach.lengths[0]
    return Reach(reach.in_base, in_tip, np.array([length, length + float(np.linalg.norm(in_tip))]))


def moved_starts(starts: np.ndarray, old_from_new: np.ndarray) -> np.ndarray:
    """Return the starts (n + 7, m) float32, see starts.make_starts, with the poses of a tip at old_from_new (4, 4)."""
    moved = starts.copy()
    p, w, v = moved[-POSE:-4], moved[-4], moved[-3:]  # views
    t = old_from_new[:3, 3].astype(np.float32)
    turn, *axis = _quaternion(old_from_new[:3, :3]).astype(np.float32)
    # Rotated by the unit quaternion (w, v): t + 2 (w v x t + v (v t) - t (v v)); products of quaternions behind it.
    p += t[:, None] * (1.0 - 2.0 * (v * v).sum(axis=0)) + 2.0 * (v * (t @ v) - w * (_across(t) @ v))
    w[:], v[:] = turn * w - axis @ v, turn * v + np.outer(axis, w) - _across(axis) @ v
    return moved


def _quaternion(rotation: np.ndarray) -> np.ndarray:
    """Return the unit quaternion (4,) w x y z of a rotation (3, 3): the longest row of 4 q q^T."""
    products = np.empty((4, 4))
    products[1:, 1:] = rotation + rotation.T
    np.fill_diagonal(products[1:, 1:], 1.0 + 2.0 * np.diag(rotation) - np.trace(rotation))
    products[0] = products[:, 0] = [
        1.0 + np.trace(rotation), rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0],
        rotation[1, 0] - rotation[0, 1],
    ]  # fmt: skip
    largest = products[np.argmax(np.diag(products))]
    return largest / np.linalg.norm(largest)


def _across(vector: np.ndarray | list[np.float32]) -> np.ndarray:
    """Return the matrix (3, 3) that takes v to vector x v."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]], dtype=np.float32)
