"""Names of singularities, from the axes of the joints: what a person sees of an arm that can hardly move one way."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

TAKES_PART = 0.15  # of the fastest joint of the motion that hardly moves the tip
PARALLEL = 0.25  # sine of the angle between two axes that count as parallel
MAINLY = 0.5  # as above, for the last joint of a wrist
APART = 0.1  # m between two axes that can be an upper arm
ALONG = 0.5  # cosine of the angle between the direction that is lost and the one that names it
OTHERWISE = 'nearly singular'


def name_singularity(
    jacobian: np.ndarray, joint_motion: np.ndarray, lost: np.ndarray, names: Sequence[str]
) -> str:
    """Return what makes an arm nearly singular: 'too far: elbow is nearly stretched' or its like.

    jacobian: (6, n) geometric. joint_motion: (n,) that hardly moves the tip. lost: (6,) twist that hardly any motion of
    the joints makes. All in base axes. Wrists are told by their outer axes; elbows and shoulders by the direction that
    is lost, along the upper arm or across the plane of the arm. Other arms are `OTHERWISE`.
    """
    turning = [i for i in range(jacobian.shape[1]) if np.linalg.norm(jacobian[3:, i]) > 0.5]
    moving = np.abs(joint_motion) > TAKES_PART * np.abs(joint_motion).max()
    axes = {i: jacobian[3:, i] / np.linalg.norm(jacobian[3:, i]) for i in turning}
    # The point of each axis that is nearest to the tip, seen from there: v = axis x (tip - point).
    points = {i: np.cross(axes[i], jacobian[:3, i]) for i in turning}
    if len(turning) > 2:
        i, j = turning[-3], turning[-1]
        if moving[i] and np.abs(joint_motion[j]) > MAINLY * np.abs(joint_motion).max() and _parallel(axes[i], axes[j]):
            return f'the axes of {names[i]} and {names[j]} are nearly parallel'
    force = lost[:3] / max(float(np.linalg.norm(lost[:3])), 1e-12)
    for i, j in _neighbours(turning, axes):
        upper_arm = _between(points[i], points[j], axes[j])
        length = float(np.linalg.norm(upper_arm))
        if length < APART or j == turning[-1]:
            continue
        along, across = abs(upper_arm @ force) / length, abs(axes[j] @ force)
        if max(along, across) < ALONG:
            break
        if across > along:
            return f'too near: the wrist is nearly on the axis of {names[turning[0]]}'
        wrist = _meeting([points[k] for k in turning if k > j], [axes[k] for k in turning if k > j])
        stretched = _between(points[j], wrist, axes[j]) @ upper_arm > 0.0
        return f'too far: {names[j]} is nearly stretched' if stretched else f'too near: {names[j]} is nearly folded'
    return OTHERWISE


def _neighbours(turning: list[int], axes: dict[int, np.ndarray]) -> list[tuple[int, int]]:
    """Return joints that follow each other and have parallel axes."""
    return [(i, j) for i, j in zip(turning, turning[1:]) if _parallel(axes[i], axes[j])]


def _parallel(one: np.ndarray, other: np.ndarray) -> bool:
    """Return whether two axes are nearly parallel."""
    return bool(np.linalg.norm(np.cross(one, other)) < PARALLEL)


def _between(one: np.ndarray, other: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the way (3,) from one point to another, across an axis."""
    way = other - one
    return way - (way @ axis) * axis


def _meeting(points: list[np.ndarray], axes: list[np.ndarray]) -> np.ndarray:
    """Return the point (3,) that is nearest to some lines, and of several such points the one nearest to the tip."""
    across = [np.eye(3) - np.outer(axis, axis) for axis in axes]
    return np.linalg.pinv(sum(across), rcond=1e-3) @ sum(matrix @ point for matrix, point in zip(across, points))
