"""The stream of commands over DDS: its gaps, how soon a command obeys a twist, and what it costs."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from geometry_msgs.msg import TwistStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState

from bench.process import ROOT
from bench.published_robots import PANDA, UR5
from ros_ik_pkg.ik import SolveOptions, World, load_arm
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, SERVO_OPTIONS, ServoSettings, Thresholds
from ros_ik_pkg.ros.runtime.spin import make_executor
from ros_ik_pkg.ros.servo import twist_follower
from ros_ik_pkg.ros.servo.contact_ahead import ContactAhead
from ros_ik_pkg.ros.servo.servo import Servo
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand
from ros_ik_pkg.tools import processes
from ros_ik_pkg.tools.domain import own_domain
from ros_ik_pkg.tools.processes import ros_node

STREAM_HEAD = ['rate Hz', 'gaps over two periods %', 'longest gap ms', 'twist to command p50 ms', 'p99 ms',
               'in periods, p50', 'node, % of a core']  # fmt: skip
COST_HEAD = ['arm', 'contact', 'command us', 'of it the solver us', 'solver at 1 kHz, % of a core']
RATES = (100, 500, 1000)  # Hz
STARTS = 40  # twists after standstill, each for a command that obeys it
PUSH, REST = 0.1, 0.5  # s
TIMEOUT = 120.0  # s
MOVED = 1e-12  # rad
SETTINGS = replace(ServoSettings(**{option.name: option.default for option in SERVO_OPTIONS}), command_rate=1000.0)
THRESHOLDS = Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS})
UR5_START = (0.3, -1.2, 1.4, -0.6, 1.0, 0.2)
PANDA_START = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)
SECONDS = 4.0  # of simulated time for the costs


class Hand:
    """A client that sends twists and notes each command: its stamp [s], when it came [s], and its joints (n,)."""

    def __init__(self, node: Node) -> None:
        full_name = f'/{topics.NODE_NAME}'
        twists, solutions, states = topics.TARGET_TWIST, topics.SOLUTION, topics.JOINT_STATES
        self._twists = node.create_publisher(twists.type, twists.of(full_name), twists.qos)
        self._states = node.create_publisher(states.type, states.of(full_name), states.qos)
        node.create_subscription(solutions.type, solutions.of(full_name), self._on_command, 1000)
        self.commands: list[tuple[float, float, np.ndarray]] = []

    def _on_command(self, message: JointState) -> None:
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        self.commands.append((stamp, time.perf_counter(), np.array(message.position)))

    def push(self, z: float) -> None:
        """Send a twist along z [m/s]."""
        message = TwistStamped()
        message.twist.linear.z = z
        self._twists.publish(message)

    def latency(self, spin: Callable[[float], None], z: float) -> float:
        """Push the arm, which stands, and let it come to rest; return how long its first motion took [s]."""
        still, count = self.commands[-1][2], len(self.commands)
        began = time.perf_counter()
        self.push(z)
        while time.perf_counter() < began + PUSH + REST:
            spin(0.001)
        came = (arrived for _, arrived, q in self.commands[count:] if np.abs(q - still).max() > MOVED)
        return next(came, np.nan) - began


def stream_rows() -> list[list[str]]:
    """Return a row for each rate of the stream of a real node."""
    rows = []
    with own_domain(), ros_node('hand') as node:
        executor = make_executor()
        executor.add_node(node)
        for rate in RATES:
            hand = Hand(node)
            words = ('robot:=ur5', 'seed_source:=home', f'command_rate:={rate}.0', 'command_timeout:=0.2')
            arguments = ['--ros-args', *(word for text in words for word in ('-p', text)), '--log-level', 'warn']
            environment = {**os.environ, 'PYTHONPATH': str(ROOT)}
            with processes.running('ros_ik_pkg.ros.ik_node', *arguments, cwd=ROOT, env=environment) as process:
                rows.append(_measure(hand, rate, process, executor.spin_once))
    return rows


def _measure(
    hand: Hand, rate: int, process: subprocess.Popen[bytes], spin: Callable[[float], None]
) -> list[str]:
    """Return the row of one rate."""
    deadline = time.perf_counter() + TIMEOUT
    while len(hand.commands) < rate and time.perf_counter() < deadline:
        hand.push(-0.01 if not hand.commands else 0.0)
        spin(0.02)
    until = time.perf_counter() + 1.0
    while time.perf_counter() < until:
        spin(0.01)
    first, used, began = len(hand.commands), _busy(process.pid), time.perf_counter()
    latencies = np.array([hand.latency(spin, 0.05 * (-1.0) ** k) for k in range(STARTS)])
    share = (_busy(process.pid) - used) / (time.perf_counter() - began)
    gaps = np.diff([stamp for stamp, _, _ in hand.commands[first:]])
    p50, p99 = np.nanpercentile(latencies, [50.0, 99.0])
    return [str(rate), f'{100.0 * np.mean(gaps > 2.0 / rate):.3f}', f'{1e3 * gaps.max():.1f}', f'{1e3 * p50:.2f}',
            f'{1e3 * p99:.2f}', f'{p50 * rate:.2f}', f'{100.0 * share:.0f}']  # fmt: skip


def _busy(process: int) -> float:
    """Return the processor time [s] that a process has used."""
    fields = Path(f'/proc/{process}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def cost_rows() -> list[list[str]]:
    """Return a row for each arm: processor time of a command, and of the solver in it."""
    rows = []
    for name, (urdf, srdf, tip), start in (('panda', PANDA, PANDA_START), ('ur5', UR5, UR5_START)):
        arm = load_arm(urdf, tip=tip, srdf=srdf)
        for contact in (False, True):
            ahead = ContactAhead(arm, arm.contacts.room(World(floor=-0.05)), THRESHOLDS, 0.0) if contact else None
            servo = Servo(arm, SolveOptions(), SETTINGS, THRESHOLDS, 1.0, np.array(start), ahead)
            rows.append([name, 'yes' if contact else 'no', *_cost(servo)])
    return rows


def _cost(servo: Servo) -> list[str]:
    """Return the figures of one servo while it follows a twist up and down."""
    solving, usual = [0.0], twist_follower.solve

    def timed(*arguments):  # type: ignore[no-untyped-def]
        began = time.thread_time()
        solution = usual(*arguments)
        solving[0] += time.thread_time() - began
        return solution

    count = round(SECONDS * SETTINGS.command_rate)
    twist_follower.solve = timed
    try:
        for k in range(2 * count):
            if k == count:  # the first half warms up
                solving[0], began = 0.0, time.thread_time()
            if k % 10 == 0:
                up = 0.05 if k // 500 % 2 else -0.05
                servo.twist(TwistCommand(np.array([0.0, 0.0, up, 0.0, 0.0, 0.0]), np.eye(3)), k * servo.period)
            servo.tick((k + 1) * servo.period)
        command = (time.thread_time() - began) / count
    finally:
        twist_follower.solve = usual
    solver = solving[0] / count
    return [f'{1e6 * command:.0f}', f'{1e6 * solver:.0f}', f'{100.0 * solver * 1000.0:.1f}']
