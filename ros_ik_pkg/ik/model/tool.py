"""A tool on the tip frame, as people give it: numbers, a matrix or an SE3."""

from __future__ import annotations

from typing import Any

import numpy as np

from ros_ik_pkg.ik.exceptions import ArgumentError
from ros_ik_pkg.ik.model.transforms import rotation_from_quaternion, rotation_from_rpy, transform

ROTATION_SLACK = 1e-3  # largest component of R R^T - I that still counts as a rotation
QUATERNION_SLACK = 0.01  # how far the norm of a quaternion may be from 1
FURTHEST = 100.0  # m; no tool is longer
EXPECTED = 'x y z roll pitch yaw [m, rad], x y z and a unit quaternion x y z w, or a pose (4, 4)'


def read_tool(tool: Any) -> np.ndarray:
    """Return the pose (4, 4) of a tool in the tip frame; the identity for None or an empty list.

    tool: (6,) x y z roll pitch yaw about fixed axes (REP 103) [m, rad], (7,) x y z and a quaternion x y z w, (4, 4), or
    a pinocchio.SE3. Raises ArgumentError for anything else.
    """
    given = getattr(tool, 'homogeneous', tool)
    try:
        numbers = np.array([] if given is None else given, dtype=np.float64)
    except (TypeError, ValueError):
        raise _error(tool) from None
    if numbers.shape == (0,):
        return np.eye(4)
    if not np.all(np.isfinite(numbers)):
        raise _error(tool)
    if numbers.shape == (6,):
        pose = transform(rotation_from_rpy(numbers[3:]), numbers[:3])
    elif numbers.shape == (7,) and abs(np.linalg.norm(numbers[3:]) - 1.0) <= QUATERNION_SLACK:
        pose = transform(rotation_from_quaternion(numbers[3:]), numbers[:3])
    elif numbers.shape == (4, 4) and _is_pose(numbers):
        pose = numbers
    else:
        raise _error(tool)
    if np.abs(pose[:3, 3]).max() > FURTHEST:
        raise ArgumentError(f'tool is {np.abs(pose[:3, 3]).max():g} m away from the tip frame; at most {FURTHEST:g}')
    return pose


def _is_pose(matrix: np.ndarray) -> bool:
    """Return whether a matrix (4, 4) has a right-handed rotation and the last row 0 0 0 1."""
    rotation = matrix[:3, :3]
    turned = np.abs(rotation @ rotation.T - np.eye(3)).max() <= ROTATION_SLACK and np.linalg.det(rotation) > 0.0
    return turned and bool(np.all(matrix[3] == (0.0, 0.0, 0.0, 1.0)))


def _error(tool: Any) -> ArgumentError:
    return ArgumentError(f'tool = {tool!r}; expected finite numbers: {EXPECTED}')
