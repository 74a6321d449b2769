"""Which pairs of pieces are close to each other but can't touch within the joint limits: the search skips them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ros_ik_pkg.ik.collision.kept_distance import kept_distances
from ros_ik_pkg.ik.contacts.frames import Bodies

SAMPLES = 200
SLACK = 1e-6  # rad or m beyond the limits, for positions that are kept in single precision


def bounds_of(bodies: Bodies, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return the bounds (2, n) of configurations that count as within limits (n,) [rad, m].

    They are infinite for joints that can turn by a whole turn, because all positions look like one between -pi and pi;
    what has no limits else is bounded, and looked at beyond.
    """
    ends = np.where(np.isinf(lower), -np.pi, lower), np.where(np.isinf(upper), np.pi, upper)
    bounds = np.array([ends[0] - SLACK, ends[1] + SLACK])
    for i in range(len(lower)):
        driven = bodies.joints[bodies.joints[:, 2] == i]
        turns = not np.any(driven[:, 1]) and not np.any(driven[:, 3] % 1.0)
        if turns and upper[i] - lower[i] >= 2.0 * np.pi:
            bounds[:, i] = -np.inf, np.inf
    return bounds


def find_kept_apart(
    packed: np.ndarray, bodies: Bodies, owners: Sequence[int], pairs: Sequence[tuple[int, int]], levers: np.ndarray,
    bounds: np.ndarray,
) -> dict[tuple[int, int], float]:
    """Return the distance that pairs of pieces keep between bounds (2, n) [m], of those that are close and keep one.

    packed: the scene, with its K pairs. owners: the body of each piece. levers: (K, n), see `make_levers`. Of pairs
    that a joint outside the chain moves relative to each other nothing is known.
    """
    box = np.where(np.isinf(bounds), np.array([[-np.pi], [np.pi]]), bounds)
    samples = np.random.default_rng(0).uniform(box[0], box[1], (SAMPLES, box.shape[1]))
    kept = kept_distances(packed, levers, samples, box)
    found = {}
    for pair, distance in zip(pairs, kept):
        one, other = (set(bodies.above(owners[piece])) for piece in pair)
        if distance > 0.0 and all(bodies.joints[body - 1, 2] >= 0.0 for body in one ^ other):
            found[pair] = float(distance)
    return found
