"""Any target and any joint state that the message types allow: arrays of 0 to 10000, NaN, infinities, denormals, texts
of 100000 characters, names empty, twice and in any script, stamps at the extremes. First to the code that answers
targets, made by hypothesis; then over DDS to a running node, each when the one before was taken: what the node takes is
counted inside it (`torture/counted_node.py`), every target must have its result, and good ones must go on to be solved;
then publishers of the wrong QoS and the wrong type.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from random import Random
from typing import Any

import hypothesis
import rclpy
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rcl_interfaces.msg import Parameter, ParameterValue
from rclpy.clock import ROSClock
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from ros_ik_pkg.ik import Arm, load_arm
from ros_ik_pkg.ros.handling.final_check import fault_of
from ros_ik_pkg.ros.handling.result import SOLVED, Result
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.input.joint_states import JointStates
from ros_ik_pkg.ros.input.target_reader import read_target
from ros_ik_pkg.ros.input.tf_frames import TfFrames
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.interface.parameters import Settings
from ros_ik_pkg.ros.node import LOG_PERIOD
from ros_ik_pkg.ros.output.statuses import result_message
from torture.makers import any_joint_state, any_pose, good_pose
from torture.peer import DEFAULTS, Peer, connected
from torture.plan import Check, Plan, progress, ticking, unless
from torture.running import COUNTED_NODE, JOINT_STATES, TARGETS, RunningNode, running_node

COUNT = 20_000
PATIENCE = 0.5  # s of CPU time for one answer, a joint state of 10000 names included
ENOUGH = 1000  # inputs to see every outcome
SOURCES = 3  # joint states before a target
EVERY = 100  # messages over DDS, then a good target
PAUSE = 0.0005  # s, how often it is looked whether the node took one
LONGEST_PAUSE = 0.1  # s; a joint state may get lost, it is sent with best effort
TAKEN = 0.9  # share of the messages that the node must have taken, or it was not tried with them
WARM_UP = 0.2  # of the messages, before memory is looked at
GROWTH = 16.0  # MB; 64 sources of joint states with 10000 names, and what malloc keeps
LOG_KINDS = 2  # of lines about targets: refused, and not solved
TWO_CLOCKS = 1.01  # the node's log uses the system clock, which is set while it runs
FLOOD_RATE, FLOOD_SECONDS = 1000.0, 5.0  # Hz, s
TOPICS = (topics.TARGET_POSE, topics.JOINT_STATES)
FEW = 50  # messages of an odd publisher
ODD_QOS = {
    'best effort': QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT),
    'transient local': QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL),
    'keep all': QoSProfile(depth=1, history=HistoryPolicy.KEEP_ALL),
    'depth 10000': QoSProfile(depth=10000),
}


def run(plan: Plan) -> Iterator[Check]:
    """Fuzz the message layer, then the node."""
    arm, count = load_arm('puma560'), plan.count or COUNT
    fault = fuzz_layer(plan.seed, count, arm)
    yield Check('inputs to the message layer, each answered with a reason', str(count), fault)
    with running_node(program=COUNTED_NODE) as node, connected(arm) as peer:
        yield from fuzz_node(plan.seed, count, node, peer)
        yield from odd_qos(node, peer)
        yield wrong_type(node, peer)
        yield flood(plan.seconds(FLOOD_SECONDS), node, peer)


def fuzz_layer(seed: int, count: int, arm: Arm) -> str:
    """Handle messages made by hypothesis; return the smallest failure."""
    settings_without_tf = Settings.from_values({**DEFAULTS, 'tf_timeout': 0.0})
    outcomes: Counter[str] = Counter()

    @hypothesis.seed(seed)
    @settings(
        max_examples=count, deadline=None, database=None, suppress_health_check=list(HealthCheck),
        report_multiple_bugs=False,
    )  # fmt: skip
    @given(st.randoms())
    def answers_whatever_comes(random: Random) -> None:
        handler = TargetHandler(ROSClock(), TfFrames(None), JointStates(), str)  # no node, because TF is not asked
        handler.take_over(settings_without_tf, arm)
        for _ in range(random.randint(1, SOURCES)):
            handler.joint_states.keep(any_joint_state(random, arm.joint_names))
        pose = any_pose(random, good_pose(arm), arm.frame_names)
        began = time.thread_time()
        result = handler.handle(read_target(serialize_message(pose)), trace=False)
        assert time.thread_time() - began < PATIENCE, f'{time.thread_time() - began} s'
        assert not (fault := fault_in(result, handler)), fault
        outcomes[result.outcome] += 1

    try:
        answers_whatever_comes()
    except Exception as error:
        return f'{type(error).__name__}: {error}; {getattr(error, "exceptions", "")}'
    return unless(len(outcomes) == 3 or count < ENOUGH, f'only {dict(outcomes)}: what was tried?')


def fault_in(result: Result, handler: TargetHandler) -> str:
    """Return the fault of a result: no reason, a wrong solution, or a message that cannot be serialised."""
    result_message(result, 'torture')
    if not result.reason or not result.status or result.status == 'internal_error':
        return f'{result.outcome} because of {result.status!r}: {result.reason!r}'
    if result.outcome != SOLVED:
        return ''
    return fault_of(result.solution.q, result.base_from_target, result.arm, handler.settings.options)


def fuzz_node(seed: int, count: int, node: RunningNode, peer: Peer) -> Iterator[Check]:
    """Send both kinds of messages to the node, and good targets in between."""
    random, warm = Random(seed), 0.0
    peer.forget()
    began, fault = time.monotonic(), peer.fault(peer.arm.home) or node.fault()
    before = node.lines()  # of earlier targets, which are all finished
    taken = Taken(node, peer)
    for number in progress(range(count), 'messages over DDS'):
        if number % EVERY == EVERY - 1 and (fault := fault or peer.fault(peer.arm.home) or node.fault()):
            break
        if number == int(WARM_UP * count):
            warm = node.usage().memory
        taken.send(random)
    fault = fault or peer.fault(peer.arm.home) or node.fault()
    yield Check('messages over DDS; good targets between them solved, crashes 0, hangs 0', str(count), fault)
    yield from taken.checks()
    if not fault:
        growth = node.usage().memory - warm
        yield Check('memory growth after the first fifth', f'{growth:.1f} MB', unless(growth < GROWTH, f'{growth} MB'))
        lines, seconds = node.lines() - before, time.monotonic() - began
        yield Check('lines in the log', f'{lines / seconds:.1f} a second', too_many(lines, seconds))


class Taken:
    """Sends one message after the other, the next when the node has taken the one before, and counts."""

    def __init__(self, node: RunningNode, peer: Peer) -> None:
        self._node, self._peer = node, peer
        self._sent, self._taken, self._answered = Counter(), Counter(), 0

    def send(self, random: Random) -> None:
        """Send a joint state or a target unchanged, stamp included."""
        peer, before, heard = self._peer, self._node.taken(), self._peer.heard
        place = JOINT_STATES if random.random() < 0.5 else TARGETS
        if place == JOINT_STATES:
            peer.joint_states.publish(any_joint_state(random, peer.arm.joint_names))
        else:
            peer.targets.publish(any_pose(random, good_pose(peer.arm), peer.arm.frame_names))
        end = time.monotonic() + LONGEST_PAUSE
        while self._node.taken()[place] == before[place] and time.monotonic() < end:
            peer.spin(PAUSE)
        self._sent[place] += 1
        self._taken[place] += self._node.taken()[place] > before[place]
        if place == TARGETS:
            peer.wait(lambda: peer.heard > heard, LONGEST_PAUSE)
            self._answered += peer.heard > heard

    def checks(self) -> Iterator[Check]:
        """Report how many messages the node received."""
        for place, what in ((TARGETS, 'targets'), (JOINT_STATES, 'joint states')):
            sent, taken = self._sent[place], self._taken[place]
            figure = f'{taken} of {sent}' + f', {self._answered} with a result' * (place == TARGETS)
            fault = unless(taken >= TAKEN * sent, 'too few') or unless(
                place != TARGETS or self._answered >= TAKEN * sent, 'too few results'
            )
            yield Check(f'{what} that the node took', figure, fault)


def too_many(lines: int, seconds: float) -> str:
    """Say whether the log got more than the node promises: one line of a kind at once, and one more in each period."""
    most = LOG_KINDS * (1.0 + TWO_CLOCKS * seconds / LOG_PERIOD)
    return unless(lines <= most, f'{lines} lines in {seconds:.2f} s, {most:.1f} at most')


def flood(seconds: float, node: RunningNode, peer: Peer) -> Check:
    """Send refused inputs at 1000 Hz; the log must stay small."""
    began, fault = time.monotonic(), peer.fault(peer.arm.home)
    size, lines, sent = node.log.stat().st_size, node.lines(), 0
    bad, change = good_pose(peer.arm), Parameter(name='method', value=ParameterValue(type=4, string_value='x' * 1000))
    bad.header.frame_id = 'no\nsuch frame' * 1000
    for elapsed in ticking(seconds, 'flood'):
        if sent < FLOOD_RATE * elapsed:
            peer.joint_states.publish(JointState(name=['a', 'a'], position=[0.0]))
            peer.targets.publish(bad)
            peer.send_unanswered([change] if sent % 10 == 0 else [])
            sent += 1
        peer.spin_once()
    lines, size, seconds = node.lines() - lines, node.log.stat().st_size - size, time.monotonic() - began
    fault = fault or peer.fault(peer.arm.home) or node.fault() or too_many(lines, seconds)
    what = f'refused targets at {sent / seconds:.0f} Hz, with bad joint states and refused parameters: the log'
    return Check(what, f'{lines / seconds:.1f} lines and {size / seconds / 1000:.1f} kB a second', fault)


def odd_qos(node: RunningNode, peer: Peer) -> Iterator[Check]:
    """Publish targets and joint states with other QoS than the node's."""
    for name, qos in ODD_QOS.items():
        fault = _beside([(topic, topic.type, qos) for topic in TOPICS], node, peer)
        yield Check(f'publishers with QoS {name}', str(len(TOPICS)), fault)


def wrong_type(node: RunningNode, peer: Peer) -> Check:
    """Publish texts on the topics of targets and joint states."""
    fault = _beside([(topic, String, topic.qos) for topic in TOPICS], node, peer)
    return Check('publishers of another type', str(len(TOPICS)), fault)


def _beside(kinds: list[tuple[topics.Topic, Any, QoSProfile]], node: RunningNode, peer: Peer) -> str:
    """Publish empty messages from a separate participant while good targets are sent; return the fault."""
    context = rclpy.Context()
    context.init()
    other = rclpy.create_node('odd', context=context)
    publishers = [other.create_publisher(kind, topic.of(peer.name), qos) for topic, kind, qos in kinds]
    for _ in range(FEW):
        for publisher in publishers:
            publisher.publish(publisher.msg_type())
        peer.spin(0.02)
    fault = peer.fault(peer.arm.home) or node.fault()
    other.destroy_node()
    context.shutdown()
    return fault
