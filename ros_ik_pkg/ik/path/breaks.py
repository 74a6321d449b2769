"""Where and why a path breaks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ros_ik_pkg.ik.path.joint_path import JointPath
from ros_ik_pkg.ik.path.path_solution import BreakReason, PathBreak
from ros_ik_pkg.ik.path.problem import TURN, Problem
from ros_ik_pkg.ik.path.routing import first_contact
from ros_ik_pkg.ik.solver import solve
from ros_ik_pkg.ik.text import list_names

NEARLY_SINGULAR = 0.02  # smallest singular value of the Jacobian
FAR = 1.0  # rad or m: a longer step of a joint leads to another branch


def find_break(problem: Problem, path: JointPath) -> PathBreak:
    """Return where and why an incomplete path breaks, which is before sample `path.reached`."""
    k = path.reached
    place = float(problem.samples.place[k])
    pose = problem.samples.poses[k]
    where = name_place(place)
    if path.late:
        text = f'the deadline of {problem.path.deadline:g} s came before {where}'
        return PathBreak(place, BreakReason.DEADLINE, text)
    free = replace(problem.options, respect_limits=False, deadline=0.0, max_joint_jump=0.0, null_space='none')
    limited = replace(free, respect_limits=problem.options.respect_limits)
    seed = path.q[-1] if len(path.q) else (problem.seed if len(problem.seed) else problem.arm.home)
    whole = solve(problem.arm, pose, seed, limited)
    if not whole.converged:
        outside = solve(problem.arm, pose, seed, free)
        if not outside.converged:
            return PathBreak(place, BreakReason.REACH,
                             f'{where} is out of reach: {whole.position_error:.3g} m and '
                             f'{whole.orientation_error:.3g} rad are left')
        return PathBreak(place, BreakReason.LIMIT,
                         f'{where} cannot be reached within the limits{_beyond(problem, outside.q)}')
    if path.why:
        return PathBreak(place, path.reason, path.why.format(where=where))
    if not len(path.q):
        return PathBreak(place, BreakReason.CONTACT, f'every solution of {where} is in contact')
    ahead = solve(problem.arm, pose, seed, replace(free, max_attempts=1))
    singular = float(np.linalg.svd(problem.arm.jacobian(seed), compute_uv=False)[-1])
    turns = np.round((ahead.q - seed) / TURN) * (problem.arm.wraps != 0)
    q = ahead.q - TURN * turns
    step = np.abs(q - seed)
    if ahead.converged and step.max() <= FAR:
        lower, upper = problem.limits
        if np.any((q < lower) | (q > upper)):
            return PathBreak(place, BreakReason.LIMIT, f'a joint comes to its limit before {where}'
                             f'{_beyond(problem, q)}')
        fast = step > problem.most_steps[k - 1]
        if fast.any():
            names = list_names(np.array(problem.arm.joint_names)[fast])
            return PathBreak(place, BreakReason.VELOCITY, f'{names} would exceed the velocity limit before {where}')
        if first_contact(problem, np.stack([seed, q])) is not None:
            return PathBreak(place, BreakReason.CONTACT, f'the arm is in contact before {where}')
    if singular < NEARLY_SINGULAR:
        return PathBreak(place, BreakReason.SINGULARITY,
                         f'the arm is singular before {where}: the smallest singular value is {singular:.2g}')
    return PathBreak(place, BreakReason.BRANCH, f'the branch ends before {where}; another one would go on')


def name_place(place: float) -> str:
    """Return 'pose 3' or 'the way from pose 3 to 4'."""
    return f'pose {place:.0f}' if place == int(place) else f'the way from pose {int(place)} to {int(place) + 1}'


def _beyond(problem: Problem, q: np.ndarray) -> str:
    """Return a phrase that names the joints outside their limits, or nothing."""
    outside = (q < problem.arm.lower) | (q > problem.arm.upper)
    return f': {list_names(np.array(problem.arm.joint_names)[outside])} beyond it' if outside.any() else ''
