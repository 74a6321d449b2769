"""Random configurations, and singular ones, of any arm."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik import Arm

SAMPLES = 48  # of a joint's range, to find where the Jacobian is worst
REFINEMENTS = 40  # halvings of the step around it; beyond, float64 has no digits left


def bounds(arm: Arm) -> tuple[np.ndarray, np.ndarray]:
    """Return limits (n,) [rad, m] with half a turn at most to either side."""
    return np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)


def smallest_singular_value(arm: Arm, q: np.ndarray) -> float:
    """Return sigma_min of the Jacobian at q (n,)."""
    return float(np.linalg.svd(arm.jacobian(q), compute_uv=False)[-1])


def regular_configuration(arm: Arm, random: np.random.Generator) -> np.ndarray:
    """Return the one of five random configurations (n,) that is furthest from singular."""
    candidates = random.uniform(*bounds(arm), size=(5, arm.n))
    return max(candidates, key=lambda q: smallest_singular_value(arm, q))


def singular_configuration(arm: Arm, random: np.random.Generator) -> np.ndarray:
    """Return a random configuration (n,) with one joint moved to where the Jacobian loses rank, or nearly so."""
    q = random.uniform(*bounds(arm))
    found = [_worst_position(arm, q, joint) for joint in range(1, arm.n - 1)]  # the outer two never matter
    return min(found, key=lambda candidate: smallest_singular_value(arm, candidate), default=q)


def _worst_position(arm: Arm, q: np.ndarray, joint: int) -> np.ndarray:
    """Return q with one joint where sigma_min is smallest over its range: a scan, then ever smaller steps."""
    lower, upper = (limit[joint] for limit in bounds(arm))

    def moved(position: float) -> np.ndarray:
        out = q.copy()
        out[joint] = position
        return out

    positions = np.linspace(lower, upper, SAMPLES)
    best = positions[np.argmin([smallest_singular_value(arm, moved(position)) for position in positions])]
    width = (upper - lower) / SAMPLES
    for _ in range(REFINEMENTS):
        near = np.clip([best - width, best, best + width], lower, upper)
        best = near[np.argmin([smallest_singular_value(arm, moved(position)) for position in near])]
        width *= 0.5
    return moved(best)
