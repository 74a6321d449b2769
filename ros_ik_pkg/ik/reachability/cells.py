"""Cells of poses: a grid of cubes for the position, and a partition of the rotations.

A rotation belongs to the component of its unit quaternion that is largest by magnitude (four faces, since q and -q are
one rotation). The three others, divided by it, are tangents of angles from -45 to 45 degrees, and these are cut into
equal parts: 4 k^3 cells, each about 90 / k degrees wide, of nearly equal volume, found without a search. (The cubed
sphere of Ronchi 1996, one dimension higher.)
"""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kinematics.pose_error import quaternion

FACES = 4
QUARTER = math.pi / 4  # half of what a face covers, in the tangent's angle


@inlined
def rotation_cell(R, parts):
    """Return the cell, from 0 to 4 parts^3 - 1, of a rotation given row by row."""
    w, x, y, z = quaternion(R)
    face, largest, a, b, c = 0, w, x, y, z
    if abs(x) > abs(largest):
        face, largest, a, b, c = 1, x, w, y, z
    if abs(y) > abs(largest):
        face, largest, a, b, c = 2, y, w, x, z
    if abs(z) > abs(largest):
        face, largest, a, b, c = 3, z, w, x, y
    i, j, k = part_of(a / largest, parts), part_of(b / largest, parts), part_of(c / largest, parts)
    return ((face * parts + i) * parts + j) * parts + k


@inlined
def part_of(tangent, parts):
    """Return which of the equal parts from -45 to 45 degrees holds the angle with this tangent."""
    return min(max(int((math.atan(tangent) / QUARTER + 1.0) * 0.5 * parts), 0), parts - 1)


@inlined
def position_cell(p, corner, step, shape):
    """Return the cell of a position [m] in the grid from `corner`, -1 outside it."""
    cell = 0
    for axis in range(3):
        place = (p[axis] - corner[axis]) / step
        if not 0.0 <= place < shape[axis]:  # before it becomes an integer, which for NaN depends on the processor
            return -1
        cell = cell * shape[axis] + int(place)
    return cell


def rotation_centres(parts: int) -> np.ndarray:
    """Return the rotations (4 parts^3, 3, 3) in the middle of the cells, in their order."""
    tangents = np.tan(QUARTER * (2.0 * (np.arange(parts) + 0.5) / parts - 1.0))
    quaternions = []
    for face in range(FACES):
        for others in np.stack(np.meshgrid(tangents, tangents, tangents, indexing='ij'), -1).reshape(-1, 3):
            quaternions.append(np.insert(others, face, 1.0) / math.sqrt(1.0 + others @ others))
    w, x, y, z = np.array(quaternions).T
    return np.stack([
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ], -1).reshape(-1, 3, 3)  # fmt: skip


def rotation_neighbours(parts: int) -> np.ndarray:
    """Return (4 parts^3, 6) int64: the six cells whose middles are nearest to that of each cell."""
    middles = rotation_centres(parts).reshape(-1, 9)
    closeness = middles @ middles.T  # 1 + 2 cos of the angle between two rotations
    np.fill_diagonal(closeness, -np.inf)
    return np.argsort(-closeness, axis=1, kind='stable')[:, :6]
