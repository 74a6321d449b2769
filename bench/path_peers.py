"""Whole paths beside other ways: pose after pose from the previous solution, and dynamic programming over ssik."""

from __future__ import annotations

import tempfile
import time
from contextlib import ExitStack, closing
from pathlib import Path

import numpy as np
from tqdm import tqdm

from bench.bare_arm import bare_arm
from bench.model import make_model
from bench.path_judge import closed_form_branches, judge_path
from bench.paths import AS_GIVEN, SEED, random_path
from bench.peers import make_environment
from bench.process import WorkerError, WorkerProcess
from ros_ik_pkg.ik import Arm, PathOptions, SolveOptions, solve_path

PEERS_HEAD = ('arm', 'solver', 'paths', 'poses missed', 'reconfigurations', 'largest step [rad]', 'per path [ms]')
FOLLOWERS = {'ours': {'choice': 'nearest'}, 'rtb': {}, 'trac_ik': {}, 'ssik': {}}
CHOSEN = {'ours': SolveOptions().method}  # of several settings of a library; else the first one
JUMP = 0.3  # rad between two poses: another branch
OPTIONS = PathOptions(max_reconfigurations=100, **AS_GIVEN)


def peer_rows(robots: tuple[str, ...], count: int, poses: int = 500) -> tuple[list[tuple[str, ...]], list[str]]:
    """Return rows for each arm and each way to follow `count` random paths, and why some are missing."""
    python, faults = make_environment()
    notes, rows = [f'{library}: {reason}' for library, reason in faults.items()], []
    for name in robots:
        arm = bare_arm(name)
        paths = followable_paths(arm, count, poses)
        ours, seconds = [], []
        for path in tqdm(paths, desc=f'{name} solve_path', leave=False):
            began = time.thread_time()
            ours.append(solve_path(arm, path, arm.home, path=OPTIONS))
            seconds.append(time.thread_time() - began)
        jumps = sum(len(solution.reconfigurations) for solution in ours)
        rows.append(row_of(name, 'solve_path', [solution.q for solution in ours], seconds, jumps))
        with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
            model = make_model(arm, name, Path(folder))
            for library, options in FOLLOWERS.items():
                try:
                    process = stack.enter_context(closing(
                        WorkerProcess(library) if library == 'ours' else WorkerProcess(library, python)))  # fmt: skip
                    solvers = process.load(model, options)[0]
                    solver = CHOSEN.get(library, solvers[0])
                    found = [process.solve(solver, path, np.tile(arm.home, (poses, 1)), True)[0] for path in paths]
                except WorkerError as error:
                    notes.append(f'{name}, {library}: {error}')
                    continue
                title = 'solve, nearest' if library == 'ours' else solver
                rows.append(row_of(name, title, [row[:, : arm.n] for row in found],
                                   [len(row) * np.median(row[:, arm.n]) for row in found]))  # fmt: skip
        rows.append(dynamic_programming_row(name, arm, python, paths))
    return rows, notes


def followable_paths(arm: Arm, count: int, poses: int) -> list[np.ndarray]:
    """Draw random paths that reconfigurations lead along."""
    random, paths = np.random.default_rng(SEED), []
    while len(paths) < count:
        path = random_path(arm, random, poses)
        if solve_path(arm, path[::5], path=OPTIONS).complete and solve_path(arm, path, path=OPTIONS).complete:
            paths.append(path)
    return paths


def row_of(
    name: str, title: str, motions: list[np.ndarray], seconds: list[float], jumps: int | None = None
) -> tuple[str, ...]:
    """Return the figures of one way to follow the paths; a missed pose is skipped. `jumps`: if they are known."""
    missed = sum(int(np.isnan(q[:, 0]).sum()) for q in motions)
    steps = [np.abs(np.diff(q[~np.isnan(q[:, 0])], axis=0)).max(axis=1, initial=0.0) for q in motions]
    if jumps is None:
        jumps = sum(int((step > JUMP).sum()) for step in steps)
    largest = max(float(step.max(initial=0.0)) for step in steps)
    counts = str(len(motions)), str(missed), str(jumps)
    return name, title, *counts, f'{largest:.2f}', f'{1e3 * float(np.median(seconds)):.1f}'


def dynamic_programming_row(name: str, arm: Arm, python: str, paths: list[np.ndarray]) -> tuple[str, ...]:
    """Return the figures of dynamic programming in NumPy over all that ssik finds; poses beyond its end are missed."""
    missed, jumps, seconds, allowed = 0, 0, [], PathOptions()
    for path in tqdm(paths, desc=f'{name} ssik', leave=False):
        branches, elapsed = closed_form_branches(python, 'ssik', arm, path)
        began = time.thread_time()
        fewest, _ = judge_path(arm, path, branches, allowed.tolerance, allowed.angle_tolerance)
        seconds.append(elapsed + time.thread_time() - began)
        missed += len(path) - len(fewest)
        jumps += int(fewest[-1]) if len(fewest) else 0
    counts = str(len(paths)), str(missed), str(jumps)
    return name, 'ssik + DP in NumPy', *counts, '', f'{1e3 * float(np.median(seconds)):.1f}'
