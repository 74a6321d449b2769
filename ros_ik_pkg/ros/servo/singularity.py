"""Names of singularities, such as a stretched elbow, from the axes of the joints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

TAKES_PART = 0.15  # of the speed of the fastest joint in the motion that hardly moves the tip
PARALLEL = 0.25  # sine of the angle between two axes that count as parallel
MAINLY = 0.5  # as above, for the last joint of a wrist
APART = 0.1  # m; shortest upper arm between two axes
ALONG = 0.5  # cosine of the angle between the lost direction and the one that names the singularity
OTHERWISE = 'nearly singular'


def name_singularity(
    jacobian: np.ndarray, joint_motion: np.ndarray, lost: np.ndarray, names: Sequence[str]
) -> str:
    """Return in words why an arm is nearly singular, such as 'too far: elbow is nearly stretched'.

    jacobian: (6, n) geometric. joint_motion: (n,) that hardly moves the tip. lost: (6,) twist that needs the fastest
    joints. All in base axes. Wrists are recognised by their outer axes; elbows and shoulders by the lost direction,
    along the upper arm or across the plane of the arm. Other arms are `OTHERWISE`.
    """
    turning = np.flatnonzero(np.linalg.norm(jacobian[3:], axis=0) > 0.5)
    names = [names[i] for i in turning]
    axes = jacobian[3:, turning].T / np.linalg.norm(jacobian[3:, turning], axis=0)[:, None]
    # The point of each axis that is nearest to the tip, relative to the tip: velocity = axis x (tip - point).
    points = np.cross(axes, jacobian[:3, turning].T)
    motion = np.abs(joint_motion[turning]) / np.abs(joint_motion).max()
    parallel = 1.0 - (axes @ axes.T) ** 2 < PARALLEL**2
    wrist = len(turning) > 2 and parallel[-3, -1] and not parallel[-3, -2]
    if wrist and motion[-3] > TAKES_PART and motion[-1] > MAINLY:
        return f'the axes of {names[-3]} and {names[-1]} are nearly parallel'
    force = lost[:3] / max(float(np.linalg.norm(lost[:3])), 1e-12)
    for j in range(1, len(turning) - 1):
        upper_arm = _between(points[j - 1], points[j], axes[j])
        length = float(np.linalg.norm(upper_arm))
        if not parallel[j - 1, j] or length < APART:
            continue
        along, across = abs(upper_arm @ force) / length, abs(axes[j] @ force)
        if max(along, across) < ALONG:
            break
        if across > along:
            return f'too near: the wrist is nearly on the axis of {names[0]}'
        stretched = _between(points[j], _meeting(points[j + 1 :], axes[j + 1 :]), axes[j]) @ upper_arm > 0.0
        return f'too far: {names[j]} is nearly stretched' if stretched else f'too near: {names[j]} is nearly folded'
    return OTHERWISE


def _between(one: np.ndarray, other: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the vector (3,) from one point to another, perpendicular to an axis."""
    way = other - one
    return way - (way @ axis) * axis


def _meeting(points: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return the point (3,) nearest to some lines (k, 3), and of several such points the one nearest to the tip."""
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    return np.linalg.pinv(across.sum(axis=0), rcond=1e-3) @ (across @ points[:, :, None]).sum(axis=0)[:, 0]
