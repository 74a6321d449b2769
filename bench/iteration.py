"""How long one iteration takes: the slope between short and long descents through the compiled kernels."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence

import numpy as np
from tqdm import tqdm

from bench.cases import bounds
from ros_ik_pkg.ik import METHODS, Arm, SolveOptions, load_arm
from ros_ik_pkg.ik.attempt import descend
from ros_ik_pkg.ik.compiled import compiled
from ros_ik_pkg.ik.kinematics import walk
from ros_ik_pkg.ik.linalg import assign
from ros_ik_pkg.ik.records import Task, make_recorder, make_workspace, unpack_model
from ros_ik_pkg.ik.solve_range import tuning_of

SHORT, LONG = 2, 10  # steps of the two descents: what a solve takes
DESCENTS = 200
REPEATS = 60
NEVER = 1 << 60  # iterations without progress until a descent is given up
ITERATION_HEAD = ['arm', 'joints', 'method', 'one iteration us', 'forward kinematics alone us']


def iteration_rows(robots: Sequence[str]) -> list[list[str]]:
    """Measure every method on every arm; return rows of ITERATION_HEAD."""
    rows = []
    with tqdm(total=len(robots) * len(METHODS), desc='iterations', leave=False) as bar:
        for arm in map(load_arm, robots):
            random = np.random.default_rng(1)
            seeds, others = random.uniform(*bounds(arm), (2, DESCENTS, arm.n))
            targets = np.array([arm.forward(q) for q in others])
            forward = best_time(lambda arm=arm, q=seeds: walk_all(arm.packed, len(arm.prismatic), q))[0] / DESCENTS
            for method in METHODS:
                seconds = iteration_time(arm, method, targets, seeds)
                rows.append([arm.name, str(arm.n), method, f'{1e6 * seconds:.2f}', f'{1e6 * forward:.2f}'])
                bar.update()
    return rows


def iteration_time(arm: Arm, method: str, targets: np.ndarray, seeds: np.ndarray) -> float:
    """Return the seconds that one more step of a descent takes."""

    def run(steps: int) -> tuple[float, int]:
        options = SolveOptions(method=method, max_iterations=steps)
        return best_time(lambda: descend_all(arm.packed, len(arm.prismatic), options.numbers, targets, seeds))

    (short, few), (long, many) = run(SHORT), run(LONG)
    return (long - short) / (many - few)


def best_time(function: Callable[[], int]) -> tuple[float, int]:
    """Return the shortest of many times that a function kept its core busy [s], and what it returned."""
    result, times = function(), []
    for _ in range(REPEATS):
        began = time.thread_time_ns()
        result = function()
        times.append(time.thread_time_ns() - began)
    return 1e-9 * min(times), result


@compiled
def descend_all(model, joints, numbers, targets, seeds):
    """Descend once from each seed with tolerances that nothing meets; return the number of steps."""
    n, tunables = seeds.shape[1], len(numbers) - 6
    geometry, _ = unpack_model(model, joints, n)
    numbers = numbers.copy()
    numbers[4] = numbers[5] = -1.0  # position and orientation tolerance
    tuning, weights = tuning_of(numbers), numbers[tunables:]
    work, recorder = make_workspace(joints, n, 1), make_recorder(np.empty((0, 0)), n)
    steps = 0
    for k in range(len(seeds)):
        T = targets[k]
        R = (T[0, 0], T[0, 1], T[0, 2], T[1, 0], T[1, 1], T[1, 2], T[2, 0], T[2, 1], T[2, 2])
        task = Task(R, (T[0, 3], T[1, 3], T[2, 3]), weights)
        assign(work.q, seeds[k])
        steps += descend(geometry, task, tuning, NEVER, 0.5, math.inf, 0, work, recorder)[1]
    return steps


@compiled
def walk_all(model, joints, configurations):
    """Walk the chain once for each configuration; return how many."""
    geometry, _ = unpack_model(model, joints, configurations.shape[1])
    axes = np.empty((joints, 6))
    total = 0.0
    for k in range(len(configurations)):
        _, p = walk(geometry, configurations[k], axes)
        total += p[0]
    return len(configurations) if total < math.inf else 0
