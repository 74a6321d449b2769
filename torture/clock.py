"""Simulated time that starts, stops, jumps back and jumps ahead, and the reaction of the node."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from rosgraph_msgs.msg import Clock

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ros.handling.result import REFUSED, SOLVED
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.reply import values
from torture.peer import SECOND, Peer, connected
from torture.plan import Check, unless
from torture.running import running_node

TIMEOUT_OF_TARGETS, LONGEST_STEP = 0.5, 0.1  # s, parameters of the node
WORDS = ('-p', 'use_sim_time:=true', '-p', 'seed_source:=last_solution', '-p', 'velocity_limiting:=whole',
         '-p', f'max_step_time:={LONGEST_STEP}')  # fmt: skip
FAR = 1.0  # rad; no step leads there
OFF = 1.0  # s, how much the stamps of targets are off that must be refused
SMALL = 1e-6  # s


class Moment(NamedTuple):
    """A time [s] that the clock has, and the time [s] that the next limited step counts then."""

    what: str
    time: float
    step_time: float


MOMENTS = (
    Moment('begins', 100.0, LONGEST_STEP),
    Moment('stands still', 100.0, 0.0),
    Moment('runs', 100.05, 0.05),
    Moment('jumps back', 50.0, LONGEST_STEP),
    Moment('stands still there', 50.0, 0.0),
    Moment('leaps', 1e9, LONGEST_STEP),
    Moment('is at zero', 0.0, LONGEST_STEP),
)


def clock_jumps(arm: Arm) -> Iterator[Check]:
    """Send targets whose stamps are now, early and late, whatever the time is; steps are limited by it as well."""
    with running_node(*WORDS) as node, connected(arm) as peer:
        clock = SimulatedClock(peer)
        peer.set_values({'target_timeout': TIMEOUT_OF_TARGETS})
        goals = [peer.pose(arm.home + sign * FAR) for sign in (0.3, -0.3)]
        for number, moment in enumerate(MOMENTS):
            fault = clock.set(moment.time) or _fault_at(moment, clock, goals[number % 2]) or node.fault()
            figure = f'a step of {moment.step_time:g} s; stamps {OFF:g} s off refused'
            yield Check(f'/clock {moment.what}: {moment.time:g} s', figure, fault)


def _fault_at(moment: Moment, clock: SimulatedClock, goal: PoseStamped) -> str:
    """Return the fault in the results for targets stamped at a time, a second before and a second after."""
    now = clock.ask(goal, moment.time)
    if now.get('outcome') != SOLVED:
        return f'a target of now: {now}'
    if abs(float(now['step_time']) - moment.step_time) > SMALL:
        return f'a step of {now["step_time"]} s'
    return _refusal(clock.ask(goal, moment.time + OFF), 'future') or (
        _refusal(clock.ask(goal, moment.time - OFF), 'stale') if moment.time >= OFF else ''
    )


def _refusal(answer: dict[str, str], cause: str) -> str:
    right = answer.get('outcome') == REFUSED and answer.get('status') == cause
    return unless(right, f'not refused as {cause}: {answer}')


class SimulatedClock:
    """Publishes /clock and checks the reaction of the node."""

    def __init__(self, peer: Peer) -> None:
        self._peer, self._publisher = peer, peer.node.create_publisher(Clock, '/clock', 10)
        self._heard: set[int] = set()  # times [ns] that the node had when it reported its health
        self._results: dict[int, dict[str, str]] = {}
        self._number = 0
        for topic, callback in ((topics.DIAGNOSTICS, self._on_health), (topics.RESULT, self._on_result)):
            peer.node.create_subscription(DiagnosticArray, topic.of(peer.name), callback, topic.qos)

    def _on_health(self, message: DiagnosticArray) -> None:
        self._heard.add(_nanoseconds(message))

    def _on_result(self, message: DiagnosticArray) -> None:
        self._results[_nanoseconds(message)] = values(message.status[0])

    def set(self, time: float) -> str:
        """Set the clock and wait until the node has it; say if it never does."""
        stamp = _stamp(round(time * SECOND))
        self._heard.clear()
        heard = self._peer.wait(
            lambda: self._publisher.publish(Clock(clock=stamp)) or round(time * SECOND) in self._heard
        )
        return unless(heard, f'the node never had this time, but {sorted(self._heard)}')

    def ask(self, goal: PoseStamped, time: float) -> dict[str, str]:
        """Send a target with the stamp of a time [s], a few nanoseconds more to know it by; return its result."""
        self._number += 1
        stamp = round(time * SECOND) + self._number
        goal.header.stamp = _stamp(stamp)
        self._peer.targets.publish(goal)
        self._peer.wait(lambda: stamp in self._results)
        return self._results.get(stamp, {})


def _stamp(nanoseconds: int) -> Time:
    sec, nanosec = divmod(nanoseconds, SECOND)
    return Time(sec=sec, nanosec=nanosec)


def _nanoseconds(message: DiagnosticArray) -> int:
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec
