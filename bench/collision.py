"""Answers that are clear of contact: how many, how many touch after all, and what the check costs; `--collision`.

The judge is Pinocchio's own reading of the URDF and coal on its meshes, another model than the solver's. Speed is
compared within one run, alternating on the same targets.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from bench.made_up_rooms import made_up_rooms
from bench.published_robots import (
    BAXTER,
    PANDA,
    TIAGO,
    UR5,
    XARM7,
    Z1,
    UrdfJudge,
    configurations,
    moving_pairs,
)
from ros_ik_pkg.ik import Arm, Obstacle, Solution, SolveOptions, World, load_arm, solve, solve_batch
from ros_ik_pkg.ik.collision.scene import contacts_of
from ros_ik_pkg.ik.contacts.coal_library import coal
from ros_ik_pkg.ik.contacts.contacts import Room

HEEDLESS, HEEDFUL = SolveOptions(avoid_collisions=False), SolveOptions()
CHUNK = 50
MADE_UP = 80  # arms with meshes that nobody built
SHARE = 20  # of them take as many targets as a robot in one room
TIMED = 2000  # targets of a case that are solved without the check and by rejection too
MOST_SEEDS = 100  # that rejection tries
SURE = 1e-4  # m by which a target's own configuration is clear
COLLISION_HEAD = (
    'arm', 'room', 'targets', 'solved', 'touch', 'touch without', 'median without', 'median', 'p99', 'over', 'rejection'
)  # fmt: skip
SHAPES = {'box': coal.Box, 'sphere': coal.Sphere, 'cylinder': coal.Cylinder, 'capsule': coal.Capsule}
WAYS = ('with', 'without', 'rejection')
BATCH_HEAD = ('arm', 'room', 'poses', 'solved', 'poses a second of one core')
ROD = Obstacle('rod', 'cylinder', (0.02, 0.3), np.block([[np.eye(3), np.array([[0.0], [0.0], [0.23]])],
                                                         [np.zeros((1, 3)), np.ones((1, 1))]]),
               'panda_hand', ('panda_leftfinger', 'panda_rightfinger'))


def boxes(count: int = 10) -> tuple[Obstacle, ...]:
    """Return boxes on a ring around the arm."""
    found = []
    for k in range(count):
        pose = np.eye(4)
        pose[:3, 3] = 0.6 * np.cos(0.63 * k), 0.6 * np.sin(0.63 * k), 0.1 + 0.08 * k
        found.append(Obstacle(f'box {k}', 'box', (0.1, 0.1, 0.1), pose))
    return tuple(found)


ALONE, GROUND, CROWDED = World(), World(floor=-0.05), World(floor=-0.05, obstacles=boxes())
WORLDS = {'itself': ALONE, 'and a floor': GROUND, 'and ten boxes': CROWDED}


@dataclass(frozen=True)
class Case:
    """An arm in a room."""

    name: str
    title: str
    urdf: Path
    arm: Arm
    world: World
    margin: float = 0.0


def cases() -> Iterator[Case]:
    """Return all arms and rooms."""
    for name, (urdf, srdf, tip) in {'panda': PANDA, 'xarm7': XARM7, 'ur5': UR5, 'z1': Z1, 'lift': TIAGO}.items():
        base = 'torso_fixed_link' if name == 'lift' else None
        arm = load_arm(urdf, base=base, tip=tip, srdf=srdf)
        for title, world in WORLDS.items():
            yield Case(name, title, urdf, arm, world)
    for side, other in (('left', 'right'), ('right', 'left')):
        arm = load_arm(BAXTER[0], base='torso', tip=f'{side}_hand_link', srdf=BAXTER[1])
        inwards = 1.0 if other == 'right' else -1.0
        held = {f'{other}_s0': 0.9 * inwards, f'{other}_s1': -0.4, f'{other}_e1': 0.6, f'{other}_w1': 0.3}
        for title, world in WORLDS.items():
            yield Case(f'{side} of two', title, BAXTER[0], arm, replace(world, positions=held))
    arm = load_arm(PANDA[0], tip=PANDA[2], srdf=PANDA[1])
    yield Case('panda', 'rod in the hand', PANDA[0], arm, World(floor=-0.05, obstacles=(*boxes(), ROD)))
    yield Case('panda', '5 mm away', PANDA[0], arm, CROWDED, 0.005)
    yield Case('ur5', '10 mm away', UR5[0], load_arm(UR5[0], tip=UR5[2], srdf=UR5[1]), GROUND, 0.01)


@dataclass
class Tally:
    """What came of the targets of some cases; `seconds` by way of solving, of the first TIMED targets of each."""

    targets: int = 0
    solved: int = 0
    touching: dict[str, int] = field(default_factory=lambda: dict.fromkeys(WAYS, 0))
    seconds: dict[str, list[float]] = field(default_factory=lambda: {way: [] for way in WAYS})

    def row(self, name: str, title: str) -> tuple[str, ...]:
        """Return the row of the table."""
        middle = {way: 1e6 * float(np.median(seconds)) for way, seconds in self.seconds.items()}
        late = 1e6 * float(np.percentile(self.seconds['with'], 99))
        touching = self.touching['without'] / len(self.seconds['without'])
        return (
            name, title, str(self.targets), f'{100 * self.solved / self.targets:.3f} %', str(self.touching['with']),
            f'{100 * touching:.1f} %', f'{middle["without"]:.1f} us', f'{middle["with"]:.1f} us', f'{late:.0f} us',
            f'{middle["with"] - middle["without"]:.1f} us', f'{middle["rejection"]:.0f} us',
        )  # fmt: skip


def collision_rows(count: int) -> tuple[list[tuple[str, ...]], int]:
    """Return a row for each arm and room, each with `count` targets, and one for made-up arms and rooms, with
    MADE_UP / SHARE times as many; and how many answers touch."""
    rows, wrong = [], 0
    for case in cases():
        tally = Tally()
        _measure(case, count, tally)
        rows.append(_say(tally.row(case.name, case.title)))
        wrong += tally.touching['with']
    tally = Tally()
    with tempfile.TemporaryDirectory() as folder:
        for urdf, arm, world, margin in made_up_rooms(Path(folder), MADE_UP):
            _measure(Case(arm.name, 'made up', urdf, arm, world, margin), max(1, count // SHARE), tally)
    rows.append(_say(tally.row(f'{MADE_UP} made up', 'made up')))
    return rows, wrong + tally.touching['with']


def _say(row: tuple[str, ...]) -> tuple[str, ...]:
    """Print a row at once: a run takes hours."""
    print(f'| {" | ".join(row)} |', flush=True)
    return row


def batch_rows(count: int) -> list[tuple[str, ...]]:
    """Return how many poses solve_batch answers in a second of one core in each room of a Panda, clear of contact."""
    arm = load_arm(PANDA[0], tip=PANDA[2], srdf=PANDA[1])
    rows = []
    for title, world in WORLDS.items():
        targets = clear_targets(arm, arm.contacts.room(world), 0.0, count)
        began = time.process_time()  # of all threads
        answers = solve_batch(arm, targets, world=world)
        seconds = time.process_time() - began
        rows.append(('panda', title, str(count), str(int(answers.converged.sum())), f'{count / seconds:.0f}'))
    return rows


def _measure(case: Case, count: int, tally: Tally) -> None:
    """Solve targets that a clear configuration reaches, the first in turns with and without the check and by
    rejection."""
    arm, world = case.arm, case.world
    room = arm.contacts.room(world)
    heedful = replace(HEEDFUL, collision_margin=case.margin)
    judge = UrdfJudge(case.urdf, moving_pairs(room), room.positions, base=arm.base_frame)
    add_room(judge, arm, room, world)
    judge.keep(case.margin)
    targets = clear_targets(arm, room, case.margin, count)
    calls = {
        'with': lambda target: solve(arm, target, options=heedful, world=world),
        'without': lambda target: solve(arm, target, options=HEEDLESS),
        'rejection': lambda target: reject(arm, target, room, case.margin),
    }
    for first in tqdm(range(0, len(targets), CHUNK), desc=f'{case.name} {case.title}', leave=False):
        timed = first < TIMED
        for way in WAYS if timed else ('with',):
            answers = []
            for target in targets[first : first + CHUNK]:
                began = time.thread_time_ns()
                answers.append(calls[way](target))
                if timed:
                    tally.seconds[way].append(1e-9 * (time.thread_time_ns() - began))
            converged = [answer for answer in answers if answer.converged]
            tally.touching[way] += sum(judge.touches(arm.joint_names, answer.q) for answer in converged)
            tally.solved += len(converged) if way == 'with' else 0
    tally.targets += len(targets)


def clear_targets(arm: Arm, room: Room, margin: float, count: int) -> np.ndarray:
    """Return poses (count, 4, 4) of random configurations that are clear."""
    found: list[np.ndarray] = []
    seed = 11
    while len(found) < count:
        q = configurations(arm, count, seed=seed)
        found += list(q[contacts_of(room.packed, q, margin + SURE) < 0])
        seed += 1
    return np.array([arm.forward(row) for row in found[:count]])


def add_room(judge: UrdfJudge, arm: Arm, room: Room, world: World) -> None:
    """Put floor and obstacles into the judge, against the links that move."""
    partners: dict[str, list[str]] = {name: [] for name in ('floor', *(obstacle.name for obstacle in world.obstacles))}
    for pair in room.pairs:
        for name in pair & partners.keys():
            partners[name] += list(pair - {name})
    if world.floor is not None:
        pose = np.eye(4)
        pose[2, 3] = world.floor - 1.0
        judge.add('floor', coal.Box(20.0, 20.0, 2.0), pose, partners['floor'])
    for obstacle in world.obstacles:
        shape = SHAPES[obstacle.kind](*map(float, obstacle.size))
        against = [name for name in partners[obstacle.name] if name in judge.owners]
        judge.add(obstacle.name, shape, obstacle.shape.frame_from_shape, against, frame=obstacle.link or None)


def reject(arm: Arm, target: np.ndarray, room: Room, margin: float, seed: np.ndarray | None = None) -> Solution:
    """Solve from new seeds until Pinocchio and coal find an answer clear: what a caller can do around any solver."""
    for k in range(MOST_SEEDS):
        solution = solve(arm, target, seed, HEEDLESS)
        if solution.converged and room.is_clear(solution.q, margin):
            break
        seed = configurations(arm, 1, seed=k)[0]
    return solution
