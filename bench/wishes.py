"""Full poses for five joints: how near the orientation comes, judged by SciPy's SLSQP, and the time."""

from __future__ import annotations

import time

import numpy as np
import pinocchio as pin
from scipy.optimize import minimize
from tqdm import tqdm

from bench.cases import random_joints, random_rotations
from bench.judge import Judge
from ros_ik_pkg.ik import Arm, SolveOptions, load_arm, solve

STARTS = 6  # of SLSQP for each pose
HELD = 1e-5  # m
AS_NEAR = 1.01
WISH_TEXT = (
    'Positions that the arm reaches, each with a random orientation, from the home position; judged by Pinocchio, and '
    f'by the least angle that SLSQP finds from {STARTS} starts. Time that the core was busy, in turns with reachable '
    'poses of a ur5.'
)
WISH_HEAD = [
    'arm', 'poses', 'position within 1e-5 m', 'orientation within 1 % of SciPy', 'nearer than SciPy', 'median us',
    'mean us', 'ratio to ur5',
]  # fmt: skip


def wish_row(count: int) -> tuple[list[str], bool]:
    """Return the row under WISH_HEAD, and whether a solution misses the position or says another error than it has."""
    arm, other, random = load_arm('so101'), load_arm('ur5'), np.random.default_rng(0)
    targets = Judge(arm).forward(random_joints(arm, random, count))
    targets[:, :3, :3] = random_rotations(random, count)
    reachable = Judge(other).forward(random_joints(other, random, count))
    seeds, options = random_joints(other, random, count), SolveOptions(deadline=0.0)
    solve(arm, targets[0], options=options)
    times, solutions = np.empty((2, count)), []
    for k in range(count):  # in turns, so that both meet the same load of the machine
        began = time.thread_time_ns()
        solutions.append(solve(arm, targets[k], options=options))
        between = time.thread_time_ns()
        solve(other, reachable[k], seeds[k], options)
        times[:, k] = 1e-3 * (between - began), 1e-3 * (time.thread_time_ns() - between)
    errors = np.array([_errors(arm, s.q, target) for s, target in zip(solutions, targets)]).reshape(count, 2, 3)
    position, angle = np.linalg.norm(errors, axis=2).T
    said = np.array([s.wished_orientation_error for s in solutions])
    converged = np.array([s.converged for s in solutions])
    held = converged & (position <= HELD)
    best = np.array([_best_of_scipy(arm, target, random) for target in tqdm(targets, disable=None)])
    near, nearer = held & (angle <= AS_NEAR * best), held & (AS_NEAR * angle < best)
    return [
        'so101', str(count), str(held.sum()), str(near.sum()), str(nearer.sum()), f'{np.median(times[0]):.1f}',
        f'{times[0].mean():.1f}', f'{np.median(times[0]) / np.median(times[1]):.1f}',
    ], bool(np.any(converged & ~held) or np.any(np.abs(said - angle) > 1e-6))  # fmt: skip


def _errors(arm: Arm, q: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the twist error (6,) in base axes by Pinocchio [m, rad]."""
    data, whole = arm.model.createData(), np.zeros(arm.model.nq)
    whole[: arm.n] = q
    pin.framesForwardKinematics(arm.model, data, whole)
    tip = data.oMf[arm.model.getFrameId(arm.tip_frame)]
    return np.hstack([target[:3, 3] - tip.translation, pin.log3(target[:3, :3] @ tip.rotation.T)])


def _best_of_scipy(arm: Arm, target: np.ndarray, random: np.random.Generator) -> float:
    """Return the least angle that SLSQP finds where the position holds [rad]."""
    best = np.inf
    for q in random_joints(arm, random, STARTS):
        found = minimize(
            lambda q: np.sum(_errors(arm, q, target)[3:] ** 2), q, method='SLSQP',
            jac=lambda q: -2.0 * arm.jacobian(q)[3:].T @ _errors(arm, q, target)[3:],
            bounds=list(zip(arm.lower, arm.upper)),
            constraints={
                'type': 'eq', 'fun': lambda q: _errors(arm, q, target)[:3], 'jac': lambda q: -arm.jacobian(q)[:3],
            },
            options={'maxiter': 100, 'ftol': 1e-10},
        ).x  # fmt: skip
        error = _errors(arm, found, target)
        if np.linalg.norm(error[:3]) <= HELD:
            best = min(best, float(np.linalg.norm(error[3:])))
    return best
