"""Every answer checked: random arms, methods, options, seeds and targets; Pinocchio's kinematics is the judge."""

from __future__ import annotations

import gc
import math
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import islice

import numpy as np
import pinocchio as pin
from tqdm import tqdm

from bench.bare_arm import bare_arm
from bench.judge import Judge
from bench.problems import random_options, random_seeds, random_targets
from bench.random_arms import MADE_UP, random_urdf
from ros_ik_pkg.ik import Solution, SolveOptions, Status, load_arm, robot_names, solve, solve_batch, warm_up
from ros_ik_pkg.ik.solution import ROW_NAMES

GROUP = 1000  # solves of one arm with one set of options
SHOWN = 10  # wrong answers that are printed
SEED = 2026
ROUNDING = 1e-11  # m, rad; tolerance between two forms of the same computation
SHIPPED = 0.3  # share of the groups with an arm of config/robots
LATE = 1e-3  # s of CPU time beyond the deadline
REPEATS = 2  # of a late solve: its work is the same every time, the interruptions of a virtual machine are not
AT_ONCE = 2  # groups on threads; the solver lets others run
BATCHED = 10  # one group out of this many is also solved by solve_batch


@dataclass
class Group:
    """One arm, one set of options, many solves."""

    judge: Judge
    options: SolveOptions
    targets: np.ndarray
    seeds: np.ndarray
    references: np.ndarray


@dataclass
class Answers:
    """Results by row, as in BatchSolution, and the CPU time of each call [s]."""

    q: np.ndarray
    status: np.ndarray
    position_error: np.ndarray
    orientation_error: np.ndarray
    wished_position_error: np.ndarray
    wished_orientation_error: np.ndarray
    cpu_time: np.ndarray
    late_once: int  # solves that were late, but not when they were tried again

    @property
    def converged(self) -> np.ndarray:
        """(N,) bool."""
        return self.status == Status.CONVERGED


@dataclass
class Tally:
    """Counts over many groups."""

    solves: int = 0
    groups: int = 0
    wrong: int = 0
    latest: float = -math.inf  # s of CPU time; largest excess over the deadline
    late_once: int = 0  # late, but not when they were tried again
    statuses: Counter[str] = field(default_factory=Counter)
    arms: set[str] = field(default_factory=set)  # shipped ones by name, made up ones by number
    faults: list[str] = field(default_factory=list)  # the first few, with the data to reproduce them
    faulty: list[int] = field(default_factory=list)  # numbers of the groups with something wrong


def check_answers(count: int, seed: int = SEED) -> int:
    """Solve `count` times, print one closing line; return 1 if any answer is wrong."""
    began = time.monotonic()
    tally = tally_answers(count, seed, bar_text='checking')
    print(
        f'{tally.solves} solves, {tally.wrong} wrong, {tally.statuses["converged"]} converged, '
        f'{len(tally.arms)} arms, {time.monotonic() - began:.0f} s'
    )
    return 1 if tally.wrong else 0


def tally_answers(
    count: int, seed: int, bar_text: str, enough: Callable[[], bool] = lambda: False, only: int | None = None
) -> Tally:
    """Solve `count` times or until it is enough, or `only` the group of that number; the same seed makes the same."""
    tally = Tally()
    warm_up()
    gc.freeze()  # as the node does
    jobs = [(number, min(GROUP, count - first)) for number, first in enumerate(range(0, count, GROUP))]
    jobs = jobs if only is None else jobs[only : only + 1]
    total = sum(size for _, size in jobs)
    with tqdm(total=total, desc=bar_text, unit='solve') as bar, ThreadPoolExecutor(AT_ONCE) as pool:
        rest = iter(jobs)
        while not enough() and (some := list(islice(rest, 4 * AT_ONCE))):
            for (number, size), done in zip(some, pool.map(lambda job: _work(seed, *job), some)):
                _add(tally, *done, seed, number, bar)
                bar.update(size)
    return tally


def _work(seed: int, number: int, size: int) -> tuple[Group, Answers, list[tuple[int, str]]]:
    """Make a group, solve it and judge it."""
    group = make_group(np.random.default_rng([seed, number]), size)
    answers = solve_each(group)
    faults = find_faults(group, answers) + find_late(group, answers)
    if number % BATCHED == 0:
        batch = solve_batch(group.judge.arm, group.targets, group.seeds, group.options, group.references)
        faults += [(row, f'{fault} (batch)') for row, fault in find_faults(group, batch)]
    return group, answers, faults


def _add(
    tally: Tally, group: Group, answers: Answers, faults: list[tuple[int, str]], seed: int, number: int, bar: tqdm
) -> None:
    """Count a group and report its errors."""
    name = group.judge.arm.name
    tally.solves += len(answers.q)
    tally.wrong += len(faults)
    tally.groups += 1
    tally.arms.add(f'{name} {number}' if name == MADE_UP else name)
    tally.faulty += [number] if faults else []
    tally.late_once += answers.late_once
    tally.statuses.update(Status(status).label for status in answers.status)
    if group.options.deadline > 0.0:
        tally.latest = max(tally.latest, float(answers.cpu_time.max()) - group.options.deadline)
    for row, fault in faults[: SHOWN - len(tally.faults)]:
        tally.faults.append(f'seed {seed}, group {number}, row {row}, {name}: {fault}')
        bar.write(f'wrong: {tally.faults[-1]}, {group.options}')


def make_group(random: np.random.Generator, count: int) -> Group:
    """Make up `count` solves."""
    judge = _shipped_arm(random) if random.random() < SHIPPED else _made_up_arm(random)
    _ = judge.arm.packed  # made once for an arm, by the node when it loads one: no part of a solve
    seeds = random_seeds(judge.arm, random, count)
    targets = random_targets(judge, random, seeds)
    return Group(judge, random_options(random, judge.arm), targets, seeds, random_seeds(judge.arm, random, count))


def _shipped_arm(random: np.random.Generator) -> Judge:
    return Judge(bare_arm(str(random.choice(robot_names()))))


def _made_up_arm(random: np.random.Generator) -> Judge:
    text = random_urdf(random)
    return Judge(load_arm(text), pin.buildModelFromXML(text))


def solve_each(group: Group) -> Answers:
    """Solve row by row, as the node does, and take the thread's CPU time of each."""
    tried = [_solve_until_in_time(group, row) for row in range(len(group.targets))]
    solutions, seconds = [tries[0][0] for tries in tried], [tries[-1][1] for tries in tried]
    late_once = sum(_in_time(group, tries[-1][1]) for tries in tried if len(tries) > 1)
    names = ('status', 'position_error', 'orientation_error', 'wished_position_error', 'wished_orientation_error')
    figures = np.array([[getattr(s, name) for name in names] for s in solutions]).T
    return Answers(
        np.array([s.q for s in solutions]), figures[0].astype(int), *figures[1:], np.array(seconds), late_once
    )


def _solve_until_in_time(group: Group, row: int) -> list[tuple[Solution, float]]:
    """Return the solution and CPU time [s] of every attempt: one, or more if it was late."""
    tries = [_solve_timed(group, row)]
    while not _in_time(group, tries[-1][1]) and len(tries) <= REPEATS:
        tries.append(_solve_timed(group, row))
    return tries


def _solve_timed(group: Group, row: int) -> tuple[Solution, float]:
    """Return the solution and its CPU time [s]."""
    began = time.thread_time()
    solution = solve(group.judge.arm, group.targets[row], group.seeds[row], group.options, group.references[row])
    return solution, time.thread_time() - began


def _in_time(group: Group, seconds: float) -> bool:
    """Whether a CPU time [s] is no longer than the deadline and a little."""
    return not 0.0 < group.options.deadline < seconds - LATE


def find_late(group: Group, answers: Answers) -> list[tuple[int, str]]:
    """Return (row, excess [s]) for every solve that exceeded its deadline."""
    if group.options.deadline == 0.0:
        return []
    beyond = answers.cpu_time - group.options.deadline
    return [(int(row), f'{1e3 * beyond[row]:.1f} ms after the deadline') for row in np.flatnonzero(beyond > LATE)]


def find_faults(group: Group, answers: Answers) -> list[tuple[int, str]]:
    """Return (row, error) for every row with a wrong claim."""
    judge, options, q = group.judge, group.options, answers.q
    kept = np.array(options.task_weights) > 0.0
    axes = group.targets[:, :3, :3] if options.task_frame == 'tip' else np.broadcast_to(np.eye(3), (len(q), 3, 3))
    errors = np.hstack([np.einsum('kji,kj->ki', axes, half) for half in judge.errors(group.targets, q)])
    beyond = np.maximum(np.abs(errors) - options.task_tolerances, 0.0) * kept
    position, orientation = _norms(beyond)
    rows = options.wished_rows(judge.arm.n)  # of a solution they may be off, but their error must be that of its q
    wished = np.isin(ROW_NAMES, rows)
    wished_position, wished_orientation = _norms(beyond * wished if rows else np.full_like(beyond, np.nan))
    demanded_position, demanded_orientation = _norms(beyond * ~wished)
    # Far targets and many turns are rounded with the size of their numbers.
    rounding = ROUNDING * (1.0 + np.abs(q).max(axis=1) + np.abs(group.targets[:, :3, 3]).max(axis=1))
    close = (demanded_position <= options.position_tolerance + rounding) & (
        demanded_orientation <= options.orientation_tolerance + rounding
    )
    near = np.abs(q - group.references).max(axis=1) <= (options.max_joint_jump or np.inf)
    claims = {
        'converged, but not at the target': ~answers.converged | close,
        'converged, but jumps too far': ~answers.converged | near,
        'not a finite number': np.isfinite(q).all(axis=1) & np.isfinite(answers.position_error),
        'outside the limits': judge.inside(q, 0.0) | (not options.respect_limits),
        'failed without a reason': np.array([bool(Status(status).text) for status in answers.status]),
        'not the position error of its q': np.abs(answers.position_error - position) <= rounding + 1e-9 * position,
        'not the orientation error of its q': np.abs(answers.orientation_error - orientation) <= 1e-7 + rounding,
        'not the wished position error of its q': _same(
            answers.wished_position_error, wished_position, rounding + 1e-9 * position
        ),
        'not the wished orientation error of its q': _same(
            answers.wished_orientation_error, wished_orientation, 1e-7 + rounding
        ),
    }
    return [(int(row), fault) for fault, holds in claims.items() for row in np.flatnonzero(~holds)]


def _norms(errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the norms of the position and of the orientation rows (N, 6)."""
    return np.linalg.norm(errors[:, :3], axis=1), np.linalg.norm(errors[:, 3:], axis=1)


def _same(said: np.ndarray, found: np.ndarray, tolerance: np.ndarray) -> np.ndarray:
    """Return (N,) whether two errors agree, or neither is a number."""
    return (np.abs(said - found) <= tolerance) | (np.isnan(said) & np.isnan(found))
