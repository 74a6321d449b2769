"""scripts/bench --branches: all branches of six-joint arms beside closed forms of others; leaps near wrists."""

from __future__ import annotations

import subprocess
import time

import numpy as np
from tqdm import tqdm

from bench.bare_arm import bare_arm
from bench.judge import Judge
from bench.path_judge import closed_form_branches
from bench.peers import make_environment
from bench.published_robots import UR10, Z1
from bench.table import Table
from ros_ik_pkg.ik import METHODS, Arm, Solution, SolveOptions, load_arm, solve

BRANCHES_HEAD = [
    'arm', 'poses', 'branches by', 'in our list', 'listed twice', 'wrong', 'by proof', 'median [us]', 'p99 [us]',
    'nearest [us]', 'beaten',
]  # fmt: skip
NONE_HEAD = ['arm', 'poses', 'said so', 'by proof', 'wrongly', 'median [us]', 'p99 [us]']
LEAPS_HEAD = ['arm', 'method', 'targets', 'leaps', 'not solved']
# Axes of industrial arms by their data sheets: origin [m] in the frame before, axis, limits [deg].
KR6_R900 = (
    ('0 0 0.4', '0 0 -1', -170, 170), ('0.025 0 0', '0 1 0', -190, 45), ('0.455 0 0', '0 1 0', -120, 156),
    ('0 0 0.035', '-1 0 0', -185, 185), ('0.42 0 0', '0 1 0', -120, 120), ('0.08 0 0', '-1 0 0', -350, 350),
)  # fmt: skip
IRB120 = (
    ('0 0 0', '0 0 1', -165, 165), ('0 0 0.29', '0 1 0', -110, 110), ('0 0 0.27', '0 1 0', -110, 70),
    ('0 0 0.07', '1 0 0', -160, 160), ('0.302 0 0', '0 1 0', -120, 120), ('0.072 0 0', '1 0 0', -400, 400),
)  # fmt: skip
SAME = 1e-2  # rad between two solutions that count as one
NEARER = 1e-4  # rad by which a solution has to be nearer to count as nearer
LEAP = 1.0  # rad of a joint
SEED = 13
TARGETS = 1500  # for leaps
TURN = 2.0 * np.pi


def branch_tables(count: int) -> tuple[list[tuple[str, str, Table]], int]:
    """Return titles, texts and tables for `count` poses of each arm, and how much in them is wrong."""
    rows, none_rows, faults = branch_rows(count)
    every = (
        'choice: all and nearest on reachable poses from random seeds, beside a closed form within the same limits; '
        'time that the core was busy with the call. Judged by Pinocchio. beaten: nearest, by a branch of theirs.'
    )
    none = 'choice: first on poses within reach of which the closed form has no branch. wrongly: poses that have one.'
    leaps = f'choice: nearest near singular wrists; a leap is more than {LEAP} rad to a target within 0.1 rad.'
    return [
        ('All branches', every, [BRANCHES_HEAD, *rows]), ('No solution', none, [NONE_HEAD, *none_rows]),
        ('Leaps', leaps, [LEAPS_HEAD, *leap_rows()]),
    ], faults  # fmt: skip


def arms_of_closed_form() -> list[Arm]:
    """Return two arms by name and four by URDF."""
    by_name = [load_arm(name) for name in ('ur5', 'puma560')]
    by_table = [load_arm(urdf_of(name, axes)) for name, axes in (('kr6_r900', KR6_R900), ('irb120', IRB120))]
    return [*by_name, *by_table, load_arm(Z1[0]), load_arm(UR10[0], 'base_link', UR10[2])]


def urdf_of(name: str, axes: tuple[tuple[str, str, float, float], ...]) -> str:
    """Write a URDF of joints in a row, each frame of which has the directions of the base frame at zero."""
    joints = [
        f'<joint name="q{k}" type="revolute"><parent link="link{k}"/><child link="link{k + 1}"/><origin xyz="{xyz}"/>'
        f'<axis xyz="{axis}"/><limit lower="{np.radians(low)}" upper="{np.radians(high)}" velocity="3" effort="1"/>'
        '</joint>'
        for k, (xyz, axis, low, high) in enumerate(axes)
    ]
    links = [f'<link name="link{k}"/>' for k in range(len(axes) + 1)]
    return f'<robot name="{name}">{"".join(links + joints)}</robot>'


def branch_rows(count: int) -> tuple[Table, Table, int]:
    """Return the rows under BRANCHES_HEAD and under NONE_HEAD, and how much was wrong in all."""
    python, _ = make_environment()
    rows, none_rows, faults = [], [], 0
    for arm in tqdm(arms_of_closed_form(), leave=False):
        random = np.random.default_rng(SEED)
        poses = np.array([arm.forward(q) for q in draw(arm, random, count)])
        seeds = draw(arm, random, count)
        library, theirs = branches_of(python, arm, poses)
        row, wrong = branch_row(arm, library, poses, seeds, [within(arm, q, seed) for q, seed in zip(theirs, seeds)])
        rows.append(row)
        # Positions within reach with another rotation: many have no solution
        poses[:, :3, 3] *= random.uniform(0.2, 1.0, (count, 1))
        poses[:, :3, :3] = poses[random.permutation(count), :3, :3]
        _, theirs = branches_of(python, arm, poses)
        inside = [within(arm, q, seed) for q, seed in zip(theirs, seeds)]
        none_row, wrongly = no_answer_row(arm, poses, seeds, inside)
        none_rows.append(none_row)
        faults += wrong + wrongly
    return rows, none_rows, faults


def draw(arm: Arm, random: np.random.Generator, count: int) -> np.ndarray:
    """Return configurations (count, n) within the limits, of joints that turn further within one turn."""
    return random.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi), (count, arm.n))


def branches_of(python: str, arm: Arm, poses: np.ndarray) -> tuple[str, list[np.ndarray]]:
    """Return the name of the first library that has a closed form of the arm, and its branches of each pose."""
    try:
        return 'EAIK', closed_form_branches(python, 'eaik', arm, poses)[0]
    except subprocess.CalledProcessError:
        return 'ssik', closed_form_branches(python, 'ssik', arm, poses)[0]


def within(arm: Arm, branches: np.ndarray, seed: np.ndarray) -> np.ndarray:
    """Return those of the branches (b, n) that have whole turns within the limits, at those nearest to the seed."""
    q = branches + TURN * np.round((seed - branches) / TURN)
    q = np.where(q > arm.upper, q - TURN * np.ceil((q - arm.upper) / TURN), q)
    q = np.where(q < arm.lower, q + TURN * np.ceil((arm.lower - q) / TURN), q)
    return q[((q >= arm.lower) & (q <= arm.upper)).all(axis=1)]


def timed(arm: Arm, pose: np.ndarray, seed: np.ndarray, options: SolveOptions) -> tuple[Solution, float]:
    """Return the answer and the time that the core was busy with the call [s]."""
    began = time.thread_time_ns()
    answer = solve(arm, pose, seed, options)
    return answer, 1e-9 * (time.thread_time_ns() - began)


def gaps(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the largest difference of a joint, whole turns aside, between each of a (k, n) and each of b (m, n)."""
    gap = a[:, None] - b
    return np.abs(gap - TURN * np.round(gap / TURN)).max(axis=2)


def branch_row(
    arm: Arm, library: str, poses: np.ndarray, seeds: np.ndarray, theirs: list[np.ndarray]
) -> tuple[list[str], int]:
    """Return the row of an arm, and how many branches are missing, listed twice or wrong and `nearest` ones beaten."""
    judge = Judge(arm)
    every = SolveOptions(choice='all', deadline=0.0, avoid_collisions=False)
    nearest = SolveOptions(choice='nearest', deadline=0.0, avoid_collisions=False)
    listed, twice, wrong, proven, beaten, times, times_of_nearest = 0, 0, 0, 0, 0, [], []
    for pose, seed, known in zip(poses, seeds, theirs):
        answer, seconds = timed(arm, pose, seed, every)
        times.append(seconds)
        proven += answer.completeness == 'proof'
        ours = answer.solutions
        listed += int((gaps(known, ours).min(axis=1, initial=np.inf) < SAME).sum())
        twice += int((gaps(ours, ours) < SAME).sum() - len(ours)) // 2
        wrong += int((~judge.solved(np.repeat(pose[None], len(ours), axis=0), ours)).sum())
        answer, seconds = timed(arm, pose, seed, nearest)
        times_of_nearest.append(seconds)
        shortest = np.linalg.norm(known - seed, axis=1).min(initial=np.inf)
        beaten += not answer.converged or np.linalg.norm(answer.q - seed) > shortest + NEARER
    total = sum(map(len, theirs))
    return [
        arm.name, str(len(poses)), f'{library}: {total}', f'{100 * listed / total:.2f} %', str(twice), str(wrong),
        f'{100 * proven / len(poses):.2f} %', f'{1e6 * np.median(times):.1f}', f'{1e6 * np.percentile(times, 99):.1f}',
        f'{1e6 * np.median(times_of_nearest):.1f}', str(beaten),
    ], total - listed + twice + wrong + beaten  # fmt: skip


def no_answer_row(
    arm: Arm, poses: np.ndarray, seeds: np.ndarray, theirs: list[np.ndarray]
) -> tuple[list[str], int]:
    """Return the row of an arm for poses of which the closed form knows no branch within the limits, and how many of
    the poses that have one are said to have none."""
    options = SolveOptions(deadline=0.0, avoid_collisions=False)
    none, said, proven, wrongly, times = 0, 0, 0, 0, []
    for pose, seed, known in zip(poses, seeds, theirs):
        answer, seconds = timed(arm, pose, seed, options)
        if len(known):
            wrongly += not answer.converged
            continue
        none += 1
        said += not answer.converged
        proven += answer.completeness == 'proof'
        times.append(seconds)
    return [
        arm.name, str(none), str(said), f'{100 * proven / none:.2f} %', str(wrongly), f'{1e6 * np.median(times):.1f}',
        f'{1e6 * np.percentile(times, 99):.1f}',
    ], wrongly  # fmt: skip


def leap_rows() -> Table:
    """Return the rows under LEAPS_HEAD: `nearest` to targets that joints reach within 0.1 rad of the seed, every other
    one near the singularity of the wrist."""
    rows = []
    for name in ('ur5', 'puma560', 'panda', 'iiwa14'):
        arm = bare_arm(name)
        lower, upper = np.maximum(arm.lower + 0.1, -3.0), np.minimum(arm.upper - 0.1, 3.0)
        for method in METHODS:
            if method == 'transpose':  # does not converge in the iterations that it is given
                continue
            random, leaps, unsolved = np.random.default_rng(5), 0, 0
            for trial in tqdm(range(TARGETS), desc=f'{name} {method}', leave=False):
                q = random.uniform(lower, upper)
                if trial % 2:
                    q[arm.n - 2] = np.clip(0.02 * random.normal(), lower[arm.n - 2], upper[arm.n - 2])
                step = random.normal(size=arm.n)
                step *= random.choice([0.02, 0.05, 0.1]) / np.abs(step).max()
                options = SolveOptions(method=method, choice='nearest', deadline=0.0)
                answer = solve(arm, arm.forward(q + step), q, options)
                unsolved += not answer.converged
                leaps += answer.converged and np.abs(answer.q - q).max() > LEAP
            rows.append([name, method, str(TARGETS), str(leaps), str(unsolved)])
    return rows
