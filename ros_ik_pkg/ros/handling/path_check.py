"""The final check of a motion before it is published, independent of the solver: tolerance, line, and every limit."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik import Arm, PathOptions, PathSolution, SolveOptions
from ros_ik_pkg.ik.contacts.contacts import Room
from ros_ik_pkg.ik.path.motion import motion_limits
from ros_ik_pkg.ik.path.waypoints import rotation_vectors, rotations_of
from ros_ik_pkg.ros.handling.final_check import contact_of, fault_of

PARTS = 10  # of each interval; limits are checked at their ends
PLACES = (2, 5, 8)  # parts at whose ends the tip is compared with its line
SLACK = 1.0 + 1e-6  # rounding
CHUNK = 2000  # intervals that are checked at once
SHORT = 1e-9  # m: between poses that are nearer, the tip only turns


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
    for first in range(0, len(solution.q) - 1, CHUNK):
        if fault := _fault_between(solution, slice(first, first + CHUNK), arm, options, path):
            return fault
    return ''


def _fault_between(
    solution: PathSolution, rows: slice, arm: Arm, options: SolveOptions, path: PathOptions
) -> str:
    """Return what is wrong between the points, where a joint trajectory controller follows quintic polynomials."""
    positions = _on_grid(solution, rows, 0)
    q, v, a = (grid.reshape(-1, arm.n) for grid in (positions, *(_on_grid(solution, rows, order) for order in (1, 2))))
    if not (np.isfinite(q).all() and np.isfinite(v).all() and np.isfinite(a).all()):
        return 'a point between two is not finite'
    if options.respect_limits and ((q < arm.lower) | (q > arm.upper)).any():
        return 'a joint leaves its limits between two points'
    velocity, acceleration = motion_limits(arm, path)
    if (np.abs(v) > velocity * SLACK).any():
        return 'a joint exceeds its velocity limit'
    if (np.abs(a) > acceleration * SLACK).any():
        return 'a joint exceeds its acceleration limit'
    numbers = np.arange(rows.start, rows.start + positions.shape[1])
    on_path = ~np.isin(numbers, solution.off_path)
    start, end = solution.base_from_tip[numbers[on_path]], solution.base_from_tip[numbers[on_path] + 1]
    for place in PLACES:
        tips = np.array([arm.forward(row) for row in positions[place][on_path]]).reshape(-1, 4, 4)
        away, turned = _errors_from_line(tips, start, end, options)
        wrong = (away > path.tolerance * SLACK) | (turned > path.angle_tolerance * SLACK)
        if wrong.any():
            row = int(np.argmax(wrong))
            return (f'the tip leaves its line after point {numbers[on_path][row]}, by {away[row]:.3g} m and '
                    f'{turned[row]:.3g} rad')
    return ''


def _errors_from_line(
    tips: np.ndarray, start: np.ndarray, end: np.ndarray, options: SolveOptions
) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance of each tip (N, 4, 4) from the line between two poses, (N,) each [m, rad].

    It is measured to the nearest place on the line, in the rows of the task and beyond their tolerances.
    """
    weights, tolerances = np.reshape(options.task_weights, (2, 1, 3)), np.reshape(options.task_tolerances, (2, 1, 3))

    def rows_of(vectors: np.ndarray, pose: np.ndarray) -> np.ndarray:
        in_task = np.einsum('kji,ekj->eki', pose[:, :3, :3], vectors) if options.task_frame == 'tip' else vectors
        return in_task * (weights > 0.0)

    along, turn = (end - start)[:, :3, 3], rotation_vectors(start[:, :3, :3], end[:, :3, :3])
    gone = np.stack([(tips - start)[:, :3, 3], rotation_vectors(start[:, :3, :3], tips[:, :3, :3])])
    whole, gone = rows_of(np.stack([along, turn]), start), rows_of(gone, start)
    moves = np.linalg.norm(whole[0], axis=1) > SHORT
    whole, gone = (np.where(moves[:, None], position, rotation) for position, rotation in (whole, gone))
    square = (whole * whole).sum(axis=1)
    fraction = np.divide((whole * gone).sum(axis=1), square, out=np.zeros_like(square), where=square > 0.0)
    fraction = np.clip(fraction, 0.0, 1.0)[:, None]
    wanted = start.copy()
    wanted[:, :3, :3] = rotations_of(fraction * turn) @ start[:, :3, :3]
    away = start[:, :3, 3] + fraction * along - tips[:, :3, 3]
    errors = rows_of(np.stack([away, rotation_vectors(tips[:, :3, :3], wanted[:, :3, :3])]), wanted)
    position, orientation = np.linalg.norm(np.maximum(np.abs(errors) - tolerances, 0.0), axis=2)
    return position, orientation


def _on_grid(solution: PathSolution, rows: slice, order: int) -> np.ndarray:
    """Return (PARTS + 1, N, n): position, velocity or acceleration (order 0, 1, 2) on a grid of N intervals."""
    h = np.diff(solution.times)[rows, None]
    q, v, a = (array[rows.start : rows.stop + 1] for array in (solution.q, solution.velocities, solution.accelerations))
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
