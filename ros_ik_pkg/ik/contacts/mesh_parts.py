"""A mesh cut into few parts, whose convex hulls fit it better than the hull of the whole mesh."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik.contacts.coal_library import hull_volume

MOST_CUTS = 2  # in a row: four parts
PLACES = (0.3, 0.5, 0.7)  # of the extent, where a cut may be
WORTH = 0.1  # of the hull's volume that a cut must save
SAMPLE = 1500  # points from which volumes are estimated


def cut_into_parts(triangles: np.ndarray, cuts: int = MOST_CUTS) -> list[np.ndarray]:
    """Return the corners (k, 3) of each part of a mesh of triangles (t, 3, 3).

    A part lies between the planes of the cuts, and triangles are cut by the planes. So the hulls of all parts contain
    the whole mesh and its inside: each cross-section lies in the hull of its edge.
    """
    corners = np.unique(triangles.reshape(-1, 3), axis=0)
    whole = _volume(corners)
    best, sides = (1.0 - WORTH) * whole, None
    if cuts > 0 and whole > 0.0:
        lowest, highest = corners.min(axis=0), corners.max(axis=0)
        for axis in range(3):
            for place in PLACES:
                at = lowest[axis] + place * (highest[axis] - lowest[axis])
                halves = [_one_side(triangles, axis, at, sign) for sign in (1.0, -1.0)]
                volume = sum(_volume(half.reshape(-1, 3)) for half in halves)
                if volume < best:
                    best, sides = volume, halves
    if sides is None:
        return [corners]
    return [part for half in sides for part in cut_into_parts(half, cuts - 1)]


def _volume(points: np.ndarray) -> float:
    """Return an estimate of the volume of the hull of points (k, 3)."""
    return hull_volume(points[:: max(1, len(points) // SAMPLE)])


def _one_side(triangles: np.ndarray, axis: int, at: float, sign: float) -> np.ndarray:
    """Return the triangles (t, 3, 3) of the part on one side of a plane."""
    heights = sign * (triangles[:, :, axis] - at)
    inside = heights >= 0.0
    count = inside.sum(axis=1)
    found = [triangles[count == 3]]
    for number, alone in ((1, True), (2, False)):  # the corner that is alone on its side comes first
        some = count == number
        first = np.argmax(inside[some] == alone, axis=1)
        order = (first[:, None] + np.arange(3)) % 3
        corner = np.take_along_axis(triangles[some], order[:, :, None], axis=1)
        height = np.take_along_axis(heights[some], order, axis=1)
        a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]
        fraction = height[:, :1] / (height[:, :1] - height[:, 1:])
        ab, ac = (a + fraction[:, [k]] * (end - a) for k, end in enumerate((b, c)))
        for edge in (ab, ac):
            edge[:, axis] = at
        if alone:
            found.append(np.stack([a, ab, ac], axis=1))
        else:
            found += [np.stack([ab, b, c], axis=1), np.stack([ab, c, ac], axis=1)]
    return np.concatenate(found)
