"""The stream of commands over DDS: its gaps, how soon a command obeys a twist beside a pose without a stream, and what
it costs."""

from __future__ import annotations

import math
import os
import subprocess
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pinocchio as pin
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState

from bench.process import ROOT
from bench.published_robots import PANDA, UR5
from ros_ik_pkg.ik import Arm, SolveOptions, World, load_arm
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

STREAM_HEAD = ['rate Hz', 'commands', 'gaps over two periods %', 'longest gap ms', 'pose p50 ms', 'twist p50 ms',
               'twist p99 ms', 'twist over pose, in periods', 'node, % of a core']  # fmt: skip
COST_HEAD = ['arm', 'contact', 'command us', 'of it the solver us', 'solver at 1 kHz, % of a core']
RATES = (100, 500, 1000)  # Hz
STARTS = 40  # twists after standstill, each for a command that obeys it
PUSH, REST = 0.1, 0.5  # s
HANDLING, HAND_RATE, TURN = 30.0, 100.0, 2.0  # s of twists and poses in turns, Hz, s of each
TIMEOUT = 120.0  # s
MOVED = 1e-12  # rad
AIM = (-0.1, 0.0, -0.1)  # m, from home to the poses
SWING, RHYTHM = 0.03, 3.0  # m, rad/s
SETTINGS = replace(ServoSettings(**{option.name: option.default for option in SERVO_OPTIONS}), command_rate=1000.0)
THRESHOLDS = Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS})
UR5_START = (0.3, -1.2, 1.4, -0.6, 1.0, 0.2)
PANDA_START = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)
SECONDS = 4.0  # of simulated time for the costs


class Hand:
    """A client that commands one node and notes each command of it: stamp [s], when it came [s], and joints (n,)."""

    def __init__(self, node: Node, full_name: str) -> None:
        twists, poses, solutions = topics.TARGET_TWIST, topics.TARGET_POSE, topics.SOLUTION
        self._twists = node.create_publisher(twists.type, twists.of(full_name), twists.qos)
        self._poses = node.create_publisher(poses.type, poses.of(full_name), poses.qos)
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

    def aim(self, base_from_tip: np.ndarray, z: float) -> None:
        """Send a pose (4, 4), moved along z [m]."""
        message = PoseStamped()
        position, turn = message.pose.position, message.pose.orientation
        position.x, position.y, position.z = (base_from_tip[:3, 3] + (0.0, 0.0, z)).tolist()
        turn.x, turn.y, turn.z, turn.w = pin.Quaternion(base_from_tip[:3, :3]).coeffs().tolist()
        self._poses.publish(message)

    def latency(self, spin: Callable[[float], None], send: Callable[[], None]) -> float:
        """Send something to an arm that stands, and let it come to rest; return how long its first motion took [s]."""
        still, count = self.commands[-1][2], len(self.commands)
        began = time.perf_counter()
        send()
        while time.perf_counter() < began + PUSH + REST:
            spin(0.001)
        came = (arrived for _, arrived, q in self.commands[count:] if np.abs(q - still).max() > MOVED)
        return next(came, np.nan) - began


def stream_rows() -> list[list[str]]:
    """Return a row for each rate of the stream of a real node, beside a node without a stream."""
    rows, arm = [], load_arm('ur5')
    with own_domain(), ros_node('hand') as node, _node('/today', 0):
        executor = make_executor()
        executor.add_node(node)
        today = Hand(node, f'/today/{topics.NODE_NAME}')
        for rate in RATES:
            hand = Hand(node, f'/stream_{rate}/{topics.NODE_NAME}')
            with _node(f'/stream_{rate}', rate) as process:
                rows.append(_measure(hand, today, arm, rate, process, executor.spin_once))
    return rows


def _node(namespace: str, rate: int) -> AbstractContextManager[subprocess.Popen[bytes]]:
    """Run a node in a namespace with a rate of its stream [Hz]."""
    words = ('robot:=ur5', 'seed_source:=last_solution', f'command_rate:={rate}.0', 'command_timeout:=0.2')
    arguments = ['--ros-args', *(word for text in words for word in ('-p', text)), '-r', f'__ns:={namespace}',
                 '--log-level', 'warn']  # fmt: skip
    environment = {**os.environ, 'PYTHONPATH': str(ROOT)}
    return processes.running('ros_ik_pkg.ros.ik_node', *arguments, cwd=ROOT, env=environment)


def _measure(
    hand: Hand, today: Hand, arm: Arm, rate: int, process: subprocess.Popen[bytes], spin: Callable[[float], None]
) -> list[str]:
    """Return the row of one rate."""
    base_from_tip = arm.forward(arm.home)
    base_from_tip[:3, 3] += AIM
    deadline = time.perf_counter() + TIMEOUT
    while (len(hand.commands) < rate or not today.commands) and time.perf_counter() < deadline:
        today.aim(base_from_tip, 0.0)
        if hand.commands:
            hand.push(0.0)
        else:
            hand.aim(base_from_tip, 0.0)
        spin(0.02)
    _handle(hand, base_from_tip, spin, 2.0)
    first, used, began = len(hand.commands), _busy(process.pid), time.perf_counter()
    _handle(hand, base_from_tip, spin, HANDLING)
    share = (_busy(process.pid) - used) / (time.perf_counter() - began)
    twists, poses = [], []
    for k in range(STARTS):
        way = 0.05 * (-1.0) ** k
        twists.append(hand.latency(spin, partial(hand.push, way)))
        poses.append(today.latency(spin, partial(today.aim, base_from_tip, 0.1 * way)))
    gaps = np.diff([stamp for stamp, _, _ in hand.commands[first:]])
    (p50, p99), pose = np.nanpercentile(twists, [50.0, 99.0]), np.nanmedian(poses)
    return [str(rate), str(len(gaps)), f'{100.0 * np.mean(gaps > 2.0 / rate):.3f}', f'{1e3 * gaps.max():.1f}',
            f'{1e3 * pose:.2f}', f'{1e3 * p50:.2f}', f'{1e3 * p99:.2f}', f'{(p50 - pose) * rate:.2f}',
            f'{100.0 * share:.0f}']  # fmt: skip


def _handle(hand: Hand, base_from_tip: np.ndarray, spin: Callable[[float], None], seconds: float) -> None:
    """Send twists and poses in turns for a while, up and down."""
    began, sent = time.perf_counter(), 0
    while (now := time.perf_counter() - began) < seconds:
        if now * HAND_RATE >= sent:
            sent += 1
            if int(now / TURN) % 2:
                hand.push(SWING * RHYTHM * math.cos(RHYTHM * now))
            else:
                hand.aim(base_from_tip, SWING * math.sin(RHYTHM * now))
        spin(0.001)


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
