"""Every answer checked: random arms, methods, options, seeds and targets; Pinocchio's kinematics is the judge."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from tqdm import tqdm

from bench.cases import bounds, random_joints, random_rotations
from bench.judge import Judge
from bench.random_arms import random_urdf
from ros_ik_pkg.ik import (
    OPTIONS,
    Arm,
    BatchSolution,
    SolveOptions,
    load_arm,
    robot_names,
    solve_batch,
)

GROUP = 1000  # solves of one arm with one set of options
SHOWN = 10  # wrong answers that are printed
ROUNDING = 1e-11  # m, rad; two ways through the same arithmetic
CHANGED = 0.15  # share of the options that are not the default
SLOW = {'max_iterations': 200, 'max_attempts': 30, 'deadline': 0.005}  # less than allowed, or it takes days


@dataclass
class Group:
    """One arm, one set of options, many solves."""

    judge: Judge
    options: SolveOptions
    targets: np.ndarray
    seeds: np.ndarray
    references: np.ndarray


def check_answers(count: int) -> int:
    """Solve `count` times, print one closing line; return 1 if any answer is wrong."""
    began, converged, faults = time.monotonic(), 0, 0
    with tqdm(total=count, desc='checking', unit='solve') as bar:
        for number, first in enumerate(range(0, count, GROUP)):
            group = make_group(np.random.default_rng([2026, number]), min(GROUP, count - first))
            batch = solve_batch(group.judge.arm, group.targets, group.seeds, group.options, group.references)
            converged += int(batch.converged.sum())
            for row, fault in find_faults(group, batch):
                faults += 1
                if faults <= SHOWN:
                    bar.write(f'wrong: group {number}, row {row}, {group.judge.arm.name}, {fault}, {group.options}')
            bar.update(len(group.targets))
    seconds = time.monotonic() - began
    print(f'{count} solves, {faults} wrong, {converged} converged, {math.ceil(count / GROUP)} arms, {seconds:.0f} s')
    return 1 if faults else 0


def make_group(random: np.random.Generator, count: int) -> Group:
    """Make up `count` solves."""
    if random.random() < 0.3:
        judge = Judge(load_arm(str(random.choice(robot_names()))))
    else:
        text = random_urdf(random)
        judge = Judge(load_arm(text), pin.buildModelFromXML(text))
    arm = judge.arm
    return Group(
        judge,
        random_options(random, arm),
        random_targets(judge, random, count),
        random_joints(arm, random, count) * random.choice([1.0, 1.0, 3.0, 100.0], (count, 1)),
        random_joints(arm, random, count) * random.choice([1.0, 3.0], (count, 1)),
    )


def random_options(random: np.random.Generator, arm: Arm) -> SolveOptions:
    """Draw each option from all of its range now and then, and leave it alone otherwise."""
    values: dict[str, Any] = {
        option.name: str(random.choice(option.allowed)) for option in OPTIONS if option.allowed
    }
    for option in OPTIONS:
        if option.name in SLOW:
            values[option.name] = type(option.default)(random.uniform(option.minimum, SLOW[option.name]))
        elif isinstance(option.default, float) and random.random() < CHANGED:
            low = math.log(max(option.minimum, 1e-9))
            values[option.name] = min(math.exp(random.uniform(low, math.log(option.maximum))), option.maximum)
    values['respect_limits'] = bool(random.random() < 0.8)
    if random.random() < 0.3:
        kept = random.random(6) < 0.7
        kept[random.integers(6)] = True
        values['task_weights'] = tuple((kept * random.choice([0.3, 1.0, 2.0], 6)).tolist())
    if random.random() < 0.3:
        values['joint_weights'] = tuple(random.uniform(0.0, 2.0, arm.n).tolist())
    if random.random() < 0.2:
        values['task_tolerances'] = tuple((random.uniform(0.0, 0.3, 6) * (random.random(6) < 0.5)).tolist())
    if random.random() < 0.3:
        values['posture'] = tuple(random.uniform(*bounds(arm)).tolist())
    return SolveOptions(**values)


def random_targets(judge: Judge, random: np.random.Generator, count: int) -> np.ndarray:
    """Return (count, 4, 4): reachable, singular, turned, near and far poses in equal parts."""
    q = random_joints(judge.arm, random, count)
    lower, upper = bounds(judge.arm)
    kind = random.integers(5, size=count)
    corners = np.where(random.random(q.shape) < 0.5, lower, upper)
    ends = np.where(random.random(q.shape) < 0.5, corners, np.clip(0.0, lower, upper))
    singular = (kind == 1)[:, None] & (random.random(q.shape) < 0.7)
    targets = judge.forward(np.where(singular, ends, q))
    turned = kind == 2
    targets[turned, :3, :3] = random_rotations(random, int(turned.sum()))
    targets[kind == 3, :3, 3] *= random.uniform(0.0, 1.2, (int((kind == 3).sum()), 1))
    targets[kind == 4, :3, 3] += random.normal(size=(int((kind == 4).sum()), 3)) * 3.0
    return targets


def find_faults(group: Group, batch: BatchSolution) -> list[tuple[int, str]]:
    """Return (row, what is wrong) for every row that claims what is not so."""
    judge, options, q = group.judge, group.options, batch.q
    kept = np.array(options.task_weights) > 0.0
    axes = group.targets[:, :3, :3] if options.task_frame == 'tip' else np.broadcast_to(np.eye(3), (len(q), 3, 3))
    errors = np.hstack([np.einsum('kji,kj->ki', axes, half) for half in judge.errors(group.targets, q)])
    beyond = np.maximum(np.abs(errors) - options.task_tolerances, 0.0) * kept
    position, orientation = np.linalg.norm(beyond[:, :3], axis=1), np.linalg.norm(beyond[:, 3:], axis=1)
    rounding = ROUNDING * (1.0 + np.abs(q).max(axis=1))
    close = (position <= options.position_tolerance + rounding) & (
        orientation <= options.orientation_tolerance + rounding
    )
    near = np.abs(q - group.references).max(axis=1) <= (options.max_joint_jump or np.inf)
    claims = {
        'converged, but not at the target': ~batch.converged | close,
        'converged, but jumps too far': ~batch.converged | near,
        'outside the limits': judge.inside(q, 0.0) if options.respect_limits else np.isfinite(q).all(axis=1),
        'not the position error of its q': np.abs(batch.position_error - position) <= rounding + 1e-9 * position,
        'not the orientation error of its q': np.abs(batch.orientation_error - orientation) <= 1e-7 + rounding,
    }
    return [(int(row), fault) for fault, holds in claims.items() for row in np.flatnonzero(~holds)]
