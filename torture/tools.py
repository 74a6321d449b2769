"""The tool changes at 50 Hz while targets stream, by the topics `tool` and `tool_pose` in turns. Every solution is held
against its target by Pinocchio's forward kinematics and the tool that its result names; among all tools, that one alone
may fit. The tool named must be one that was sent, and may not go back to one before the last that was named.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pinocchio as pin
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TransformStamped

from bench.judge import ROUNDING, Judge, rotation_vectors
from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.handling.result import SOLVED
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.reply import values
from ros_ik_pkg.tools.send_target import pose_message
from torture.peer import TIMEOUT, TOLERANCE, Peer, connected
from torture.plan import Check, Plan, progress, unless
from torture.running import running_node

ROBOT = 'panda'
COUNT = 10000
CHANGES = 50.0  # Hz
AMPLITUDE = 0.3  # rad; of the configurations around home that targets are poses of
REACH = 0.15  # m; of the tools
LEAST_USED = 0.5  # of the tools that were sent; a slow machine answers few targets between two changes


def run(plan: Plan) -> Iterator[Check]:
    """Change the tool while targets stream."""
    count = plan.count or COUNT
    arm = load_arm(ROBOT)
    with running_node('-p', f'robot:={ROBOT}', '-p', 'deadline:=10.0') as node, connected(arm) as peer:
        tools = Tools(peer, plan.seed)
        for _ in progress(range(count), 'targets while the tool changes'):
            tools.one()
        fault = node.fault()
    yield Check('targets, each with a solution', str(count), fault or tools.missing())
    yield Check('solutions that miss their target with the tool named', f'{tools.missed} of {tools.judged}',
                unless(not tools.missed, f'{tools.missed} miss'))  # fmt: skip
    yield Check('solutions that another tool fits too', f'{tools.ambiguous} of {tools.judged}',
                unless(not tools.ambiguous, 'nothing is shown by them'))  # fmt: skip
    yield Check('tools named that were not sent, or after a newer one', f'{tools.foreign} of {tools.judged}',
                unless(not tools.foreign, f'{tools.foreign} foreign'))  # fmt: skip
    share = len(set(tools.named)) / max(len(tools.sent), 1)
    yield Check('tools sent, and used by a solution', f'{len(tools.sent)}, {100.0 * share:.0f} %',
                unless(share >= LEAST_USED, 'too few'))  # fmt: skip


class Tools:
    """Sends tools and targets, and judges what comes back."""

    def __init__(self, peer: Peer, seed: int) -> None:
        self._peer, self._random, self._judge = peer, np.random.default_rng(seed), Judge(peer.arm)
        self._transforms, self._poses = peer.publisher(topics.TOOL), peer.publisher(topics.TOOL_POSE)
        peer.node.create_subscription(
            topics.RESULT.type, topics.RESULT.of(peer.name), self._on_result, topics.RESULT.qos
        )
        self._results: dict[int, dict[str, str]] = {}
        self._due = time.monotonic()
        self.sent: list[np.ndarray] = []  # tools (7,) in their order
        self.named: list[int] = []  # their places, as results name them
        self.judged = self.missed = self.ambiguous = self.foreign = self.lost = 0
        self._mount()
        peer.wait(lambda: self._answered() is not None)

    def one(self) -> None:
        """Send a target, and another tool when it is time; judge the answer."""
        if time.monotonic() >= self._due:
            self._mount()
        if self._answered() is None:
            self.lost += 1

    def missing(self) -> str:
        """Say how many targets had no solution."""
        return f'{self.lost} without a solution' if self.lost else ''

    def _on_result(self, message: DiagnosticArray) -> None:
        stamp = message.header.stamp
        self._results[stamp.sec * 10**9 + stamp.nanosec] = values(message.status[0])

    def _mount(self) -> None:
        """Send the next tool, by the two topics in turns."""
        self._due = max(self._due + 1.0 / CHANGES, time.monotonic())
        direction, turn = self._random.normal(size=(2, 3))
        tool = pin.SE3(pin.exp3(turn), REACH * direction / np.linalg.norm(direction))
        x, y, z, qx, qy, qz, qw = numbers = pin.SE3ToXYZQUAT(tool).tolist()
        if len(self.sent) % 2:
            pose = PoseStamped()
            p, q, publisher = pose.pose.position, pose.pose.orientation, self._poses
        else:
            pose = TransformStamped()
            p, q, publisher = pose.transform.translation, pose.transform.rotation, self._transforms
        p.x, p.y, p.z, q.x, q.y, q.z, q.w = x, y, z, qx, qy, qz, qw
        self.sent.append(np.array(numbers))
        publisher.publish(pose)

    def _answered(self) -> bool | None:
        """Send a target and judge its solution; None if there is none."""
        peer = self._peer
        arm = peer.arm
        q = np.clip(arm.home + self._random.uniform(-AMPLITUDE, AMPLITUDE, arm.n), arm.lower, arm.upper)
        target = self._judge.forward(q[None])[0] @ pin.XYZQUATToSE3(self.sent[-1]).homogeneous
        stamp = peer.send(pose_message(target))
        if not peer.wait(lambda: stamp in self._results, TIMEOUT):
            return None
        figures = self._results.pop(stamp)
        if figures['outcome'] != SOLVED or not figures['tool']:
            return None
        if not peer.wait(lambda: stamp in peer.solutions, TIMEOUT):
            return None
        self._hold(np.array(peer.solutions.pop(stamp).position), target, np.array(figures['tool'].split(), dtype=float))
        return True

    def _hold(self, q: np.ndarray, target: np.ndarray, named: np.ndarray) -> None:
        """Hold a solution against its target with every tool."""
        self.judged += 1
        tip = self._judge.forward(q[None])[0]
        mounted = tip @ np.array([pin.XYZQUATToSE3(tool).homogeneous for tool in [named, *self.sent[-20:]]])
        away = np.linalg.norm(mounted[:, :3, 3] - target[:3, 3], axis=1)
        turned = np.linalg.norm(rotation_vectors(target[:3, :3] @ mounted[:, :3, :3].transpose(0, 2, 1)), axis=1)
        fits = np.maximum(away, turned) <= TOLERANCE + ROUNDING
        self.missed += not fits[0]
        self.ambiguous += np.count_nonzero(fits[1:]) > 1
        same = np.flatnonzero([np.allclose(named, tool, atol=1e-12) for tool in self.sent[-20:]])
        place = len(self.sent[:-20]) + int(same[0]) if len(same) else -1
        self.foreign += place < (self.named[-1] if self.named else 0)
        self.named.append(place)
