"""Batches: one target after another, side by side in the lanes of a vector, and on two workers."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from bench.bare_arm import bare_arm
from bench.cases import make_case
from bench.judge import Judge
from ros_ik_pkg.ik import Arm, SolveOptions, solve_batch
from ros_ik_pkg.ik.search.search import HURRIED_ATTEMPTS

REPEATS = 7
POSES = 10000
BATCH_HEAD = [
    'arm', 'poses', 'solved', 'one by one us', 'side by side us', 'ratio', '1 worker us', '2 workers us', 'ratio',
    'poses a second',
]  # fmt: skip


def batch_rows(robots: Iterable[str], options: SolveOptions, count: int = POSES) -> list[list[str]]:
    """Return a row of BATCH_HEAD for each robot."""
    return [batch_row(bare_arm(robot), options, count) for robot in robots]


def batch_row(arm: Arm, options: SolveOptions, count: int = POSES) -> list[str]:
    """Solve reachable poses in three ways, in turns; return a row of BATCH_HEAD, the best of each.

    The first two figures are time that the core was busy, the next two are by the clock. The share that is solved is
    that side by side, judged by Pinocchio.
    """
    case, judge = make_case(arm, 'reachable', count), Judge(arm)
    one_by_one = replace(options, max_attempts=min(options.max_attempts, HURRIED_ATTEMPTS - 1))
    ways = {'one by one': (one_by_one, 1), 'side by side': (options, 1), 'two workers': (options, 2)}
    busy, taken = dict.fromkeys(ways, np.inf), dict.fromkeys(ways, np.inf)
    for _ in range(REPEATS):
        for way, (chosen, workers) in ways.items():
            began = time.process_time(), time.perf_counter()
            batch = solve_batch(arm, case.targets, case.seeds, chosen, workers=workers)
            busy[way] = min(busy[way], time.process_time() - began[0])
            taken[way] = min(taken[way], time.perf_counter() - began[1])
    solved = int(judge.solved(case.targets, batch.q).sum())
    scalar, lanes = (1e6 * busy[way] / count for way in ('one by one', 'side by side'))
    one, two = (1e6 * taken[way] / count for way in ('side by side', 'two workers'))
    return [
        arm.name, str(count), f'{solved} of {count}', f'{scalar:.2f}', f'{lanes:.2f}', f'{scalar / lanes:.2f}',
        f'{one:.2f}', f'{two:.2f}', f'{one / two:.2f}', f'{1e6 / two:.0f}',
    ]  # fmt: skip
