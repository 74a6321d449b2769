"""Targets at 100 to 2000 a second beside joint states at 1000 a second, bursts of 10000 at once, two clients at a
time, subscribers that do not read, and 20 nodes in namespaces of one machine. The newest target wins: some are passed
over where the node or its client is slower, none is solved after a newer one of the same client, and the last one
always is. Rates are those that one Python client reached.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

import numpy as np
import rclpy
from rclpy.qos import HistoryPolicy, QoSProfile

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros import interface
from ros_ik_pkg.tools.processes import ros_node
from torture.peer import SECOND, TIMEOUT, Peer, connected
from torture.plan import Check, Plan, progress, ticking, unless
from torture.running import RunningNode, running_node
from torture.stream import Stream

RATES = (100.0, 500.0, 1000.0, 2000.0)  # Hz
SECONDS = 10.0  # of one rate
BURST = 10_000
NODES = 20
GROWTH = 2.0  # MB during a stretch
MOST_LATENCY = 0.1  # s, 99th percentile; a target takes 0.05 s at most, and one may be under way


def run(plan: Plan) -> Iterator[Check]:
    """Put one node under load, then many nodes."""
    arm = load_arm('puma560')
    with running_node() as node, connected(arm) as peer:
        Stream(peer, plan.seed).go(RATES[1], 5.0)  # warm up
        for rate in RATES:
            yield from at_rate(rate, plan, node, peer)
        yield from burst(plan.count or BURST, node, peer)
        yield from two_clients(plan, node, peer)
        yield from slow_subscribers(plan, node, peer)
    yield from many_nodes(NODES)


def at_rate(rate: float, plan: Plan, node: RunningNode, peer: Peer) -> Iterator[Check]:
    """Stream targets and joint states, and look at order, latency and memory."""
    before, stream = node.usage(), Stream(peer, plan.seed)
    for _ in ticking(plan.seconds(SECONDS), f'{rate:g} Hz'):
        stream.go(rate, 0.5)
    what = f'targets at {rate:g} Hz'
    fault = stream.fault_at_end() or node.fault()
    yield Check(what, stream.figure(), fault)
    p99 = float(np.percentile(peer.latencies(), 99))
    yield Check(f'{what}: latency p99', f'{1e3 * p99:.1f} ms', unless(p99 < MOST_LATENCY, 'too late'))
    growth = node.usage().memory - before.memory
    yield Check(f'{what}: memory growth', f'{growth:.2f} MB', unless(growth < GROWTH, 'it grows'))


def burst(count: int, node: RunningNode, peer: Peer) -> Iterator[Check]:
    """Send many targets as fast as they can be made, and nothing after; the last one must be solved."""
    before = node.usage()
    stream = Stream(peer, 0)
    for _ in progress(range(count), 'burst'):
        stream.send()
    fault = stream.fault_at_end() or node.fault()
    yield Check(f'{count} targets at once', stream.figure(), fault)
    growth = node.usage().memory - before.memory
    yield Check('memory growth by the burst', f'{growth:.2f} MB', unless(growth < GROWTH, 'it grows'))


def two_clients(plan: Plan, node: RunningNode, peer: Peer) -> Iterator[Check]:
    """Stream from two ROS nodes in turns; each sees its own targets in order."""
    other = Peer(rclpy.create_node('second'), peer.arm, first_stamp=10**9 * SECOND)
    other.fault(peer.arm.home)
    streams = [Stream(one, plan.seed) for one in (peer, other)]
    for _ in ticking(plan.seconds(SECONDS), 'two clients'):
        for stream in streams:
            stream.go(200.0, 0.25)
    for name, stream in zip(('first', 'second'), streams):
        fault = stream.fault_at_end() or node.fault()
        yield Check(f'two clients: the {name}', stream.figure(), fault)
    other.node.destroy_node()


def slow_subscribers(plan: Plan, node: RunningNode, peer: Peer) -> Iterator[Check]:
    """Stream while ten subscribers keep all of every topic and never take a message."""
    keep_all, before = QoSProfile(depth=1, history=HistoryPolicy.KEEP_ALL), node.usage()
    context = rclpy.Context()
    context.init()
    idle = rclpy.create_node('idle', context=context)  # nobody spins it
    for topic in interface.TOPICS:
        if topic.direction == 'out':
            idle.create_subscription(topic.type, topic.of(peer.name), lambda message: None, keep_all)
    stream = Stream(peer, plan.seed)
    for _ in ticking(plan.seconds(SECONDS), 'slow subscribers'):
        stream.go(100.0, 0.5)
    fault = stream.fault_at_end() or node.fault()
    yield Check('subscribers that never read', stream.figure(), fault)
    idle.destroy_node()
    context.shutdown()
    growth = node.usage().memory - before.memory
    yield Check('memory growth beside them', f'{growth:.1f} MB', unless(growth < 10 * GROWTH, 'it grows'))


def many_nodes(count: int) -> Iterator[Check]:
    """Run many nodes in namespaces; each answers its own targets, and none of another."""
    names, began = [f'arm{k}' for k in range(count)], time.monotonic()
    with contextlib.ExitStack() as stack:
        nodes = [stack.enter_context(running_node('-r', f'__ns:=/{name}')) for name in progress(names, 'nodes')]
        started, arm = time.monotonic() - began, load_arm('puma560')
        faults = {name: fault for name in progress(names, 'answers') if (fault := _answers(name, arm))}
        memory = sum(node.usage().memory for node in nodes)
        faults |= {node.log.name: node.fault() for node in nodes if node.fault()}
    yield Check(f'{count} nodes in namespaces', f'{started:.0f} s to start, {memory:.0f} MB', str(faults or ''))


def _answers(namespace: str, arm) -> str:
    """Say what is wrong with the answers in a namespace."""
    with ros_node('torture') as node:
        peer = Peer(node, arm, namespace)
        return peer.fault(arm.home + 0.1, TIMEOUT)
