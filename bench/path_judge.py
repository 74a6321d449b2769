"""The independent judge of whole paths: dynamic programming in NumPy over every branch of a closed form."""

from __future__ import annotations

import itertools
import json
import subprocess
import tempfile
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pinocchio as pin

from bench.judge import Judge
from bench.model import make_model
from bench.process import ROOT
from ros_ik_pkg.ik import Arm

TURN = 2.0 * np.pi
LONGEST_STEP = 0.5  # rad of a joint between two poses that the judge takes for one motion
TIMEOUT = 600.0  # s


def closed_form_branches(
    python: str, library: str, arm: Arm, poses: np.ndarray
) -> tuple[list[np.ndarray], float]:
    """Return the branches (b, n) of each pose by EAIK or ssik, in the peers' environment, and the seconds it took."""
    with tempfile.TemporaryDirectory() as folder:
        model, source, target = (str(Path(folder, name)) for name in ('model.json', 'poses.npy', 'branches.npz'))
        Path(model).write_text(json.dumps(asdict(make_model(arm, arm.name, Path(folder)))))
        np.save(source, poses)
        command = [python, '-W', 'ignore', '-m', 'bench.path_branches', library, model, source, target]
        subprocess.run(command, check=True, cwd=ROOT, timeout=TIMEOUT)
        found = np.load(target)
        return [q[:count] for q, count in zip(found['branches'], found['counts'])], float(found['seconds'])


def finer(poses: np.ndarray, times: int) -> np.ndarray:
    """Return poses with `times` - 1 more between each two: positions linear, orientations by Pinocchio's logarithm."""
    out = [poses[0]]
    for a, b in itertools.pairwise(poses):
        turn = pin.log3(b[:3, :3] @ a[:3, :3].T)
        for i in range(1, times + 1):
            pose = np.eye(4)
            pose[:3, :3] = pin.exp3(turn * i / times) @ a[:3, :3]
            pose[:3, 3] = a[:3, 3] + (b[:3, 3] - a[:3, 3]) * i / times
            out.append(pose)
    return np.array(out)


def judge_path(
    arm: Arm, poses: np.ndarray, branches: list[np.ndarray], tolerance: float, angle: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return of each pose that can be reached in order the fewest reconfigurations, and the least L2 joint motion to
    it without any (inf if that is not possible)."""
    turns = [int(np.floor((u - low) / TURN - 1e-9)) + 1 if wrap and np.isfinite(u - low) else 1
             for low, u, wrap in zip(arm.lower, arm.upper, arm.wraps)]  # fmt: skip
    digits = np.stack(np.meshgrid(*(np.arange(t) for t in turns), indexing='ij'), -1).reshape(-1, arm.n)
    low = np.where(np.isfinite(arm.lower), arm.lower, -np.pi)
    branches = [low + np.mod(q - low, TURN) for q in branches]
    valid = [_valid(arm, q, digits) for q in branches]
    edges = _edges(arm, poses, branches, tolerance, angle)
    jumps = np.where(valid[0], 0, 1 << 30)
    costs = np.where(valid[0], 0.0, np.inf)
    if not valid[0].any():
        return np.empty(0), np.empty(0)
    fewest, least = [0], [0.0]
    for k in range(1, len(poses)):
        now, length = np.full(valid[k].shape, 1 << 30), np.full(valid[k].shape, np.inf)
        for a, b, whole, step in edges[k - 1]:
            before = digits + whole
            inside = ((before >= 0) & (before < turns)).all(axis=1)
            index = np.ravel_multi_index(np.where(inside[:, None], before, 0).T, turns)
            now[b] = np.minimum(now[b], np.where(inside & valid[k][b], jumps[a][index], 1 << 30))
            length[b] = np.minimum(length[b], np.where(inside & valid[k][b], costs[a][index] + step, np.inf))
        if now.size == 0 or now.min() >= 1 << 30:
            break
        jumps, costs = np.where(valid[k], np.minimum(now, now.min() + 1), 1 << 30), length
        fewest.append(int(jumps.min()))
        least.append(float(costs.min()))
    return np.array(fewest), np.array(least)


def _valid(arm: Arm, q: np.ndarray, digits: np.ndarray) -> np.ndarray:
    """Return (b, v): whether each branch with each choice of whole turns is within the limits."""
    values = q[:, None, :] + TURN * digits
    return ((values >= arm.lower) & (values <= arm.upper)).all(axis=2)


def _edges(
    arm: Arm, poses: np.ndarray, branches: list[np.ndarray], tolerance: float, angle: float
) -> list[list[tuple[int, int, np.ndarray, float]]]:
    """Return for each pair of poses the edges: branches, whole turns, length; the middle by Pinocchio on the line."""
    found, targets = [], finer(poses, 2)[1::2]
    for p, q in itertools.pairwise(branches):
        step = q[None] - p[:, None]
        whole = np.where(arm.wraps != 0, np.round(step / TURN), 0.0)
        step -= TURN * whole
        a, b = np.nonzero((np.abs(step) <= LONGEST_STEP).all(axis=2))
        found.append((a, b, whole[a, b].astype(int), step[a, b], p[a] + 0.5 * step[a, b]))
    of = np.repeat(np.arange(len(found)), [len(a) for a, *_ in found])
    position, orientation = Judge(arm).errors(targets[of], np.concatenate([middles for *_, middles in found]))
    good = (np.linalg.norm(position, axis=1) <= tolerance) & (np.linalg.norm(orientation, axis=1) <= angle)
    out = []
    for k, (a, b, whole, step, _) in enumerate(found):
        on_line = good[of == k]
        out.append(list(zip(a[on_line], b[on_line], whole[on_line], np.linalg.norm(step[on_line], axis=1))))
    return out
