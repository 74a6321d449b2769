"""A sphere that the arm cannot leave: the proof that a target is out of reach.

Take a point on every revolute axis. Points on neighbouring axes are fixed in one link, so their distance never
changes, and the chain of points cannot be longer than the sum of those distances. The first point is fixed in the
base, the last one in the tip frame. Any points make a valid bound. Sliding each one along its axis to where the path
between its two neighbours is shortest (the law of reflection) makes the bound tight: a spherical wrist counts as one
point.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import kernel
from ros_ik_pkg.ik.kernel.data_layout import Geometry, Reach

SWEEPS = 30


def make_reach(geometry: Geometry) -> Reach:
    """Compute the bound of one chain; its length is infinite if a joint may slide without end."""
    frames, length = _axes_at_zero(geometry)
    turning = [k for k in range(len(geometry.prismatic)) if not geometry.prismatic[k]]
    tip = frames[-1]
    if not turning:
        return Reach(tip[:3, 3].copy(), np.zeros(3), np.array([length, length]))
    lines = [(frames[k][:3, 3], frames[k][:3, 2]) for k in turning]
    points = _shorten(lines)
    length += sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points))
    in_tip = tip[:3, :3].T @ (points[-1] - tip[:3, 3])
    return Reach(points[0], in_tip, np.array([length, length + float(np.linalg.norm(in_tip))]))


def _axes_at_zero(geometry: Geometry) -> tuple[list[np.ndarray], float]:
    """Return the frames of all joints and of the tip with every joint value 0, and how much sliding can add [m]."""
    frames, pose, slide = [], np.eye(4), 0.0
    for k, row in enumerate(geometry.placements):
        placement = np.eye(4)
        placement[:3, :3], placement[:3, 3] = row[:9].reshape(3, 3), row[9:]
        pose = pose @ placement
        frames.append(pose)
        if k < len(geometry.prismatic) and geometry.prismatic[k]:
            i = int(geometry.variable[k])
            ends = geometry.multiplier[k] * np.array([geometry.lower[i], geometry.upper[i]]) + geometry.offset[k]
            slide += float(np.max(np.abs(ends)))
    return frames, slide


def _shorten(lines: list[tuple[np.ndarray, np.ndarray]]) -> list[np.ndarray]:
    """Slide the points along their lines (point, direction) until the path through them stops getting shorter."""
    points = [origin.copy() for origin, _ in lines]
    for _ in range(SWEEPS):
        for k, (origin, direction) in enumerate(lines):
            neighbours = [points[j] for j in (k - 1, k + 1) if 0 <= j < len(lines)]
            along = [float(direction @ (point - origin)) for point in neighbours]
            away = [float(np.linalg.norm(point - origin - s * direction)) for point, s in zip(neighbours, along)]
            points[k] = origin + _reflect(along, away) * direction
    return points


def _reflect(along: list[float], away: list[float]) -> float:
    """Return where on a line the path between two points, at these distances along and away from it, is shortest."""
    if len(along) < 2:
        return along[0] if along else 0.0
    total = away[0] + away[1]
    return 0.5 * (along[0] + along[1]) if total < 1e-12 else (along[0] * away[1] + along[1] * away[0]) / total


@kernel
def out_of_reach(geometry, reach, task, tuning):
    """Return whether no configuration can reach the target, whatever the limits of joints that turn."""
    if tuning.respect_limits <= 0.0 and slides(geometry):
        return False  # the lengths assume that slides keep their limits
    for r in range(3):
        if task.weights[r] <= 0.0:
            return False
    R, p, x = task.R, task.p, reach.in_tip
    turned = task.weights[3] > 0.0 and task.weights[4] > 0.0 and task.weights[5] > 0.0
    bound = reach.lengths[0] if turned else reach.lengths[1]
    slack = tuning.position_tolerance + length(task.tolerances, 0)
    dx, dy, dz = p[0] - reach.in_base[0], p[1] - reach.in_base[1], p[2] - reach.in_base[2]
    if turned:
        dx += R[0] * x[0] + R[1] * x[1] + R[2] * x[2]
        dy += R[3] * x[0] + R[4] * x[1] + R[5] * x[2]
        dz += R[6] * x[0] + R[7] * x[1] + R[8] * x[2]
        slack += (tuning.orientation_tolerance + length(task.tolerances, 3)) * length(x, 0)
    return math.sqrt(dx * dx + dy * dy + dz * dz) > bound * (1.0 + 1e-9) + slack


@kernel
def slides(geometry):
    """Return whether a joint is prismatic."""
    for k in range(len(geometry.prismatic)):
        if geometry.prismatic[k]:
            return True
    return False


@kernel
def length(vector, first):
    """Return the Euclidean length of three components."""
    x, y, z = vector[first], vector[first + 1], vector[first + 2]
    return math.sqrt(x * x + y * y + z * z)
