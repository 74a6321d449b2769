"""Problems: random reachable poses, paths, singular poses, and poses out of reach; the same on every run."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace

import numpy as np

from bench.judge import Judge
from ros_ik_pkg.ik import Arm, SolveOptions, solve_batch

KINDS = ('reachable', 'tracking', 'singular', 'beyond', 'inside')
PATH_LENGTH = 1000
PATH_SHARE = 0.8  # of the range between the limits that a path uses
HARMONICS = 3
CANDIDATES = 100  # configurations of which the one nearest a singularity is taken
UNREACHABLE_SHARE = 10  # one pose out of reach per this many reachable ones, because each takes a full search
EXHAUSTIVE = SolveOptions(max_attempts=2000, deadline=0.0)


@dataclass(frozen=True, eq=False)
class Case:
    """N poses to solve. `path` (N, n) is there for warm starts: the motion that the targets were made from."""

    kind: str
    targets: np.ndarray  # (N, 4, 4) [m]
    seeds: np.ndarray  # (N, n) [rad, m]
    path: np.ndarray | None = None

    @property
    def reachable(self) -> bool:
        """Return whether every pose is known to have a solution."""
        return self.kind in ('reachable', 'tracking', 'singular')

    def __len__(self) -> int:
        return len(self.targets)


def make_case(arm: Arm, kind: str, count: int) -> Case:
    """Make `count` poses of a kind (one of KINDS); tracking rounds up to whole paths."""
    random = np.random.default_rng([zlib.crc32(arm.name.encode()), KINDS.index(kind)])
    makers = dict(zip(KINDS, (_reachable, _tracking, _singular, _beyond, _inside)))
    return makers[kind](Judge(arm), random, count)


def bounds(arm: Arm) -> tuple[np.ndarray, np.ndarray]:
    """Return the limits, or a turn (or 2 pi m) if there are none."""
    lower = np.where(np.isfinite(arm.lower), arm.lower, np.where(np.isfinite(arm.upper), arm.upper - 2 * np.pi, -np.pi))
    return lower, np.where(np.isfinite(arm.upper), arm.upper, lower + 2 * np.pi)


def random_joints(arm: Arm, random: np.random.Generator, count: int) -> np.ndarray:
    """Return (count, n) configurations, uniform within the limits."""
    return random.uniform(*bounds(arm), (count, arm.n))


def random_rotations(random: np.random.Generator, count: int) -> np.ndarray:
    """Return (count, 3, 3) rotations, uniform."""
    w, x, y, z = (quaternion := random.normal(size=(4, count))) / np.linalg.norm(quaternion, axis=0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def _reachable(judge: Judge, random: np.random.Generator, count: int) -> Case:
    q = random_joints(judge.arm, random, count)
    return Case('reachable', judge.forward(q), random_joints(judge.arm, random, count))


def _tracking(judge: Judge, random: np.random.Generator, count: int) -> Case:
    """Return closed paths in joint space; the first seed is the start of the path."""
    paths = [_closed_path(judge.arm, random) for _ in range(max(1, round(count / PATH_LENGTH)))]
    path = np.concatenate(paths)[: max(count, 2)]
    return Case('tracking', judge.forward(path), path, path)


def _closed_path(arm: Arm, random: np.random.Generator) -> np.ndarray:
    """Return (PATH_LENGTH, n): a sum of few harmonics for each joint, at most one turn wide."""
    lower, upper = bounds(arm)
    time = np.linspace(0.0, 2 * np.pi, PATH_LENGTH, endpoint=False)
    amplitudes, phases = random.normal(size=(2, HARMONICS, arm.n))
    phases *= 2 * np.pi
    harmonic = np.arange(1, HARMONICS + 1)[:, None, None]
    waves = (amplitudes[:, None] / harmonic**2 * np.sin(harmonic * time[:, None] + phases[:, None])).sum(axis=0)
    low, high = waves.min(axis=0), waves.max(axis=0)
    width = PATH_SHARE * np.minimum(upper - lower, 2 * np.pi)
    return (lower + upper) / 2 + width * ((waves - low) / (high - low) - 0.5)


def _singular(judge: Judge, random: np.random.Generator, count: int) -> Case:
    """Take configurations whose smallest singular value is the smallest of CANDIDATES."""
    arm = judge.arm
    nearest = np.empty((count, arm.n))
    for row in nearest:
        q = random_joints(arm, random, CANDIDATES)
        row[:] = q[np.argmin(judge.smallest_singular_values(q))]
    return Case('singular', judge.forward(nearest), random_joints(arm, random, count))


def _beyond(judge: Judge, random: np.random.Generator, count: int) -> Case:
    """Move reachable poses away from the base until no arm of this size gets there."""
    count = max(1, count // UNREACHABLE_SHARE)
    case = _reachable(judge, random, count)
    far = _reachable(judge, random, 1000).targets[:, :3, 3]
    middle = far.mean(axis=0)
    radius = np.linalg.norm(far - middle, axis=1).max()
    targets = case.targets.copy()
    ways = targets[:, :3, 3] - middle
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    targets[:, :3, 3] = middle + ways * radius * random.uniform(1.5, 3.0, (count, 1))
    return replace(case, kind='beyond', targets=targets)


def _inside(judge: Judge, random: np.random.Generator, count: int) -> Case:
    """Return reachable positions with orientations for which an exhaustive search finds no solution."""
    count = max(1, count // UNREACHABLE_SHARE)
    found: list[np.ndarray] = []
    while sum(map(len, found)) < count:
        targets = _reachable(judge, random, 4 * count).targets.copy()
        targets[:, :3, :3] = random_rotations(random, len(targets))
        found.append(targets[~solve_batch(judge.arm, targets, options=EXHAUSTIVE).converged])
        if not len(found[-1]):
            break  # this arm reaches every orientation
    targets = np.concatenate(found)[:count]
    return Case('inside', targets, random_joints(judge.arm, random, len(targets)))
