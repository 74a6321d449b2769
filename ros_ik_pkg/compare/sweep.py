"""Sweep: every method on many regular and singular targets, as a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ros_ik_pkg.compare.runs import single_descent
from ros_ik_pkg.compare.singular import bounds, regular_configuration, singular_configuration
from ros_ik_pkg.compare.table import align
from ros_ik_pkg.ik import Arm, Solution, SolveOptions, Status, solve

NEAR = 0.5  # rad or m; largest distance of a seed from a solution, in every joint
RANDOM_SEED = 2005


@dataclass(frozen=True)
class Sweep:
    """Solutions by method, for regular targets and for targets with a singular solution."""

    arm: Arm
    regular: dict[str, list[Solution]]
    singular: dict[str, list[Solution]]


def run_sweep(
    arm: Arm, count: int, methods: Sequence[str], options: SolveOptions, progress: Callable[[int], object]
) -> Sweep:
    """Solve `count` regular and `count` singular targets with every method; the targets are the same in every sweep.

    `progress` is called with 1 after each target. Every run is a single descent, as in `compare_methods`.
    """
    random = np.random.default_rng(RANDOM_SEED)
    single = {method: single_descent(options, method) for method in methods}
    results = []
    for configuration in (regular_configuration, singular_configuration):
        solutions: dict[str, list[Solution]] = {method: [] for method in methods}
        for _ in range(count):
            goal = configuration(arm, random)
            target, seed = arm.forward(goal), _seed_near(arm, goal, random)
            for method in methods:
                solutions[method].append(solve(arm, target, seed, single[method]))
            progress(1)
        results.append(solutions)
    return Sweep(arm, *results)


def _seed_near(arm: Arm, goal: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return a seed (n,) near the goal, within the limits."""
    return np.clip(goal + random.uniform(-NEAR, NEAR, arm.n), *bounds(arm))


def sweep_table(sweep: Sweep) -> str:
    """Return the table: one row per figure, one column per method."""
    rows = [
        ('', *sweep.regular),
        _row('one iteration [µs]', sweep.regular, _cost),
        _row('regular targets: solved', sweep.regular, _solved),
        _row('  iterations, median', sweep.regular, lambda done: _iterations(done, 50)),
        _row('  iterations, p90', sweep.regular, lambda done: _iterations(done, 90)),
        _row('  residual, median [m]', sweep.regular, _residual),
        _row('singular targets: solved', sweep.singular, _solved),
        _row('  iterations, median', sweep.singular, lambda done: _iterations(done, 50)),
        _row('  iterations, p90', sweep.singular, lambda done: _iterations(done, 90)),
        _row('  residual, median [m]', sweep.singular, _residual),
        _row('  most frequent failure', sweep.singular, _failure),
    ]
    return '\n'.join(align(rows))


def _row(label: str, solutions: dict[str, list[Solution]], figure: Callable[[list[Solution]], str]) -> tuple[str, ...]:
    return label, *(figure(done) for done in solutions.values())


def _cost(done: list[Solution]) -> str:
    """Return the median time per iteration [µs] over the targets."""
    return f'{1e6 * np.median([s.solve_time / max(s.iterations, 1) for s in done]):.1f}'


def _solved(done: list[Solution]) -> str:
    return f'{100.0 * np.mean([s.converged for s in done]):.0f} %'


def _iterations(done: list[Solution], percent: float) -> str:
    """Return a percentile over the solved targets, or a dash if there are none."""
    steps = [s.iterations for s in done if s.converged]
    return f'{np.percentile(steps, percent):.0f}' if steps else '-'


def _residual(done: list[Solution]) -> str:
    return f'{np.median([s.position_error for s in done]):.0e}'


def _failure(done: list[Solution]) -> str:
    """Return the most frequent status of the unsolved targets, or a dash if there are none."""
    failures = [s.status for s in done if not s.converged]
    return Status(max(set(failures), key=failures.count)).label if failures else '-'
