"""Targets for a Panda and a UR5 among ten boxes and above a floor: half of them poses of configurations that are clear,
half of any configurations within the limits. Pinocchio's own reading of the URDF and coal on its meshes say of every
solution whether it touches.
"""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import yaml
from diagnostic_msgs.msg import DiagnosticArray

from bench.collision import CROWDED, SURE, add_room
from bench.published_robots import PANDA, UR5, UrdfJudge, configurations, moving_pairs
from ros_ik_pkg.ik import Arm, load_arm
from ros_ik_pkg.ik.collision.scene import contacts_of
from ros_ik_pkg.ros.handling.result import INTERNAL_ERROR, SOLVED
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.reply import values
from ros_ik_pkg.tools.processes import ros_node
from torture.peer import START_TIMEOUT, TIMEOUT, Peer
from torture.plan import Check, Plan, progress, unless
from torture.running import running_node

ROBOTS = {'panda': PANDA, 'ur5': UR5}
COUNT = 100_000
FIRST_WAIT = 1.0  # s for a result of a target that may be sent too early
LEAST_SOLVED = 0.999  # of the targets that a clear configuration reaches


def run(plan: Plan) -> Iterator[Check]:
    """Send the targets to one node after the other."""
    each = max(1, (plan.count or COUNT) // len(ROBOTS))
    for name, (urdf, srdf, tip) in ROBOTS.items():
        arm = load_arm(urdf, tip=tip, srdf=srdf)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, 'boxes.yaml')
            path.write_text(yaml.safe_dump(boxes_as_written()))
            words = {'robot': urdf, 'srdf': srdf, 'tip_frame': tip, 'ground': CROWDED.floor, 'obstacles_file': path,
                     'seed_source': 'home', 'deadline': 10.0}
            arguments = [part for word, value in words.items() for part in ('-p', f'{word}:={value}')]
            with running_node(*arguments) as node, ros_node('torture') as own:
                targets = Targets(Peer(own, arm), urdf)
                targets.go(name, each, plan.seed)
                fault = node.fault()
        yield from checks(name, targets, fault)


def checks(name: str, targets: Targets, fault: str) -> Iterator[Check]:
    """Yield what came of the targets of one robot."""
    said = ', '.join(f'{count} {status}' for status, count in targets.statuses.most_common())
    lost = unless(not targets.lost, f'{targets.lost} without a result')
    yield Check(f'{name}: targets answered', said, fault or lost)
    yield Check(f'{name}: solutions that touch', f'{targets.touching} of {targets.judged}',
                unless(not targets.touching, f'{targets.touching} touch'))  # fmt: skip
    held = targets.statuses[INTERNAL_ERROR]
    yield Check(f'{name}: held back by the final check', str(held), unless(not held, 'the search was wrong'))
    share = targets.clear_solved / max(targets.clear, 1)
    yield Check(f'{name}: targets of clear configurations solved', f'{targets.clear_solved} of {targets.clear}',
                unless(share >= LEAST_SOLVED, 'too few'))  # fmt: skip


def boxes_as_written() -> dict[str, list[dict[str, object]]]:
    """Return the boxes of the room as an obstacles_file has them."""
    return {'obstacles': [{'name': box.name, 'box': list(box.size), 'xyz': box.pose[:3, 3].tolist()}
                          for box in CROWDED.obstacles]}  # fmt: skip


class Targets:
    """Sends one target after the other, and judges what comes back."""

    def __init__(self, peer: Peer, urdf: Path) -> None:
        self._peer, self._results = peer, dict[int, str]()
        self._room = peer.arm.contacts.room(CROWDED)
        self._judge = judge_of(peer.arm, urdf)
        peer.node.create_subscription(
            topics.RESULT.type, topics.RESULT.of(peer.name), self._on_result, topics.RESULT.qos
        )
        self.statuses: Counter[str] = Counter()
        self.lost = self.judged = self.touching = self.clear = self.clear_solved = 0

    def go(self, name: str, count: int, seed: int) -> None:
        """Send `count` targets."""
        arm, half = self._peer.arm, (count + 1) // 2
        self._peer.wait(lambda: self._answer(arm.home, FIRST_WAIT) is not None, START_TIMEOUT)
        self.statuses.clear()
        self.lost = self.judged = self.touching = 0
        any_q = configurations(arm, count - half, seed=seed)
        clear = clear_configurations(arm, self._room.packed, half, seed + 1)
        order = np.random.default_rng(seed).permutation(count)
        for k in progress(order, f'{name}: targets', count):
            solved = self._answer(clear[k] if k < half else any_q[k - half])
            self.clear += k < half
            self.clear_solved += bool(solved) and k < half

    def _on_result(self, message: DiagnosticArray) -> None:
        stamp = message.header.stamp
        figures = values(message.status[0])
        self._results[stamp.sec * 10**9 + stamp.nanosec] = figures['status']

    def _answer(self, q: np.ndarray, timeout: float = TIMEOUT) -> bool | None:
        """Send the pose of q (n,); return whether it is solved, None if nothing came back in time [s]."""
        peer = self._peer
        stamp = peer.send(peer.pose(q))
        if not peer.wait(lambda: stamp in self._results and stamp in peer.outcomes, timeout):
            self.lost += 1
            return None
        self.statuses[self._results.pop(stamp)] += 1
        if peer.outcomes[stamp] != SOLVED:
            peer.forget()
            return False
        peer.wait(lambda: stamp in peer.solutions, TIMEOUT)
        self._hold(peer.solutions[stamp].name, np.array(peer.solutions[stamp].position))
        peer.forget()
        return True

    def _hold(self, names: Sequence[str], q: np.ndarray) -> None:
        """Count whether a solution touches anything."""
        self.judged += 1
        self.touching += self._judge.touches(names, q)


def judge_of(arm: Arm, urdf: Path) -> UrdfJudge:
    """Return Pinocchio's and coal's view of the arm in its room."""
    room = arm.contacts.room(CROWDED)
    judge = UrdfJudge(urdf, moving_pairs(room), room.positions, base=arm.base_frame)
    add_room(judge, arm, room, CROWDED)
    return judge


def clear_configurations(arm: Arm, packed: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Return configurations (count, n) that are clear of contact for certain."""
    found: list[np.ndarray] = []
    while len(found) < count:
        q = configurations(arm, count, seed=seed)
        found += list(q[contacts_of(packed, q, SURE) < 0])
        seed += 1000
    return np.array(found[:count])
