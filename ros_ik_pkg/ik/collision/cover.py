"""Covers: the hull of few points, rounded by a radius, that contains the hull of many points.

The distance to a convex set is a convex function, so over the hull of the many points it is largest at one of them.
So the radius is the largest distance of one of the many points from the hull of the few.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik.collision.convex_distance import CLOSE_ENOUGH, SCRATCH, hull_distance
from ros_ik_pkg.ik.kernel.compiled import compiled, kernel

FEW_POINTS = 16  # of the coarse cover
MOST_POINTS = 256  # of the fine one
CLOSE = 2e-4  # [m] radius at which no more points are added
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
ROUNDING = 2.0 * CLOSE_ENOUGH  # [m] added to the radius: a distance below CLOSE_ENOUGH counts as none


class Cover(NamedTuple):
    """The hull of `points` (m, 3), rounded by `fine_radius`, and that of the first `few`, rounded by `radius`, hold
    the same body [m]."""

    points: np.ndarray
    few: int
    radius: float
    fine_radius: float

    def grown(self, by: float) -> Cover:
        """Return the cover of the body rounded by another `by` [m]."""
        return self._replace(radius=self.radius + by, fine_radius=self.fine_radius + by)


def sphere_around(points: np.ndarray) -> np.ndarray:
    """Return centre and radius (4,) of a sphere around points (k, 3)."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return np.append(centre, np.linalg.norm(points - centre, axis=1).max() + ROUNDING)


def capsule_around(points: np.ndarray) -> np.ndarray:
    """Return both ends and the radius (7,) of a capsule around points (k, 3), the smallest along a few directions."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    spread = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    capsules = [_capsule_along(points, centre, axis) for axis in (*np.eye(3), *spread)]
    return min(capsules, key=lambda found: found[6] ** 2 * (4 / 3 * found[6] + np.linalg.norm(found[3:6] - found[:3])))


def _capsule_along(points: np.ndarray, centre: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the shortest capsule of the smallest radius around points, along an axis through a centre."""
    along = (points - centre) @ axis
    away = np.linalg.norm(points - centre - np.outer(along, axis), axis=1)
    radius = away.max()
    room = np.sqrt(radius**2 - away**2)  # how far a point may be beyond an end
    start, end = (along + room).min(), (along - room).max()
    if start > end:
        start = end = 0.5 * (start + end)
    ends = [centre + start * axis, centre + end * axis]
    return np.array([*ends[0], *ends[1], radius + ROUNDING])


def cover_points(points: np.ndarray) -> Cover:
    """Return a cover of the convex hull of points (k, 3) [m].

    Its points are chosen greedily: each is the one furthest from the hull of those before it.
    """
    if len(points) <= 8:
        return Cover(points, len(points), 0.0, 0.0)
    first = np.unique([function(points[:, axis]) for axis in range(3) for function in (np.argmin, np.argmax)])
    chosen = np.zeros(MOST_POINTS, np.int64)
    chosen[: len(first)] = first
    vertices = np.ascontiguousarray(points.T)
    workspace = np.empty((3, MOST_POINTS + 1))
    count, radius, coarse = reduce_points(vertices, chosen, len(first), workspace, np.full(len(points), np.inf))
    return Cover(points[chosen[:count]], min(count, FEW_POINTS), coarse + ROUNDING, radius + ROUNDING)


@compiled
def reduce_points(vertices, chosen, count, few, gaps):
    """Complete `chosen`; return how many are chosen, their radius and that of the first FEW_POINTS.

    `gaps` (m,) are infinite; `few` is workspace.
    """
    work, out, guess, pose = np.empty(SCRATCH), np.empty(6), np.empty(3), np.zeros(12)
    pose[0], pose[4], pose[8] = 1.0, 1.0, 1.0
    return _reduce(vertices, chosen, count, few, gaps, pose, work, out, guess)


@kernel
def _reduce(vertices, chosen, count, few, gaps, pose, work, out, guess):
    """Implement `reduce_points`."""
    coarse = 0.0
    for k in range(count):
        copy_point(vertices, chosen[k], few, k)
    while True:
        furthest, radius, last = -1, 0.0, few.shape[1] - 1
        for k in range(vertices.shape[1]):
            if gaps[k] > max(radius, CLOSE):  # gaps only shrink, so points that are near enough need no second look
                copy_point(vertices, k, few, last)
                for r in range(3):
                    guess[r] = few[r, 0] - vertices[r, k]
                gaps[k] = 0.0
                if abs(guess[0]) + abs(guess[1]) + abs(guess[2]) > 0.0:
                    _, gaps[k] = hull_distance(
                        few, 0, count, pose, last, 1, pose, math.inf, -math.inf, guess, out, work
                    )
            if gaps[k] > radius:
                furthest, radius = k, gaps[k]
        if count <= FEW_POINTS:
            coarse = radius
        if radius <= CLOSE or count == len(chosen):
            return count, radius, coarse
        chosen[count] = furthest
        copy_point(vertices, furthest, few, count)
        count += 1


@kernel
def copy_point(source, k, target, place):
    """Copy column k of points (3, m) to a column of others."""
    for r in range(3):
        target[r, place] = source[r, k]
