"""Other ways to answers that are clear of contact, on the same targets: rejection, Pink's barriers, mink's limits."""

from __future__ import annotations

import json
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from tqdm import tqdm

from bench.collision import WORLDS, add_room, clear_targets, reject
from bench.judge import Judge
from bench.peers import COLLISION_PEERS, library_of, make_environment, read_requirements
from bench.process import ROOT
from bench.published_robots import PANDA, SHARE, UR5, UrdfJudge, configurations, moving_pairs
from ros_ik_pkg.ik import Arm, World, load_arm, solve
from ros_ik_pkg.ik.collision.scene import contacts_of

PEERS_HEAD = ('arm', 'room', 'solver', 'targets', 'solved', 'touch', 'median', 'of those solved')
ROOMS = ('itself', 'and ten boxes')
TITLES = {'pink': 'Pink, SelfCollisionBarrier', 'mink': 'mink, CollisionAvoidanceLimit'}
TOLERANCE = 1e-4  # m, rad
SEED_CLEARANCE = 0.005  # m
MOST = 200  # targets: some of the others take a second for each
TIMEOUT = 3600.0  # s


def peer_rows(count: int) -> list[tuple[str, ...]]:
    """Return a row for each arm, room and solver; all begin at the same configuration, which is clear."""
    environment = make_environment(COLLISION_PEERS)
    return [row for name, (urdf, srdf, tip) in {'panda': PANDA, 'ur5': UR5}.items() for title in ROOMS
            for row in _rows_of(name, title, urdf, load_arm(urdf, tip=tip, srdf=srdf), count, *environment)]


def _rows_of(
    name: str, title: str, urdf: Path, arm: Arm, count: int, python: str, faults: dict[str, str]
) -> Iterator[tuple[str, ...]]:
    """Yield the rows of an arm in a room."""
    world = WORLDS[title]
    room = arm.contacts.room(world)
    targets, q = clear_targets(arm, room, 0.0, min(count, MOST)), configurations(arm, 1000, seed=5)
    seed = q[contacts_of(room.packed, q, SEED_CLEARANCE) < 0][0]
    judge = UrdfJudge(urdf, moving_pairs(room), room.positions, base=arm.base_frame)
    add_room(judge, arm, room, world)
    ours: dict[str, Callable[[np.ndarray], np.ndarray]] = {
        'solve': lambda target: solve(arm, target, seed, world=world).q,
        'solve without contact, rejection by coal': lambda target: reject(arm, target, room, 0.0, seed).q,
    }
    for way, call in ours.items():
        yield name, title, way, *_figures(arm, judge, targets, *_ours(call, targets, way))
    for library in map(library_of, read_requirements(COLLISION_PEERS)[1]):
        found = faults.get(library) or _theirs(python, library, arm, urdf, world, seed, targets)
        figures = (str(len(targets)), found, '', '', '') if isinstance(found, str) else _figures(
            arm, judge, targets, *found)
        yield name, title, TITLES[library], *figures


def _ours(call: Callable[[np.ndarray], np.ndarray], targets: np.ndarray, text: str) -> tuple[np.ndarray, np.ndarray]:
    """Return configurations (k, n) and seconds (k,)."""
    found, seconds = [], []
    for target in tqdm(targets, desc=text, leave=False):
        began = time.thread_time_ns()
        found.append(call(target))
        seconds.append(1e-9 * (time.thread_time_ns() - began))
    return np.array(found), np.array(seconds)


def _theirs(
    python: str, library: str, arm: Arm, urdf: Path, world: World, seed: np.ndarray, targets: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | str:
    """Return configurations (k, n) and seconds (k,) of a library, or why there are none."""
    boxes = [(box.name, list(map(float, box.size)), box.pose.tolist()) for box in world.obstacles]
    pairs = [sorted(pair) for pair in moving_pairs(arm.contacts.room(world))]
    if world.floor is not None:
        below = np.eye(4)
        below[2, 3] = world.floor - 1.0
        boxes.append(('floor', [20.0, 20.0, 2.0], below.tolist()))
        pairs += [sorted(pair) for pair in arm.contacts.room(world).pairs if 'floor' in pair]
    task = {
        'urdf': str(urdf), 'share': str(SHARE), 'base': arm.base_frame, 'tip': arm.tip_frame, 'boxes': boxes,
        'joints': list(arm.joint_names), 'seed': seed.tolist(), 'pairs': pairs, 'targets': targets.tolist(),
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, 'task.json'), Path(folder, 'found.npz')
        source.write_text(json.dumps(task))
        command = [python, '-W', 'ignore', '-m', 'bench.collision_loops', library, str(source), str(target)]
        done = subprocess.run(command, cwd=ROOT, timeout=TIMEOUT, capture_output=True, text=True)
        if done.returncode:
            return f'failed: {done.stderr.splitlines()[-1:]}'
        found = np.load(target)
        return found['q'], found['seconds']


def _figures(
    arm: Arm, judge: UrdfJudge, targets: np.ndarray, q: np.ndarray, seconds: np.ndarray
) -> tuple[str, ...]:
    """Return the figures of a row, all judged by Pinocchio and coal."""
    solved = Judge(arm).solved(targets, q, TOLERANCE)
    touching = sum(judge.touches(arm.joint_names, row) for row in q[solved])
    middle, of_solved = (f'{1e6 * float(np.median(some)):.0f} us' if len(some) else '' for some in
                         (seconds, seconds[solved]))
    return str(len(targets)), f'{100 * solved.mean():.1f} %', str(touching), middle, of_solved
