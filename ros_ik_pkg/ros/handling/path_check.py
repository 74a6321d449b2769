"""The last check of a motion before it is published, separate from the solver: tolerance, line, and every limit."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik import Arm, PathOptions, PathSolution, SolveOptions
from ros_ik_pkg.ik.contacts.contacts import Room
from ros_ik_pkg.ros.handling.final_check import contact_of, fault_of

PARTS = 10  # of each interval, at whose ends limits are checked
SLACK = 1.0 + 1e-6  # rounding


def fault_of_motion(
    solution: PathSolution, arm: Arm, options: SolveOptions, path: PathOptions, room: Room | None = None
) -> str:
    """Return why a motion must not be published, empty if it may. `room`: None if contact does not count."""
    if not (np.diff(solution.times) > 0.0).all():
        return 'its times do not rise'
    for row, (q, target) in enumerate(zip(solution.q, solution.base_from_tip)):
        if fault := fault_of(q, target, arm, options):
            return f'point {row}: {fault}'
    for row, q in enumerate(solution.q):
        start = solution.q[row - 1] if row else None
        if fault := contact_of(q, start, room, options, whole_motion=True):
            return f'point {row}: {fault}'
    return _fault_between(solution, arm, options, path)


def _fault_between(solution: PathSolution, arm: Arm, options: SolveOptions, path: PathOptions) -> str:
    """Return what is wrong between the points, at which a joint trajectory controller follows quintic polynomials."""
    q, v, a = (np.moveaxis(_on_grid(solution, order), 0, 1).reshape(-1, arm.n) for order in range(3))
    if not (np.isfinite(q).all() and np.isfinite(v).all() and np.isfinite(a).all()):
        return 'a point between two is not finite'
    if options.respect_limits and ((q < arm.lower) | (q > arm.upper)).any():
        return 'a joint leaves its limits between two points'
    if (np.abs(v) > arm.velocity_limits * SLACK).any():
        return 'a joint exceeds its velocity limit'
    if path.acceleration_limits and (np.abs(a) > np.array(path.acceleration_limits) * SLACK).any():
        return 'a joint exceeds its acceleration limit'
    middles = _on_grid(solution, 0)[PARTS // 2]
    for row in set(range(len(middles))) - set(solution.reconfigurations):
        start, end = solution.base_from_tip[row : row + 2]
        away, along = (arm.forward(middles[row]) - start)[:3, 3], (end - start)[:3, 3]
        square = along @ along
        fraction = min(max(along @ away / square, 0.0), 1.0) if square > 0.0 else 0.0
        if all(options.task_weights) and np.linalg.norm(away - fraction * along) > (
            path.tolerance * SLACK + np.linalg.norm(options.task_tolerances[:3])
        ):
            return f'the tip leaves its line after point {row}'
    return ''


def _on_grid(solution: PathSolution, order: int) -> np.ndarray:
    """Return (PARTS + 1, N - 1, n): position, velocity or acceleration (order 0, 1, 2) on a grid of each interval."""
    h = np.diff(solution.times)[:, None]
    q, v, a = solution.q, solution.velocities, solution.accelerations
    d = q[1:] - q[:-1] - h * (v[:-1] + 0.5 * h * a[:-1])
    e, f = h * (v[1:] - v[:-1] - h * a[:-1]), h * h * (a[1:] - a[:-1])
    coefficients = np.stack([
        q[:-1], v[:-1] * h, 0.5 * a[:-1] * h * h, 10.0 * d - 4.0 * e + 0.5 * f, -15.0 * d + 7.0 * e - f,
        6.0 * d - 3.0 * e + 0.5 * f,
    ])  # fmt: skip
    s = np.linspace(0.0, 1.0, PARTS + 1)
    powers = np.zeros((PARTS + 1, 6))
    for k in range(order, 6):
        powers[:, k] = np.prod(np.arange(k - order + 1.0, k + 1.0)) * s ** (k - order)
    return np.einsum('sk,kij->sij', powers, coefficients) / h**order
