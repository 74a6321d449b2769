"""Random problems: options from all of their ranges, seeds inside and outside the limits, targets of every kind."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from bench.cases import bounds, random_joints, random_rotations
from bench.judge import Judge
from ros_ik_pkg.ik import OPTIONS, Arm, OptionError, SolveOptions
from ros_ik_pkg.ik.options import Option

CHANGED_NUMBER, CHANGED = 0.15, 0.3  # shares of the options that are not the default: numbers, and all others
SLOW = {'max_iterations': 200, 'max_attempts': 30, 'deadline': 0.005}  # less than allowed, or it takes days
SMALLEST = 1e-9  # lower end of the logarithmic scale if the range starts at 0
FAR = 1e6  # m
KINDS = 9  # of targets, see random_targets


def random_options(random: np.random.Generator, arm: Arm) -> SolveOptions:
    """Draw some options from their full range and leave the others at their defaults."""
    while True:
        values = {option.name: _random_value(option, random, arm) for option in OPTIONS if _changes(option, random)}
        try:
            return SolveOptions(**values)
        except OptionError:  # allowed one by one, but not together
            continue


def _changes(option: Option, random: np.random.Generator) -> bool:
    if option.name in SLOW or option.allowed:
        return True
    return bool(random.random() < (CHANGED_NUMBER if isinstance(option.default, float) else CHANGED))


def _random_value(option: Option, random: np.random.Generator, arm: Arm) -> Any:
    """Draw a value of the type and range that are declared."""
    if option.name in SLOW:
        return type(option.default)(random.uniform(option.minimum, SLOW[option.name]))
    if option.allowed:
        return str(random.choice(option.allowed))
    if isinstance(option.default, bool):
        return bool(random.random() < 0.5)
    if isinstance(option.default, tuple):
        count = len(option.default) or arm.n
        return tuple(_random_number(option, random) * bool(random.random() < 0.7) for _ in range(count))
    return type(option.default)(_random_number(option, random))


def _random_number(option: Option, random: np.random.Generator) -> float:
    """Draw from the range on a logarithmic scale, with either sign if both are allowed."""
    low, high = option.minimum or 0.0, option.maximum
    size = math.exp(random.uniform(math.log(max(low, SMALLEST)), math.log(high)))
    return max(low, min(size, high) * (random.choice([-1.0, 1.0]) if low < 0.0 else 1.0))


def random_seeds(arm: Arm, random: np.random.Generator, count: int) -> np.ndarray:
    """Return (count, n) configurations: inside the limits, on them, zero, and up to a hundred times further out."""
    q = random_joints(arm, random, count) * random.choice([0.0, 1.0, 1.0, 1.0, 3.0, 100.0], (count, 1))
    lower, upper = bounds(arm)
    on_limits = (random.random(count) < 0.1)[:, None]
    return np.where(on_limits, np.where(random.random(q.shape) < 0.5, lower, upper), q)


def random_targets(judge: Judge, random: np.random.Generator, seeds: np.ndarray) -> np.ndarray:
    """Return targets (N, 4, 4), one per seed, in equal parts.

    Reachable; singular; reachable positions with random orientations; near the base; some metres away; and degenerate:
    the pose of the seed, half a turn from it, at the origin of the base, and a thousand kilometres away.
    """
    count, arm = len(seeds), judge.arm
    kind = random.integers(KINDS, size=count)
    q = np.where((kind == 1)[:, None], singular_joints(arm, random, count), random_joints(arm, random, count))
    targets = judge.forward(q)
    targets[kind == 2, :3, :3] = random_rotations(random, int((kind == 2).sum()))
    targets[kind == 3, :3, 3] *= random.uniform(0.0, 1.2, (int((kind == 3).sum()), 1))
    targets[kind == 4, :3, 3] += random.normal(size=(int((kind == 4).sum()), 3)) * 3.0
    at_seed = np.isin(kind, (5, 6))
    targets[at_seed] = judge.forward(np.clip(seeds[at_seed], arm.lower, arm.upper))
    targets[kind == 6, :3, :3] = targets[kind == 6, :3, :3] @ np.diag(_half_turn(random))
    targets[kind == 7] = np.eye(4)
    targets[kind == 8, :3, 3] *= FAR / np.maximum(np.linalg.norm(targets[kind == 8, :3, 3], axis=1), 1e-3)[:, None]
    return targets


def singular_joints(arm: Arm, random: np.random.Generator, count: int) -> np.ndarray:
    """Return (count, n) configurations with most joints at a limit or at zero."""
    q = random_joints(arm, random, count)
    lower, upper = bounds(arm)
    corners = np.where(random.random(q.shape) < 0.5, lower, upper)
    ends = np.where(random.random(q.shape) < 0.5, corners, np.clip(0.0, lower, upper))
    return np.where(random.random(q.shape) < 0.7, ends, q)


def _half_turn(random: np.random.Generator) -> np.ndarray:
    """Return the diagonal of half a turn about x, y or z."""
    diagonal = np.full(3, -1.0)
    diagonal[random.integers(3)] = 1.0
    return diagonal
