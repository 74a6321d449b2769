"""Answers that are clear of contact: how many, how many touch after all, and what the check costs; `--collision`.

The judge is Pinocchio's own reading of the URDF and coal on its meshes, another model than the solver's. Speed is
compared within one run, alternating on the same targets.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from tqdm import tqdm

from bench.published_robots import PANDA, UR5, XARM7, Z1, UrdfJudge, configurations, moving_pairs
from ros_ik_pkg.ik import Arm, Obstacle, Solution, SolveOptions, World, load_arm, solve
from ros_ik_pkg.ik.collision.scene import contacts_of
from ros_ik_pkg.ik.contacts.coal_library import coal
from ros_ik_pkg.ik.contacts.contacts import Room

ROBOTS = {'panda': PANDA, 'xarm7': XARM7, 'ur5': UR5, 'z1': Z1}
HEEDLESS, HEEDFUL = SolveOptions(avoid_collisions=False), SolveOptions()
CHUNK = 50
MOST_SEEDS = 100  # that rejection tries
SURE = 1e-4  # m by which a target's own configuration is clear
COLLISION_HEAD = (
    'arm', 'room', 'targets', 'solved', 'touch', 'touch without', 'median without', 'median', 'p99', 'over', 'rejection'
)  # fmt: skip


def boxes(count: int = 10) -> tuple[Obstacle, ...]:
    """Return boxes on a ring around the arm."""
    found = []
    for k in range(count):
        pose = np.eye(4)
        pose[:3, 3] = 0.6 * np.cos(0.63 * k), 0.6 * np.sin(0.63 * k), 0.1 + 0.08 * k
        found.append(Obstacle(f'box {k}', 'box', (0.1, 0.1, 0.1), pose))
    return tuple(found)


WORLDS = {
    'itself': World(), 'and a floor': World(floor=-0.05), 'and ten boxes': World(floor=-0.05, obstacles=boxes())
}  # fmt: skip


def collision_rows(count: int) -> tuple[list[tuple[str, ...]], int]:
    """Return a row for each arm and room, and how many answers touch."""
    rows, wrong = [], 0
    for name, (urdf, srdf, tip) in ROBOTS.items():
        arm = load_arm(urdf, tip=tip, srdf=srdf)
        for title, world in WORLDS.items():
            row, touching = _measure(name, title, arm, world, UrdfJudge, urdf, count)
            rows.append(row)
            wrong += touching
    return rows, wrong


def _measure(
    name: str, title: str, arm: Arm, world: World, make_judge: Callable[..., UrdfJudge], urdf: object, count: int
) -> tuple[tuple[str, ...], int]:
    """Solve targets that a clear configuration reaches, in turns with and without the check and by rejection."""
    room = arm.contacts.room(world)
    judge = make_judge(urdf, moving_pairs(room), room.positions, base=arm.base_frame)
    add_room(judge, arm, room, world)
    q = configurations(arm, 4 * count, seed=11)
    q = q[contacts_of(room.packed, q, SURE) < 0][:count]
    targets = np.array([arm.forward(row) for row in q])
    ways = {
        'without': lambda target: solve(arm, target, options=HEEDLESS),
        'with': lambda target: solve(arm, target, options=HEEDFUL, world=world),
        'rejection': lambda target: _reject(arm, target, room),
    }
    found: dict[str, list[Solution]] = {way: [] for way in ways}
    seconds: dict[str, list[float]] = {way: [] for way in ways}
    for first in tqdm(range(0, len(targets), CHUNK), desc=f'{name} {title}', leave=False):
        for way, call in ways.items():
            for target in targets[first : first + CHUNK]:
                began = time.perf_counter()
                found[way].append(call(target))
                seconds[way].append(time.perf_counter() - began)
    touching = {way: sum(judge.touches(arm.joint_names, solution.q) for solution in found[way] if solution.converged)
                for way in ('without', 'with')}
    solved = np.mean([solution.converged for solution in found['with']])
    without, heedful, rejected = (1e6 * float(np.median(seconds[way])) for way in ways)
    late = 1e6 * float(np.percentile(seconds['with'], 99))
    row = (
        name, title, str(len(targets)), f'{100 * solved:.2f} %', str(touching['with']),
        f'{100 * touching["without"] / len(targets):.1f} %', f'{without:.1f} us', f'{heedful:.1f} us', f'{late:.0f} us',
        f'{heedful - without:.1f} us', f'{rejected:.0f} us',
    )  # fmt: skip
    return row, touching['with']


def add_room(judge: UrdfJudge, arm: Arm, room: Room, world: World) -> None:
    """Put floor and boxes into the judge, against the links that move."""
    partners = {name: [] for name in ('floor', *(obstacle.name for obstacle in world.obstacles))}
    for pair in room.pairs:
        for name in pair & partners.keys():
            partners[name] += list(pair - {name})
    if world.floor is not None:
        pose = np.eye(4)
        pose[2, 3] = world.floor - 1.0
        judge.add('floor', coal.Box(20.0, 20.0, 2.0), pose, partners['floor'])
    for obstacle in world.obstacles:
        judge.add(obstacle.name, coal.Box(*obstacle.size), obstacle.shape.frame_from_shape, partners[obstacle.name])


def _reject(arm: Arm, target: np.ndarray, room: Room) -> Solution:
    """Solve from new seeds until Pinocchio and coal find an answer clear: what a caller can do around any solver."""
    seed = arm.home
    for k in range(MOST_SEEDS):
        solution = solve(arm, target, seed, HEEDLESS)
        if solution.converged and room.is_clear(solution.q):
            break
        seed = configurations(arm, 1, seed=k)[0]
    return solution
