"""The node is killed, while targets stream and a client asks, and started again."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator
from random import Random

from geometry_msgs.msg import PoseStamped

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ros import IkClient
from ros_ik_pkg.ros.client import NodeError
from torture.peer import TIMEOUT, Peer, connected
from torture.plan import Check, Plan, progress, unless
from torture.running import RunningNode, running_node
from torture.sending import Sender
from torture.stream import Stream
from torture.waypoints import sent_at

ROBOT = 'puma560'
BACK_WITHIN = 5.0  # s from the start of the new process to the first answer
KILLS = 5
RATE, JOINT_RATE = 100.0, 100.0  # Hz
BETWEEN = 1.0, 2.0  # s of streaming before a kill
WORDS = ('-p', 'seed_source:=home')
# A node that looks for all solutions in small steps, until its deadline, is killed in the middle of that.
LONG_SOLVE = 0.5  # s
LONG = ('-p', 'choice:=all', '-p', 'method:=dls', '-p', 'step_size:=0.0002', '-p', 'max_iterations:=100000',
        '-p', f'deadline:={LONG_SOLVE}')  # fmt: skip


def killed(arm: Arm, plan: Plan) -> Iterator[Check]:
    """Kill the node several times while it answers two clients, then one that is always in the middle of a solve."""
    count = plan.count or KILLS
    with connections(arm, plan, *WORDS) as (node, peer, sender), asking(peer, peer.pose(arm.home + 0.1)) as client:
        times, fault = kill_often(count, plan, node, peer, sender, client)
        fault = fault or client.fault
        figure = f'{times}; {len(client.answers)} solutions for a client meanwhile'
    yield Check(f'kill -9 and start in a stream, {count} times: back within', figure, fault)
    with connections(arm, plan, *WORDS, *LONG) as (node, peer, sender):
        times, fault = kill_often(count, plan, node, peer, sender, None)
    yield Check(f'kill -9 and start in solves of {LONG_SOLVE:g} s, {count} times: back within', times, fault)


@contextlib.contextmanager
def connections(arm: Arm, plan: Plan, *words: str) -> Iterator[tuple[RunningNode, Peer, Sender]]:
    """Run a node with a sender and a listener."""
    with running_node(*words) as node, connected(arm) as peer, Sender(ROBOT, plan.seed, [peer.name]) as sender:
        yield node, peer, sender


def kill_often(
    count: int, plan: Plan, node: RunningNode, peer: Peer, sender: Sender, client: Asking | None
) -> tuple[str, str]:
    """Kill the node `count` times while targets stream; return how long it took until all were answered, and faults."""
    random, stream, times = Random(plan.seed), Stream(peer, plan.seed), []
    sender.begin(RATE, joint_rate=JOINT_RATE)
    for _ in progress(range(count), 'kill -9'):
        peer.spin(random.uniform(*BETWEEN))
        node.kill()
        began = time.monotonic()
        node.start()
        back = peer.wait(lambda began=began: sent_at(max(stream.solutions, default=0)) > began
                         and (client is None or client.answers[-1] > began))  # fmt: skip
        times.append(time.monotonic() - began if back else float('inf'))
    node.wait_until_ready()
    sent = sender.end()
    took = stream.latency(50)
    fault = stream.fault_at_end(sent.last[0]) or node.fault() or sent.too_slow(RATE, JOINT_RATE)
    in_a_solve = client is not None or took > LONG_SOLVE / 2
    late = unless(max(times) < BACK_WITHIN, f'after {max(times):.1f} s') or unless(in_a_solve, 'solves were short')
    return f'{max(times):.1f} s', fault or late


class Asking(threading.Thread):
    """An IkClient that requests one solution after another, also while the node is down."""

    def __init__(self, peer: Peer, pose: PoseStamped) -> None:
        super().__init__(name='asking')
        self._client, self._pose, self._over = IkClient(peer.node), pose, threading.Event()
        self.answers = [0.0]  # time [s] of each solution
        self.fault = ''

    def run(self) -> None:
        """Ask until it is over."""
        while not self._over.is_set():
            try:
                reply = self._client.solve(self._pose, TIMEOUT)
                self.fault = self.fault or unless(reply.solved, f'the client reported: {reply.message}')
                self.answers.append(time.monotonic())
            except NodeError as error:
                self.fault = self.fault or f'the client gave up: {error}'

    def close(self) -> None:
        """End the thread."""
        self._over.set()
        self.join()
        self._client.close()


@contextlib.contextmanager
def asking(peer: Peer, pose: PoseStamped) -> Iterator[Asking]:
    """Let a client ask for the time being."""
    client = Asking(peer, pose)
    client.start()
    try:
        yield client
    finally:
        client.close()
