"""An arm as a polyline through the origins of its joints."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik import Arm


def placements(arm: Arm) -> list[np.ndarray]:
    """Return the constant transforms (4, 4) between the joints, from base to tool."""
    return [pin.SE3(row[:9].reshape(3, 3), row[9:]).homogeneous for row in arm.geometry.placements]


def joint_transforms(arm: Arm, q: np.ndarray) -> list[np.ndarray]:
    """Return the pose (4, 4) of each joint's moved frame in the one before it, at q (n,) [rad, m]."""
    out = []
    for k, step in enumerate(placements(arm)[:-1]):
        value = arm.multiplier[k] * q[arm.variable[k]] + arm.offset[k]
        motion = np.eye(4)
        if arm.prismatic[k]:
            motion[2, 3] = value
        else:
            motion[:3, :3] = pin.rpy.rpyToMatrix(0.0, 0.0, value)
        out.append(step @ motion)
    return out


def joint_origins(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Return the origins (nj + 2, 3) [m] of base, joints and tool in the base frame, at q (n,) [rad, m]."""
    pose, points = np.eye(4), [np.zeros(3)]
    for transform in (*joint_transforms(arm, q), placements(arm)[-1]):
        pose = pose @ transform
        points.append(pose[:3, 3])
    return np.array(points)
