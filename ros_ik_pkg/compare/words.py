"""Describe a comparison in one sentence."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ros_ik_pkg.compare.runs import MethodRun
from ros_ik_pkg.ik import Status

SINGULAR = 1e-2  # a singular value below this explains a failure
NEGLIGIBLE = 5e-7  # m; smaller distances are not mentioned
MOST_NAMED = 2  # joints at their limits; more are counted, not named


def describe(runs: Sequence[MethodRun]) -> str:
    """Return a sentence: how methods failed, then which ones converged, fastest first."""
    failed = [describe_run(run) for run in runs if run.status is not Status.CONVERGED]
    converged = sorted((run for run in runs if run.status is Status.CONVERGED), key=lambda run: run.iterations)
    if converged:
        failed.append(f'{_and([f"{run.method} in {run.iterations}" for run in converged])} converged')
    return '; '.join(failed)


def describe_run(run: MethodRun) -> str:
    """Return how one method ended, such as 'pinv diverged at iteration 7: smallest singular value 0.0002'."""
    texts = {
        Status.CONVERGED: f'converged in {run.iterations} iterations',
        Status.MAX_ITERATIONS: f'ran out of its {run.iterations} iterations {_off(run)}',
        Status.STALLED: f'stalled {_when(run)}, {_off(run)}{_limits(run, ", ")}',
        Status.OSCILLATING: f'oscillates {_off(run)}{_limits(run, ", ")}',
        Status.DIVERGED: f'diverged {_when(run)}{_why(run)}',
        Status.NOT_FINITE: f'found no finite step {_when(run)}{_why(run)}',
    }
    return f'{run.method} {texts.get(run.status, run.status.text)}'


def _when(run: MethodRun) -> str:
    return f'at iteration {run.iterations}' if run.iterations else 'at its first step'


def _off(run: MethodRun) -> str:
    """Return the distance from the target, or the angle if the distance is negligible."""
    if run.position_error > NEGLIGIBLE:
        return f'{length(run.position_error)} from the target'
    return f'{angle(run.orientation_error)} from the target'


def _why(run: MethodRun) -> str:
    """Return why a step was too long: a nearly singular Jacobian, or joints at limits, which remove its columns.

    If neither applies, return the distance from the target.
    """
    if run.sigma_min < SINGULAR:
        return f': smallest singular value {run.sigma_min:.1g}{_limits(run, ", ")}'
    return _limits(run, ': ') or f', {_off(run)}'


def _limits(run: MethodRun, before: str) -> str:
    """Return the names of the joints at their limits, their number if there are many, or an empty text."""
    joints = run.joints_at_limits
    if not joints:
        return ''
    if len(joints) > MOST_NAMED:
        return f'{before}{len(joints)} joints at their limits'
    return f'{before}{_and(joints)} at {"its limit" if len(joints) == 1 else "their limits"}'


def length(metres: float) -> str:
    """Return a length in m, mm or µm."""
    for factor, unit in ((1.0, 'm'), (1e3, 'mm')):
        if metres * factor >= 0.995:
            return f'{metres * factor:.3g} {unit}'
    return f'{metres * 1e6:.3g} µm'


def angle(radians: float) -> str:
    """Return an angle in degrees, or in mrad if it is small."""
    degrees = math.degrees(radians)
    return f'{degrees:.3g}°' if degrees >= 0.1 else f'{radians * 1e3:.2g} mrad'


def _and(items: Sequence[str]) -> str:
    """Return the items joined by commas and a final 'and'."""
    return items[0] if len(items) == 1 else f'{", ".join(items[:-1])} and {items[-1]}'
