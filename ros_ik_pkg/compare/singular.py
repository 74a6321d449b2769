"""Random regular and singular configurations of any arm."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik import Arm

SAMPLES = 48  # over a joint's range, in the search for the smallest sigma_min
REFINEMENTS = 40  # halvings of the step; more would be below the resolution of float64


def bounds(arm: Arm) -> tuple[np.ndarray, np.ndarray]:
    """Return the limits (n,) [rad, m], cut to half a turn on either side."""
    return np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)


def smallest_singular_value(arm: Arm, q: np.ndarray) -> float:
    """Return sigma_min of the Jacobian at q (n,)."""
    return float(np.linalg.svd(arm.jacobian(q), compute_uv=False)[-1])


def regular_configuration(arm: Arm, random: np.random.Generator) -> np.ndarray:
    """Return the least singular of five random configurations (n,)."""
    candidates = random.uniform(*bounds(arm), size=(5, arm.n))
    return max(candidates, key=lambda q: smallest_singular_value(arm, q))


def singular_configuration(arm: Arm, random: np.random.Generator) -> np.ndarray:
    """Return a random configuration (n,) with one joint moved to make the Jacobian (nearly) singular."""
    q = random.uniform(*bounds(arm))
    # sigma_min does not depend on the outer two
    found = [_worst_position(arm, q, joint) for joint in range(1, arm.n - 1)]
    return min(found, key=lambda candidate: smallest_singular_value(arm, candidate), default=q)


def _worst_position(arm: Arm, q: np.ndarray, joint: int) -> np.ndarray:
    """Return q with one joint moved to the smallest sigma_min in its range: a scan, then bisection."""
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
