"""Targets at 100 to 2000 a second with joint states at 1000 a second, bursts of 10000, two clients that send at the
same time, subscribers that do not read, and 20 nodes in namespaces of one machine that all get targets at once.
Clients are processes that only send, so that the rates are reached; a row with less than 90 % of its rate is wrong.
The newest target wins: if the node is slower, some targets are dropped, none is solved after a newer one of the
same client, and the last one always is. Latencies, from sending a target to its solution, are over all solved
targets.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

import rclpy
from rclpy.qos import HistoryPolicy, QoSProfile

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.runtime.spin import make_executor
from ros_ik_pkg.tools.processes import ros_node
from torture.peer import TIMEOUT, Peer, connected, full_name
from torture.plan import Check, Plan, progress, unless
from torture.running import RunningNode, running_node
from torture.sending import AT_ONCE, Sender
from torture.stream import Stream

ROBOT = 'puma560'
RATES = (100.0, 500.0, 1000.0, 2000.0)  # Hz
SECONDS = 10.0  # of one rate
WARM_UP = 5.0  # s
BURST = 10_000
TWO_RATE = 200.0  # Hz, of each of two clients
SLOW_RATE = 100.0  # Hz, with subscribers that do not read
NODES = 20
NODES_RATE, NODES_JOINT_RATE = 200.0, 400.0  # Hz, of all nodes together
GROWTH = 2.0  # MB during a stretch
MOST_LATENCY = 0.1  # s, 99th percentile; a target takes at most 0.05 s, and one may already be in progress
FAIR = 0.25  # of two clients the one with fewer solutions has at least this share of the other's


def run(plan: Plan) -> Iterator[Check]:
    """Put one node under load, then many nodes."""
    with running_node() as node, connected(load_arm(ROBOT)) as peer, Sender(ROBOT, plan.seed, [peer.name]) as sender:
        Stream(peer, plan.seed).go([sender], 'warm up', RATES[1], WARM_UP)
        for rate in RATES:
            yield from at_rate(rate, plan, node, peer, sender)
        yield from burst(plan.count or BURST, plan.seed, node, peer, sender)
        yield from slow_subscribers(plan, node, peer, sender)
        yield from two_clients(plan, node, peer, sender)
    yield from many_nodes(NODES, plan)


def at_rate(rate: float, plan: Plan, node: RunningNode, peer: Peer, sender: Sender) -> Iterator[Check]:
    """Stream targets and joint states, and look at order, latency and memory."""
    before, stream, what = node.usage(), Stream(peer, plan.seed), f'targets at {rate:g} Hz'
    (sent,) = stream.go([sender], what, rate, plan.seconds(SECONDS))
    fault = stream.fault_at_end(sent.last[0]) or node.fault() or sent.too_slow(rate)
    yield Check(what, stream.figure(sent), fault)
    yield latency(what, stream)
    yield growth(f'{what}: memory growth', before.memory, node)


def latency(what: str, stream: Stream) -> Check:
    """Judge how long solutions took."""
    p50, p99 = stream.latency(50), stream.latency(99)
    figure = f'median {1e3 * p50:.1f} ms, p99 {1e3 * p99:.1f} ms'
    return Check(f'{what}: latency', figure, unless(p99 < MOST_LATENCY, 'too late'))


def growth(what: str, before: float, node: RunningNode, most: float = GROWTH) -> Check:
    """Check the memory growth [MB]."""
    more = node.usage().memory - before
    return Check(what, f'{more:.2f} MB', unless(more < most, 'it grows'))


def burst(count: int, seed: int, node: RunningNode, peer: Peer, sender: Sender) -> Iterator[Check]:
    """Send many targets as fast as possible; the last one must be solved."""
    before, stream = node.usage(), Stream(peer, seed)
    sender.begin(AT_ONCE, count=count)
    while not sender.finished():
        peer.spin(0.01)
    sent = sender.end()
    fault = stream.fault_at_end(sent.last[0]) or node.fault() or unless(sent.targets == count, 'not all were sent')
    yield Check(f'{count} targets at once', stream.figure(sent), fault)
    yield growth('memory growth by the burst', before.memory, node)


def two_clients(plan: Plan, node: RunningNode, peer: Peer, sender: Sender) -> Iterator[Check]:
    """Stream from two processes at the same time; each has its answers in order, and its share of them."""
    with Sender(ROBOT, plan.seed, [peer.name], first_client=1) as second:
        stream = Stream(peer, plan.seed)
        both = stream.go([sender, second], 'two clients', TWO_RATE, plan.seconds(SECONDS))
    newest = max(stamp for sent in both for stamp in sent.last.values())
    fault = stream.fault_at_end(newest) or node.fault()
    solved = [stream.solved(client) for client in range(2)]
    unfair = unless(min(solved) > FAIR * max(solved), 'one has all the answers')
    for client, sent in enumerate(both):
        figure = f'{sent.figure()}, {solved[client]} solved'
        yield Check(f'two clients: the {("first", "second")[client]}', figure, sent.too_slow(TWO_RATE))
    yield Check('two clients: both', f'{stream.stale()} after a newer one of the same', fault or unfair)
    yield latency('two clients', stream)


def slow_subscribers(plan: Plan, node: RunningNode, peer: Peer, sender: Sender) -> Iterator[Check]:
    """Stream while subscribers to all topics keep all and never take a message."""
    before, what = node.usage(), 'subscribers that never read'
    with never_reading(peer.name):
        stream = Stream(peer, plan.seed)
        (sent,) = stream.go([sender], what, SLOW_RATE, plan.seconds(SECONDS))
        fault = stream.fault_at_end(sent.last[0]) or node.fault() or sent.too_slow(SLOW_RATE)
        yield Check(what, stream.figure(sent), fault)
        yield latency(what, stream)
    yield growth('memory growth beside them', before.memory, node, 10 * GROWTH)


@contextlib.contextmanager
def never_reading(name: str) -> Iterator[None]:
    """Subscribe to all topics of a node without reading them."""
    context = rclpy.Context()
    context.init()
    idle = rclpy.create_node('idle', context=context)  # never spun
    keep_all = QoSProfile(depth=1, history=HistoryPolicy.KEEP_ALL)
    for topic in topics.TOPICS:
        if topic.direction == 'out':
            idle.create_subscription(topic.type, topic.of(name), lambda message: None, keep_all)
    try:
        yield
    finally:
        idle.destroy_node()
        context.shutdown()


def many_nodes(count: int, plan: Plan) -> Iterator[Check]:
    """Run many nodes in namespaces and stream to all at once; each must answer only its own targets."""
    names, began = [f'arm{k}' for k in range(count)], time.monotonic()
    with contextlib.ExitStack() as stack:
        nodes = [stack.enter_context(running_node('-r', f'__ns:=/{name}')) for name in progress(names, 'nodes')]
        started, what = time.monotonic() - began, f'{count} nodes in namespaces'
        own, executor = stack.enter_context(ros_node('torture')), make_executor()
        executor.add_node(own)
        peers = [Peer(own, load_arm(ROBOT), name, executor) for name in names]
        faults = [fault for peer in progress(peers, 'answers') if (fault := peer.fault(peer.arm.home, TIMEOUT))]
        memory = sum(node.usage().memory for node in nodes)
        yield Check(what, f'{started:.0f} s to start, {memory:.0f} MB', '; '.join(faults))
        yield from at_the_same_time(peers, plan, stack.enter_context(
            Sender(ROBOT, plan.seed, [full_name(name) for name in names])))  # fmt: skip
        ended = '; '.join(fault for node in nodes if (fault := node.fault()))
        yield Check(f'{what} after all this', 'run', ended)


def at_the_same_time(peers: list[Peer], plan: Plan, sender: Sender) -> Iterator[Check]:
    """Stream to all nodes in turns; look for answers of one node to a target of another."""
    streams = [Stream(peer, plan.seed, client) for client, peer in enumerate(peers)]
    what = f'targets to {len(peers)} nodes at once'
    (sent,) = streams[0].go([sender], what, NODES_RATE, plan.seconds(SECONDS), NODES_JOINT_RATE)
    faults = [f'{peer.name}: {fault}' for client, (peer, stream) in enumerate(zip(peers, streams))
              if (fault := stream.fault_at_end(sent.last[client]))]  # fmt: skip
    solved = [stream.solved() for stream in streams]
    figure = f'{sent.figure()}, {sum(solved)} solved, of each {min(solved)} to {max(solved)}; none by another'
    slow = sent.too_slow(NODES_RATE, NODES_JOINT_RATE)
    yield Check(what, figure, '; '.join(faults) or slow)
