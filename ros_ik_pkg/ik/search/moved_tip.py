"""What a search knows of an arm in advance, for the same arm with its tip moved: without computing it anew."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik.kernel.data_layout import Reach

POSE = 7  # the last rows of the starts: position, and quaternion w x y z


def moved_reach(reach: Reach, old_from_new: np.ndarray) -> Reach:
    """Return the bound for a tip at the pose old_from_new (4, 4) in the tip frame of `reach`.

    Its points stay where they are in base and last link, so only their coordinates in the tip frame change.
    """
    in_tip = old_from_new[:3, :3].T @ (reach.in_tip - old_from_new[:3, 3])
    length = reach.lengths[0]
    return Reach(reach.in_base, in_tip, np.array([length, length + float(np.linalg.norm(in_tip))]))


def moved_starts(starts: np.ndarray, old_from_new: np.ndarray) -> np.ndarray:
    """Return the starts (n + 7, m) float32, see starts.make_starts, with the poses of a tip at old_from_new (4, 4)."""
    moved = starts.copy()
    p, w, v = moved[-POSE:-4], moved[-4], moved[-3:]  # views
    t = old_from_new[:3, 3].astype(np.float32)
    *axis, turn = pin.SE3ToXYZQUAT(pin.SE3(old_from_new))[3:].astype(np.float32)
    # Rotated by the unit quaternion (w, v): t + 2 (w v x t + v (v t) - t (v v)); products of quaternions behind it.
    p += t[:, None] * (1.0 - 2.0 * (v * v).sum(axis=0)) + 2.0 * (v * (t @ v) - w * (pin.skew(t) @ v))
    w[:], v[:] = turn * w - axis @ v, turn * v + np.outer(axis, w) - pin.skew(np.array(axis)) @ v
    return moved
