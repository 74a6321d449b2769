"""Names of singularities, such as a stretched elbow, from the axes of the joints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

TAKES_PART = 0.15  # of the speed of the fastest joint in the motion that hardly moves the tip
PARALLEL = 0.25  # sine of the angle between two axes that count as parallel
MAINLY = 0.5  # as above, for the last joint of a wrist
STRAIGHT = 0.06  # sine of the bend of an elbow that is stretched or folded, wherever its wrist is
BENT = 0.3  # sine of the bend of an elbow that is neither
CROSSING = 0.01  # m from one point, at most, of axes that cross in it
APART = 0.1  # m; shortest upper arm between two axes
ALONG = 0.5  # cosine of the angle between the lost direction and the one that names the singularity
OTHERWISE = 'nearly singular'


def name_singularity(
    jacobian: np.ndarray, joint_motion: np.ndarray, lost: np.ndarray, names: Sequence[str]
) -> str:
    """Return in words why an arm is nearly singular, such as 'too far: elbow is nearly stretched'.

    jacobian: (6, n) geometric. joint_motion: (n,) that hardly moves the tip. lost: (6,) twist that needs the fastest
    joints. All in base axes. Wrists, and shoulders of three axes, are recognised by their outer axes; elbows and other
    shoulders by the lost direction, along the arm or across its plane. Other arms are `OTHERWISE`.
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
        shoulder = points[j - 1] if parallel[j - 1, j] else _crossing(points[:j], axes[:j])
        if shoulder is None:
            continue
        upper_arm = _between(shoulder, points[j], axes[j])
        length = float(np.linalg.norm(upper_arm))
        if length < APART:
            continue
        wrist = points[j + 1] if parallel[j, j + 1] else _meeting(points[j + 1 :], axes[j + 1 :])
        forearm = _between(points[j], wrist, axes[j])
        bend = abs(float(axes[j] @ np.cross(upper_arm, forearm))) / max(length * float(np.linalg.norm(forearm)), 1e-12)
        along, across = abs(_unit(upper_arm) @ force), abs(axes[j] @ force)
        if not parallel[j - 1, j]:  # such an arm leans any way, and is as long as from its shoulder to its wrist
            along, across = abs(_unit(upper_arm + forearm) @ force) * (bend < BENT), 0.0
        if max(along, across) < ALONG:
            break
        if across > along and bend > STRAIGHT:
            return f'too near: the wrist is nearly on the axis of {names[0]}'
        stretched = forearm @ upper_arm > 0.0
        return f'too far: {names[j]} is nearly stretched' if stretched else f'too near: {names[j]} is nearly folded'
    ball = len(turning) > 3 and parallel[0, 2] and not parallel[0, 1]
    if ball and motion[0] > TAKES_PART and motion[2] > TAKES_PART:
        return f'the axes of {names[0]} and {names[2]} are nearly parallel'
    return OTHERWISE


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)


def _crossing(points: np.ndarray, axes: np.ndarray) -> np.ndarray | None:
    """Return the point (3,) in which three or more lines (k, 3) cross, as in a shoulder that is a ball; else None."""
    if len(points) < 3:
        return None
    point = _meeting(points, axes)
    off = np.linalg.norm(np.cross(point - points, axes), axis=1)
    return point if off.max() < CROSSING else None


def _between(one: np.ndarray, other: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the vector (3,) from one point to another, perpendicular to an axis."""
    way = other - one
    return way - (way @ axis) * axis


def _meeting(points: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return the point (3,) nearest to some lines (k, 3), and of several such points the one nearest to the tip."""
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    return np.linalg.pinv(across.sum(axis=0), rcond=1e-3) @ (across @ points[:, :, None]).sum(axis=0)[:, 0]
