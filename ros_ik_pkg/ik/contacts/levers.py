"""How fast the distance of two bodies can shrink per unit of joint motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ros_ik_pkg.ik.collision.scene import JOINT
from ros_ik_pkg.ik.contacts.frames import Bodies

ENDLESS = 1e6  # m: travel of a slide without limits

Ball = tuple[int, float]  # a body, and how far from its origin a piece of it reaches [m]


def make_levers(bodies: Bodies, values: Sequence[float], pairs: Sequence[tuple[Ball, Ball]], n: int) -> np.ndarray:
    """Return (C, n): the most that the gap of each pair of balls shrinks per rad or m of each of n variables.

    values: positions of the joints that no variable moves [rad, m].
    """
    levers = np.zeros((len(pairs), n))
    for row, (one, other) in zip(levers, pairs):
        shared = set(bodies.above(one[0])) & set(bodies.above(other[0]))
        for body, reach in (one, other):
            _add(row, bodies, values, body, reach, shared)
    return levers


def _add(
    row: np.ndarray, bodies: Bodies, values: Sequence[float], body: int, reach: float, shared: set[int]
) -> None:
    """Add to a row (n,) how far each variable moves a ball; joints that carry both balls do not count."""
    for above in bodies.above(body):
        if above in shared:
            return
        joint = bodies.joints[above - 1]
        variable, slides = int(joint[2]), bool(joint[1])
        if variable >= 0:
            row[variable] += abs(joint[3]) * (1.0 if slides else reach)
        if slides:
            reach += _furthest(bodies, values, above - 1)
        reach += float(np.linalg.norm(joint[JOINT - 3 :]))


def _furthest(bodies: Bodies, values: Sequence[float], joint: int) -> float:
    """Return how far a sliding joint is from its zero at most [m]."""
    if bodies.joints[joint, 2] < 0.0:
        return abs(values[joint])
    name, multiplier, offset = bodies.drives[joint]
    return min(max(abs(multiplier * limit + offset) for limit in bodies.ranges[name]), ENDLESS)
