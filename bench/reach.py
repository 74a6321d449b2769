"""Reach maps: how long a million cells take, and whether Pinocchio finds a pose in a cell that they miss."""

from __future__ import annotations

import os
import time

import numpy as np

from bench.bare_arm import bare_arm
from bench.judge import Judge
from ros_ik_pkg.ik import Arm, ReachMap, reach_map
from ros_ik_pkg.ik.search.starts import sampling_range

ROBOTS = ('ur5', 'panda')
BLOCK = 20_000  # poses at a time
REACH_HEAD = [
    'arm', 'cells', 'reached', 'processor time', 'time', 'poses judged', 'in a cell that is not reached',
]  # fmt: skip


def reach_rows(count: int) -> tuple[list[list[str]], int]:
    """Return the table under REACH_HEAD, and how many of N random poses of each arm lie in cells that its map calls not
    reached. Times are without compiling."""
    rows, wrong = [], 0
    for name in ROBOTS:
        arm = bare_arm(name)
        reach_map(arm, samples_count=20_000, rounds=1)  # compiles
        began, used = time.perf_counter(), time.process_time()
        found = reach_map(arm)
        seconds, processor = time.perf_counter() - began, time.process_time() - used
        missed = missed_poses(arm, found, count)
        wrong += missed
        cells = int(np.prod(found.shape)) * found.rotations
        rows.append([
            name, f'{cells}', f'{len(found.cells)}', f'{processor:.1f} s',
            f'{seconds:.1f} s on {len(os.sched_getaffinity(0))} cores', f'{count}', f'{missed}',
        ])  # fmt: skip
    return rows, wrong


def missed_poses(arm: Arm, found: ReachMap, count: int) -> int:
    """Return how many of N random configurations have their tip, by Pinocchio, in a cell that is not reached."""
    judge, random = Judge(arm), np.random.default_rng(7)
    lower, upper = sampling_range(arm.geometry)
    missed = 0
    for begin in range(0, count, BLOCK):
        poses = judge.forward(random.uniform(lower, upper, (min(BLOCK, count - begin), arm.n)))
        cells = cells_of(found, poses)
        place = np.minimum(np.searchsorted(found.cells, cells), len(found.cells) - 1)
        missed += int((found.cells[place] != cells).sum())
    return missed


def cells_of(found: ReachMap, poses: np.ndarray) -> np.ndarray:
    """Return the cells (k,) of poses (k, 4, 4): those of the grid, and of the quaternion's largest component."""
    place = np.floor((poses[:, :3, 3] - found.corner) / found.step).astype(int)
    R = poses[:, :3, :3]
    x, y, z = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    squares = np.stack([1 + x + y + z, 1 + x - y - z, 1 - x + y - z, 1 - x - y + z], axis=1)  # of w, x, y, z
    face = squares.argmax(axis=1)
    a, b, c = R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]  # w times x, y, z, times 4
    d, e, f = R[:, 1, 0] + R[:, 0, 1], R[:, 0, 2] + R[:, 2, 0], R[:, 2, 1] + R[:, 1, 2]  # xy, xz, yz, times 4
    others = np.array([[a, b, c], [a, d, e], [b, d, f], [c, e, f]])[face, :, np.arange(len(face))]
    angles = np.arctan(others / squares[np.arange(len(face)), face][:, None]) / (np.pi / 4)
    i, j, k = np.clip(((angles + 1.0) / 2.0 * found.parts).astype(int), 0, found.parts - 1).T
    rotation = ((face * found.parts + i) * found.parts + j) * found.parts + k
    return np.ravel_multi_index(tuple(place.T), found.shape) * found.rotations + rotation
