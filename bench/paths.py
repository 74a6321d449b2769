"""scripts/bench --path: whole paths, beside the optimum over a closed form's branches, and the time they take."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from tqdm import tqdm

from bench.cases import bounds
from bench.path_judge import closed_form_branches, finer, judge_path
from bench.peers import make_environment
from ros_ik_pkg.ik import Arm, PathOptions, SolveOptions, load_arm, solve, solve_path

OPTIMUM_HEAD = ('arm', 'paths', 'poses', 'same count', 'fewer', 'more', 'longer by 1 %', 'reached less far')
SPEED_HEAD = ('arm', 'poses', 'whole [ms]', 'per pose [us]', 'greedy nearest [ms]')
FINER = (4, 16)  # how much finer the judge samples; the second if it disagrees, for it cuts corners at singularities
SEED = 5
COUNTS = (100, 1000, 10000)
RUNS = 3
AS_GIVEN = {'step': 10.0, 'angle_step': 3.0, 'deadline': 0.0}  # no samples between the poses
ARMS_OF_CLOSED_FORM = ('ur5', 'puma560')


def random_path(arm: Arm, random: np.random.Generator, count: int) -> np.ndarray:
    """Draw a line, an arc or a letter-like curve through a random pose, turning as it goes; (count, 4, 4)."""
    lower, upper = bounds(arm)
    start = arm.forward(random.uniform(np.maximum(lower, -np.pi), np.minimum(upper, np.pi)))
    s = np.linspace(0.0, 1.0, count)
    along = random.normal(size=3)
    along /= np.linalg.norm(along)
    across = np.cross(along, random.normal(size=3))
    across /= np.linalg.norm(across)
    size = random.uniform(0.1, 0.6)
    kind = random.integers(3)
    if kind == 0:
        moved = 1.5 * size * np.outer(s, along)
    elif kind == 1:
        angle = s * random.uniform(1.0, 6.0)
        moved = 0.5 * size * (np.outer(np.cos(angle) - 1.0, along) + np.outer(np.sin(angle), across))
    else:
        phases = random.uniform(0.0, 6.0, 2)
        waves = [np.sin(2.0 * np.pi * f * s + phase) - np.sin(phase) for f, phase in zip((1, 2), phases)]
        moved = 0.3 * size * sum(np.outer(wave, random.normal(size=3)) for wave in waves)
    turn = random.normal(size=3) * random.uniform(0.0, 1.5)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = [pin.exp3(turn * part) @ start[:3, :3] for part in s]
    poses[:, :3, 3] = start[:3, 3] + moved
    return poses


def optimum_rows(count: int, poses: int = 200) -> list[tuple[str, ...]]:
    """Compare `count` random paths for each arm with dynamic programming over all branches of EAIK."""
    python, faults = make_environment()
    if 'eaik' in faults:
        return [('EAIK', faults['eaik'])]
    rows = []
    for name in ARMS_OF_CLOSED_FORM:
        arm, random = load_arm(name), np.random.default_rng(SEED)
        same = fewer = more = longer = nearer = 0
        for _ in tqdm(range(count), desc=name, leave=False):
            path = random_path(arm, random, poses)
            ours = solve_path(arm, path, path=PathOptions(max_reconfigurations=100, **AS_GIVEN))
            reached = poses if ours.complete else round(ours.breaks[0].place)
            for times in FINER:
                fine = finer(path, times)
                branches, _ = closed_form_branches(python, 'eaik', arm, fine)
                fewest, least = judge_path(arm, fine, branches, PathOptions().tolerance, PathOptions().angle_tolerance)
                fewest = fewest[::times]  # of the poses given
                least = least[::times]
                known = fewest[reached - 1] if 0 < reached <= len(fewest) else None
                if len(fewest) == reached and known == len(ours.reconfigurations):
                    break
            nearer += int(reached < len(fewest))
            if reached == 0 or known is None:
                fewer += reached > len(fewest)
                same += reached == len(fewest)
                continue
            gap = len(ours.reconfigurations) - int(known)
            same, fewer, more = same + (gap == 0), fewer + (gap < 0), more + (gap > 0)
            longer += bool(known == 0 and ours.length > 1.01 * least[reached - 1])
        figures = count, poses, same, fewer, more, longer, nearer
        rows.append((name, *map(str, figures)))
    return rows


def speed_rows(robots: Sequence[str]) -> list[tuple[str, ...]]:
    """Time paths of several lengths, the median of RUNS by the time that the core was busy; beside them a greedy loop
    that solves pose after pose from the answer before it, in turns."""
    rows = []
    for name in robots:
        arm = load_arm(name)
        for count in COUNTS:
            random = np.random.default_rng(SEED)
            path = random_path(arm, random, count)
            while not solve_path(arm, path[:: max(1, count // 100)], path=PathOptions(**AS_GIVEN)).complete:
                path = random_path(arm, random, count)
            whole, greedy = [], []
            for _ in range(RUNS):
                began = time.thread_time()
                solve_path(arm, path, path=PathOptions(**AS_GIVEN))
                whole.append(time.thread_time() - began)
                began, q = time.thread_time(), arm.home
                for pose in path:
                    q = solve(arm, pose, q, SolveOptions(choice='nearest', deadline=0.0)).q
                greedy.append(time.thread_time() - began)
            middle = float(np.median(whole))
            rows.append((name, str(count), f'{1e3 * middle:.1f}', f'{1e6 * middle / count:.0f}',
                         f'{1e3 * float(np.median(greedy)):.1f}'))  # fmt: skip
    return rows
