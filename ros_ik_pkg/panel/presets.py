"""Seeds and targets worth looking at, for any arm."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ros_ik_pkg.compare.problem import Problem, make_problem
from ros_ik_pkg.compare.singular import bounds, regular_configuration, smallest_singular_value
from ros_ik_pkg.ik import Arm

SAMPLES = 48  # positions of a joint that are looked at
OFF_SINGULAR = np.radians(0.1)  # rad; offset from the singularity, because exactly there the joints do not move
SHIFT = 0.09  # of the arm's reach, in x, y and z
NOTHING = 1e-6  # m, or of a singular value: a joint with less gain does not move


def notes(arm: Arm) -> Problem:
    """Take the seed of the notes and the default target; for other arms than the Puma 560 their home."""
    return make_problem(arm, None, None)


def stretched(arm: Arm) -> Problem:
    """Aim at the edge of the reach, where the arm with a straight elbow is singular."""
    seed = notes(arm).seed
    return Problem(arm, seed, arm.forward(stretch(arm, seed)))


def wrist_singular(arm: Arm) -> Problem:
    """Start with the wrist axes in line, and aim where they would have to turn."""
    seed = notes(arm).seed
    for joint in range(arm.n - 2, 3, -1):  # with six joints only the last but one; a redundant arm needs more
        seed = best_position(arm, seed, joint, lambda q: -smallest_singular_value(arm, q))
    seed = seed.copy()
    seed[-2] = np.clip(np.round(seed[-2], 2) + OFF_SINGULAR, arm.lower[-2], arm.upper[-2])
    target = arm.forward(seed)
    target[:3, 3] += SHIFT * reach(arm)
    return Problem(arm, seed, target)


def behind(arm: Arm) -> Problem:
    """Turn the tip's own pose by half a turn about the base."""
    seed = notes(arm).seed
    return Problem(arm, seed, np.diag([-1.0, -1.0, 1.0, 1.0]) @ arm.forward(seed))


def unreachable(arm: Arm) -> Problem:
    """Aim at twice the distance that the arm has."""
    start = notes(arm)
    target = start.target.copy()
    target[:3, 3] *= 1.3 * reach(arm) / np.linalg.norm(target[:3, 3])
    return Problem(arm, start.seed, target)


def random(arm: Arm) -> Problem:
    """Aim at a random pose within reach."""
    return Problem(arm, notes(arm).seed, arm.forward(regular_configuration(arm, np.random.default_rng())))


PRESETS: dict[str, Callable[[Arm], Problem]] = {
    'Lecture notes': notes,
    'Arm stretched out': stretched,
    'Wrist singular': wrist_singular,
    'Behind the base': behind,
    'Unreachable': unreachable,
    'Random': random,
}


def reach(arm: Arm) -> float:
    """Return the distance [m] of the tip from the base with the arm stretched out."""
    return float(np.linalg.norm(arm.forward(stretch(arm, arm.home))[:3, 3]))


def stretch(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Return q (n,) with one joint after the other moved so that the tip is as far out as it gets."""
    for joint in range(1, arm.n):
        q = best_position(arm, q, joint, lambda q: np.linalg.norm(arm.forward(q)[:3, 3]))
    return q


def best_position(arm: Arm, q: np.ndarray, joint: int, value: Callable[[np.ndarray], float]) -> np.ndarray:
    """Return q with one joint moved to maximise `value`: a scan over SAMPLES positions, then a refinement.

    A joint without influence, such as a wrist joint on the distance of its centre, does not move.
    """
    lower, upper = (limit[joint] for limit in bounds(arm))
    best, width = q[joint], upper - lower
    for _ in range(3):
        positions = np.linspace(max(lower, best - width), min(upper, best + width), SAMPLES)
        candidates = [np.r_[q[:joint], position, q[joint + 1 :]] for position in positions]
        best = positions[np.argmax([value(candidate) for candidate in candidates])]
        width /= SAMPLES / 3
    moved = np.r_[q[:joint], best, q[joint + 1 :]]
    return moved if value(moved) > value(q) + NOTHING else q
