"""Run several solvers on the same poses, in turns, and judge every answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from bench.cases import Case
from bench.judge import ROUNDING, Judge
from bench.process import WorkerError, WorkerProcess
from ros_ik_pkg.ik import SolveOptions, solve

CHUNK = 50  # poses that one solver gets before the next one's turn
WARM_UP = 20  # poses solved before any is timed
JUMP = 0.5  # rad or m: a joint that moves further in one step of a path has jumped
NEAREST = SolveOptions(choice='nearest', deadline=0.0)


@dataclass
class Entry:
    """One solver in its process. `fault` says why it was excluded."""

    name: str
    process: WorkerProcess
    solver: str
    fault: str = ''


@dataclass
class Run:
    """Results of one solver for one case: N rows each; q is NaN if there is no solution."""

    entry: Entry
    arm: str
    case: Case
    q: np.ndarray = field(repr=False)
    seconds: np.ndarray = field(repr=False)
    iterations: np.ndarray = field(repr=False)
    attempts: np.ndarray = field(repr=False)
    solved: np.ndarray = field(repr=False)
    error: str = ''
    jumps: int = 0
    forced_jumps: int = 0

    @property
    def answered(self) -> np.ndarray:
        """(N,) whether the solver claimed an answer."""
        return np.isfinite(self.q).all(axis=1)


def check_models(judge: Judge, entries: list[Entry]) -> None:
    """Compare each library's forward kinematics with Pinocchio's, and record a fault if they differ."""
    lower, upper = np.clip(judge.arm.lower, -3.0, 3.0), np.clip(judge.arm.upper, -3.0, 3.0)
    q = np.random.default_rng(3).uniform(lower, upper, (10, judge.arm.n))
    expected = judge.forward(q)
    for entry in entries:
        try:
            gap = np.abs(entry.process.forward(entry.solver, q) - expected).max()
        except WorkerError as problem:
            entry.fault = str(problem)
        else:
            entry.fault = '' if gap <= ROUNDING else f'its forward kinematics differs by {gap:.1e}'


def run_case(judge: Judge, case: Case, entries: list[Entry], progress: Callable[[int], object]) -> list[Run]:
    """Solve a case with every entry, alternating every CHUNK poses; `progress` receives the number of solved poses."""
    warm = case.path is not None
    rows: dict[str, list[np.ndarray]] = {entry.name: [] for entry in entries}
    errors = dict.fromkeys(rows, '')
    seeds = {entry.name: case.seeds[:1] for entry in entries}
    for entry in entries:
        _solve(entry, case.targets[:WARM_UP], case.seeds[:WARM_UP], warm)
    for number, first in enumerate(range(0, len(case), CHUNK)):
        part = slice(first, min(first + CHUNK, len(case)))
        for entry in entries[number % len(entries) :] + entries[: number % len(entries)]:
            begin = seeds[entry.name] if warm else case.seeds[part]
            done, error = _solve(entry, case.targets[part], begin, warm)
            rows[entry.name].append(done)
            errors[entry.name] = errors[entry.name] or error
            answers = done[np.isfinite(done[:, 0]), : judge.arm.n]
            seeds[entry.name] = answers[-1:] if len(answers) else seeds[entry.name]
            progress(len(done))
    return [_judge(judge, case, entry, np.concatenate(rows[entry.name]), errors[entry.name]) for entry in entries]


def _solve(entry: Entry, targets: np.ndarray, seeds: np.ndarray, warm: bool) -> tuple[np.ndarray, str]:
    """Solve one chunk; a process that fails leaves rows of NaN and a fault."""
    if not entry.fault:
        try:
            return entry.process.solve(entry.solver, targets, seeds, warm)
        except WorkerError as problem:
            entry.fault = str(problem)
    return np.full((len(targets), seeds.shape[1] + 3), np.nan), entry.fault


def _judge(judge: Judge, case: Case, entry: Entry, rows: np.ndarray, error: str) -> Run:
    n = judge.arm.n
    run = Run(entry, judge.arm.name, case, rows[:, :n], *rows[:, n:].T, judge.solved(case.targets, rows[:, :n]), error)
    if case.path is not None:
        run.jumps, run.forced_jumps = count_jumps(judge, case, run.q)
    return run


def count_jumps(judge: Judge, case: Case, q: np.ndarray) -> tuple[int, int]:
    """Count the steps with a joint motion above JUMP, and those of them that the path forces.

    A jump is forced if the path's own configuration is also that far away, and no solution within JUMP is found.
    """
    steps = np.abs(np.diff(q, axis=0)).max(axis=1)
    jumps = np.flatnonzero(steps > JUMP)
    forced = 0
    for k in jumps:
        path_is_far = np.abs(case.path[k + 1] - q[k]).max() > JUMP
        forced += bool(path_is_far and solve(judge.arm, case.targets[k + 1], q[k], NEAREST).joint_distance > JUMP)
    return len(jumps), forced
