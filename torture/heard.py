"""Easy targets, targets that take longer than they arrive, and targets in a frame that TF never has, each at 12, 20, 50
and 1000 Hz. Meanwhile a parameter is set again and again, which takes half a second at most, and `/diagnostics` is
never silent for longer than 1.2 s; its rates are no higher than what was sent. If the real tf2 is not installed, it is
the stand-in of the tests.
"""

from __future__ import annotations

import importlib.util
import os
import threading
import time
from collections.abc import Iterator

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from bench.process import ROOT
from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.interface import topics
from torture.peer import Peer, connected
from torture.plan import Check, Plan, ticking, unless
from torture.running import RunningNode, running_node

ROBOT = 'puma560'
RATES = (12.0, 20.0, 50.0, 1000.0)  # Hz
SECONDS = 10.0  # of one rate
SETTLE = 1.5  # s: the report that is under way is about the stretch before
MOST_FOR_PARAMETER, MOST_SILENCE = 0.5, 1.2  # s
ROUNDING = 1.1, 2.0  # of a rate, and targets: a report counts whole targets, and arrivals bunch up
MOST_SLOW = 20.0  # Hz: targets that take until the deadline of 0.05 s
EASY = {'seed_source': 'home'}
NO_CLOSED_FORM = {'task_tolerances': [0.0, 0.0, 0.0, 0.0, 0.0, 1e-3]}
SLOW = EASY | NO_CLOSED_FORM | {'method': 'dls', 'dls.damping': 100.0, 'max_iterations': 100000}  # until the deadline
LOADS = {'easy targets': (EASY, ''), 'slow targets': (SLOW, ''), 'TF that does not come': (EASY, 'nowhere')}


def run(plan: Plan) -> Iterator[Check]:
    """Put one node under each load, at each rate."""
    path = [str(ROOT / 'test' / 'tf2_stand_in')] if importlib.util.find_spec('tf2_ros') is None else []
    os.environ['PYTHONPATH'] = os.pathsep.join([*path, str(ROOT)])
    with running_node(PYTHONPATH=os.environ['PYTHONPATH']) as node, connected(load_arm(ROBOT)) as peer:
        reports = Reports(peer)
        for what, (values, frame) in LOADS.items():
            for rate in RATES:
                fault = peer.set_defaults() or peer.set_values(values)
                load, seconds = f'{what} at {rate:g} Hz', plan.seconds(SECONDS)
                most = min(rate, MOST_SLOW) if values is SLOW else rate
                yield under_load(load, frame, rate, most, seconds, peer, reports, node, fault)


class Reports:
    """When each report on /diagnostics came [s], and how many targets a second it tells of."""

    def __init__(self, peer: Peer) -> None:
        self.times: list[float] = []
        self.rates: list[float] = []
        topic = topics.DIAGNOSTICS
        peer.node.create_subscription(topic.type, topic.name, self._note, topic.qos)

    def _note(self, message: DiagnosticArray) -> None:
        status: DiagnosticStatus = message.status[0]
        self.times.append(time.monotonic())
        self.rates += [float(pair.value) for pair in status.values if pair.key == 'targets_per_second']


class Targets:
    """Sends one target at a rate [Hz] from a thread of its own."""

    def __init__(self, peer: Peer, frame: str, rate: float) -> None:
        self._peer, self._rate, self._stop = peer, rate, threading.Event()
        self._pose = peer.pose(peer.arm.home + 0.1)
        self._pose.header.frame_id = frame
        self._thread = threading.Thread(target=self._send)

    def __enter__(self) -> Targets:
        """Begin to send."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop sending."""
        self._stop.set()
        self._thread.join()

    def _send(self) -> None:
        began, count = time.monotonic(), 0
        while not self._stop.wait(max(began + count / self._rate - time.monotonic(), 0.0)):
            self._peer.targets.publish(self._pose)
            count += 1


def under_load(
    what: str,
    frame: str,
    rate: float,
    possible: float,
    seconds: float,
    peer: Peer,
    reports: Reports,
    node: RunningNode,
    fault: str,
) -> Check:
    """Set a parameter again and again while targets come, and look at how long that and the reports take.

    possible: how many targets a second [Hz] can be answered.
    """
    answers, number = [], 1
    with Targets(peer, frame, rate):
        peer.spin(SETTLE)
        reports.times.clear()
        reports.rates.clear()
        began = time.monotonic()
        for _ in ticking(seconds, what):
            asked, number = time.monotonic(), number + 1
            fault = fault or peer.set_values({'trajectory_time': 0.001 * number})
            answers.append(time.monotonic() - asked)
            peer.spin(0.2)
        silence = float(np.diff([began, *reports.times, time.monotonic()]).max())
    most = max(reports.rates, default=0.0)
    faults = [
        fault,
        unless(max(answers) <= MOST_FOR_PARAMETER, 'a parameter took too long'),
        unless(silence <= MOST_SILENCE, '/diagnostics was silent'),
        unless(most <= ROUNDING[0] * possible + ROUNDING[1], 'rates that cannot be'),
        node.fault(),
    ]
    figure = f'parameter at most {max(answers):.2f} s, silence at most {silence:.2f} s, up to {most:g} targets a second'
    return Check(what, figure, '; '.join(filter(None, faults)))
