"""Every URDF of the installed packages, every chain of it: reachable poses solved, judged by Pinocchio's own parser."""

from __future__ import annotations

import sysconfig
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
from tqdm import tqdm

from bench.judge import Judge
from ros_ik_pkg.ik import Arm, ModelError, SolveOptions, load_arm, solve_batch
from ros_ik_pkg.ik.model.sources import read_tree
from ros_ik_pkg.ik.model.tree import Tree

ZOO_HEAD = ['robots', 'chains', 'chains refused', 'poses', 'solved', 'wrong']
HALF_RANGE = np.pi  # [rad, m] around home in which configurations are drawn


@dataclass
class ZooResult:
    """What came of all chains, and of each one that was not solved whole or not taken."""

    counts: Counter[str]
    remarks: list[str]


def run_zoo(count: int) -> ZooResult:
    """Solve `count` reachable poses of every chain from the root of a robot to an end of it."""
    result = ZooResult(Counter(), [])
    for path in tqdm(installed_urdfs(), leave=False):
        try:
            tree, model = read_tree(path), pin.buildModelFromUrdf(str(path))
        except (ModelError, ValueError) as error:
            result.remarks.append(f'{path.name}: {error}')
            continue
        result.counts['robots'] += 1
        for tip in ends_of(tree):
            _run_chain(path, tip, model, count, result)
    return result


def zoo_row(counts: Counter[str]) -> list[str]:
    """Return the row of the table under ZOO_HEAD."""
    return [str(counts[name]) for name in ZOO_HEAD]


def installed_urdfs() -> list[Path]:
    """Return the URDF files of the packages that are installed beside this one."""
    return sorted(Path(sysconfig.get_path('purelib')).rglob('*.urdf'))


def ends_of(tree: Tree) -> list[str]:
    """Return the links without children that a movable joint leads to."""
    parents = {joint.parent for joint in tree.joints}
    return [link for link in tree.links
            if link not in parents and any(joint.movable for joint in tree.path_from_root(link))]


def _base_of(tree: Tree, tip: str) -> str:
    """Return the link below the last floating or planar joint above the tip, else the root."""
    path = tree.path_from_root(tip)
    loose = [joint.child for joint in path if joint.kind != 'fixed' and not joint.movable]
    return loose[-1] if loose else tree.root


def _run_chain(path: Path, tip: str, model: pin.Model, count: int, result: ZooResult) -> None:
    """Solve reachable poses of one chain and add what came of them."""
    try:
        arm = load_arm(path, _base_of(read_tree(path), tip), tip)
    except ModelError as error:
        result.counts['chains refused'] += 1
        result.remarks.append(f'{path.name} to {tip}: {error}')
        return
    judge, rng = Judge(arm, model), np.random.default_rng(0)
    q, seeds = (_draw(arm, rng, count) for _ in range(2))
    targets = judge.forward(q)
    batch = solve_batch(arm, targets, seeds, SolveOptions(deadline=0.0, avoid_collisions=False))
    good = judge.solved(targets, batch.q)
    wrong = int((batch.converged & ~good).sum())
    solved = int((batch.converged & good).sum())
    result.counts += Counter({'chains': 1, 'poses': count, 'solved': solved, 'wrong': wrong})
    if solved < count:
        result.remarks.append(f'{path.name} to {tip}: {solved} of {count} solved, {wrong} wrong')


def _draw(arm: Arm, rng: np.random.Generator, count: int) -> np.ndarray:
    """Return configurations (count, n) within the limits and near home."""
    lower = np.maximum(arm.lower, arm.home - HALF_RANGE)
    return rng.uniform(lower, np.minimum(arm.upper, arm.home + HALF_RANGE), (count, arm.n))
