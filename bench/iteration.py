"""Time of one iteration: the slope between short and long descents in compiled code."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence

import numpy as np
from tqdm import tqdm

from bench.cases import bounds
from ros_ik_pkg.ik import METHODS, Arm, SolveOptions, load_arm
from ros_ik_pkg.ik.kernel.compiled import compiled, kernel
from ros_ik_pkg.ik.kernel.data_layout import joints_size, make_joints, unpack_model
from ros_ik_pkg.ik.kinematics.forward import walk
from ros_ik_pkg.ik.search.entry import STEPS, WIDTH, solve_range
from ros_ik_pkg.ik.solver import NOTHING

SHORT, LONG = 2, 10  # steps of the two descents, typical of a solve
DESCENTS = 200
REPEATS = 60
ITERATION_HEAD = ['arm', 'joints', 'method', 'one iteration us', 'forward kinematics alone us']


def iteration_rows(robots: Sequence[str]) -> list[list[str]]:
    """Measure every method on every arm; return rows of ITERATION_HEAD."""
    rows = []
    with tqdm(total=len(robots) * len(METHODS), desc='iterations', leave=False) as bar:
        for arm in map(load_arm, robots):
            random = np.random.default_rng(1)
            seeds, others = random.uniform(*bounds(arm), (2, DESCENTS, arm.n))
            targets = np.array([arm.forward(q) for q in others])
            forward = best_time(lambda arm=arm, q=seeds: walk_all(arm.packed, q))[0] / DESCENTS
            for method in METHODS:
                seconds = iteration_time(arm, method, targets, seeds)
                rows.append([arm.name, str(arm.n), method, f'{1e6 * seconds:.2f}', f'{1e6 * forward:.2f}'])
                bar.update()
    return rows


def iteration_time(arm: Arm, method: str, targets: np.ndarray, seeds: np.ndarray) -> float:
    """Return the seconds that one more step of a descent takes."""
    rows, columns, out = targets.reshape(-1, 4), seeds.ravel(), np.empty((len(targets), arm.n + WIDTH))

    def descend(numbers: np.ndarray) -> int:
        solve_range(arm.packed, numbers, rows, columns, columns, out, NOTHING, NOTHING, NOTHING)
        return int(out[:, arm.n + STEPS].sum())

    def run(steps: int) -> tuple[float, int]:
        options = SolveOptions(
            method=method, max_iterations=steps, max_attempts=1, deadline=0.0,
            position_tolerance=1e-12, orientation_tolerance=1e-12,
        )  # fmt: skip
        return best_time(lambda: descend(options.numbers))

    (short, few), (long, many) = run(SHORT), run(LONG)
    return (long - short) / (many - few)


def best_time(function: Callable[[], int]) -> tuple[float, int]:
    """Return the shortest CPU time [s] of many calls of a function, and its result."""
    result, times = function(), []
    for _ in range(REPEATS):
        began = time.thread_time_ns()
        result = function()
        times.append(time.thread_time_ns() - began)
    return 1e-9 * min(times), result


@compiled
def walk_all(model, configurations):
    """Walk the chain once for each configuration (m, n); return how many."""
    return _walk_all(model, configurations, np.empty(joints_size(model)))


@kernel
def _walk_all(model, configurations, memory):
    """Implement walk_all; a kernel, because only kernels may hold views of an arm."""
    geometry, _, _ = unpack_model(model)
    joints = make_joints(model, memory)
    total = 0.0
    for k in range(len(configurations)):
        _, p = walk(geometry, configurations[k], joints)
        total += p[0]
    return len(configurations) if total < math.inf else 0
