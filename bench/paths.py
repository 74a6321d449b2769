"""scripts/bench --path: whole paths, beside the optimum over a closed form's branches, and the time they take."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation
from tqdm import tqdm

from bench.bare_arm import bare_arm
from bench.cases import bounds
from bench.path_judge import closed_form_branches, finer, judge_path
from bench.peers import make_environment
from ros_ik_pkg.ik import Arm, PathOptions, SolveOptions, solve, solve_path

OPTIMUM_HEAD = ('arm', 'beside', 'paths', 'poses', 'same count', 'fewer', 'more', 'longer by 1 %', 'reached further',
                'reached less far', 'their time')  # fmt: skip
LONG_HEAD = ('arm', 'poses', 'samples', 'reconfigurations', 'at poses', 'joints travel [rad]', 'whole [ms]')
SPEED_HEAD = ('arm', 'poses', 'whole [ms]', 'per pose [us]', 'greedy nearest [ms]')
# What the judge takes solutions from: EAIK has all of a six-joint arm, ssik samples those of a redundant one.
JUDGED_BY = (('ur5', 'eaik'), ('puma560', 'eaik'), ('panda', 'ssik'), ('iiwa14', 'ssik'), ('panda', 'ssik, denser'),
             ('iiwa14', 'ssik, denser'))  # fmt: skip
# How much finer than the path the judge samples, which cuts corners at singularities: the next if it disagrees.
FINER = {'eaik': (4, 16), 'ssik': (1,), 'ssik, denser': (1,)}
# Shares of the paths and of their poses that are asked for.
SHARES = {'eaik': (1.0, 1.0), 'ssik': (0.5, 1.0), 'ssik, denser': (0.5, 0.4)}
SEED = 5
COUNTS = (100, 1000, 10000)
RUNS = 3
# Places and quaternions (x, y, z, w) of a path round a Panda, the shape of the demo of IKLink (arXiv 2402.16154).
LONG_PATH = (
    (-0.62, -0.31, 0.54, 0.58, -0.38, 0.39, 0.60), (-0.42, 0.00, 0.55, 0.85, -0.10, 0.20, 0.48),
    (-0.21, 0.27, 0.66, 0.82, 0.31, 0.16, 0.46), (-0.05, 0.18, 0.94, 0.11, 0.68, 0.35, 0.63),
    (0.12, -0.11, 1.07, -0.38, 0.73, -0.53, 0.22), (0.40, -0.16, 0.91, -0.25, 0.49, -0.73, -0.41),
    (0.50, -0.17, 0.61, 0.30, 0.80, -0.49, -0.19), (0.34, -0.48, 0.60, 0.66, 0.56, -0.24, -0.43),
)  # fmt: skip
LONG_COUNT = 767
AS_GIVEN = {'step': 10.0, 'angle_step': 3.0, 'deadline': 0.0}  # no samples between the poses


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


def long_path() -> np.ndarray:
    """Return the path through LONG_PATH, (LONG_COUNT, 4, 4); no branch of a Panda leads along all of it."""
    rows = CubicSpline(np.arange(len(LONG_PATH)), LONG_PATH)(np.linspace(0.0, len(LONG_PATH) - 1.0, LONG_COUNT))
    poses = np.tile(np.eye(4), (LONG_COUNT, 1, 1))
    poses[:, :3, :3] = Rotation.from_quat(rows[:, 3:]).as_matrix()
    poses[:, :3, 3] = rows[:, :3]
    return poses


def long_rows() -> list[tuple[str, ...]]:
    """Count the reconfigurations along long_path by default and with more samples, which find fewer if there are any
    fewer; time by the time that the core was busy, the median of RUNS."""
    arm, poses, rows = bare_arm('panda'), long_path(), []
    for samples in (PathOptions().samples, 256, 1000):
        path, seconds = PathOptions(max_reconfigurations=100, samples=samples, **AS_GIVEN), []
        for _ in range(RUNS):
            began = time.thread_time()
            solution = solve_path(arm, poses, path=path)
            seconds.append(time.thread_time() - began)
        places = ' '.join(f'{solution.place[row]:.0f}' for row in solution.reconfigurations)
        rows.append(('panda', str(LONG_COUNT), str(samples), str(len(solution.reconfigurations)), places,
                     f'{solution.length:.1f}', f'{1e3 * float(np.median(seconds)):.0f}'))  # fmt: skip
    return rows


def optimum_rows(count: int, poses: int = 500) -> list[tuple[str, ...]]:
    """Compare `count` random paths for each arm with dynamic programming over solutions of other libraries."""
    python, faults = make_environment()
    rows = []
    for name, library in JUDGED_BY:
        if fault := faults.get(library.partition(',')[0]):
            rows.append((name, library, fault, *[''] * (len(OPTIMUM_HEAD) - 3)))
            continue
        arm, random = bare_arm(name), np.random.default_rng(SEED)
        paths, length = (max(2, int(share * number)) for share, number in zip(SHARES[library], (count, poses)))
        found = [compare(arm, random_path(arm, random, length), library, python)
                 for _ in tqdm(range(paths), desc=name, leave=False)]  # fmt: skip
        gaps = np.array([gap for gap, *_ in found])
        further = np.array([reached for _, reached, *_ in found])
        figures = [(gaps == 0).sum(), (gaps < 0).sum(), (gaps > 0).sum(), sum(longer for *_, longer, _ in found),
                   (further > 0).sum(), (further < 0).sum()]  # fmt: skip
        ratio = np.median([seconds for *_, seconds in found])
        rows.append((name, library, str(paths), str(length), *map(str, figures), f'{ratio:.0f} x'))
    return rows


def compare(arm: Arm, path: np.ndarray, library: str, python: str) -> tuple[int, int, bool, float]:
    """Return how many reconfigurations more than the judge solve_path needs as far as both go, how many poses more it
    reaches, whether its joints move 1 % further on a path without reconfigurations, and the ratio of times."""
    began = time.thread_time()
    ours = solve_path(arm, path, path=PathOptions(max_reconfigurations=100, **AS_GIVEN))
    elapsed = time.thread_time() - began
    reached = len(path) if ours.complete else round(ours.breaks[0].place)
    gap, both, longer, seconds = 0, 0, False, 0.0
    for times in FINER[library]:
        fine = finer(path, times)
        branches, seconds = closed_form_branches(python, library, arm, fine)
        fewest, least = judge_path(arm, fine, branches, PathOptions().tolerance, PathOptions().angle_tolerance)
        fewest, least = fewest[::times], least[::times]  # of the poses given
        both = min(reached, len(fewest))
        if both:
            mine = sum(ours.place[row] < both - 1 for row in ours.reconfigurations)
            gap = mine - int(fewest[both - 1])
            rows = ours.q[ours.place <= both - 1]
            length = float(np.linalg.norm(np.diff(rows, axis=0), axis=1).sum())
            longer = mine == fewest[both - 1] == 0 and length > 1.01 * least[both - 1]
        if gap == 0 and reached == len(fewest):
            break
    return gap, reached - len(fewest), longer, seconds / elapsed


def speed_rows(robots: Sequence[str]) -> list[tuple[str, ...]]:
    """Time paths of several lengths, the median of RUNS by the time that the core was busy; beside them a greedy loop
    that solves pose after pose from the answer before it, in turns."""
    rows = []
    for name in robots:
        arm = bare_arm(name)
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
