"""Keys to twists, and the program in a terminal of its own against a stand-in of the node."""

from __future__ import annotations

import contextlib
import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.executors import SingleThreadedExecutor
from ros_helpers import TIMEOUT, allow_lark
from std_srvs.srv import SetBool

from ros_ik_pkg.ros.interface.topics import PAUSE, SERVO_STATUS, TARGET_TWIST
from ros_ik_pkg.tools.processes import ros_node
from ros_ik_pkg.tools.teleop import FADE, HELD, KEYS, SPEEDS, Teleop

ROOT = Path(__file__).resolve().parents[2]
STAND_IN = '/stand_in'


def test_every_direction_has_a_key():
    twists = []
    for key in KEYS:
        teleop = Teleop(0.1, 0.5)
        teleop.press(key, 0.0)
        twists.append(tuple(teleop.twist(0.01)))
    assert len(set(twists)) == 12
    assert {np.count_nonzero(twist) for twist in twists} == {1}
    assert {abs(sum(twist)) for twist in twists} == {0.1, 0.5}


def test_a_key_moves_the_arm_while_it_is_held_then_stops_it_then_says_nothing():
    teleop = Teleop(0.1, 0.5)
    assert teleop.twist(0.0) is None
    teleop.press('w', 1.0)
    assert teleop.twist(1.0 + 0.9 * HELD)[0] == 0.1
    assert not teleop.twist(1.0 + 1.1 * HELD).any()
    assert teleop.twist(1.0 + HELD + 1.1 * FADE) is None


@pytest.mark.parametrize('key', [' ', 'p', 't', '?'])
def test_every_other_key_stops_the_motion(key):
    teleop = Teleop(0.1, 0.5)
    teleop.press('w', 0.0)
    teleop.press(key, 0.01)
    assert not teleop.twist(0.02).any()


def test_speeds_change_together_within_bounds():
    teleop = Teleop(0.1, 0.5)
    teleop.press('+', 0.0)
    assert teleop.linear > 0.1 and teleop.angular == pytest.approx(5.0 * teleop.linear)
    for _ in range(50):
        teleop.press('-', 0.0)
    assert teleop.linear == SPEEDS[0]


def test_the_screen_shows_the_keys_the_speed_the_axes_and_what_the_arm_does():
    teleop = Teleop(0.1, 0.5)
    teleop.press('t', 0.0)
    teleop.press('p', 0.0)
    text = '\n'.join(teleop.lines('halted: paused'))
    assert all(f' {key} ' in f' {text} '.replace('\n', ' ') for key in KEYS)
    assert '0.100 m/s' in text and 'axes of the tip' in text and 'paused' in text


@allow_lark
@pytest.mark.newest
def test_in_a_terminal_keys_become_twists_and_calls_and_q_ends_it():
    twists, pauses = [], []

    def on_pause(request, response):
        pauses.append(request.data)
        response.success = True
        return response

    with ros_node('stand_in') as node:
        node.create_subscription(TARGET_TWIST.type, TARGET_TWIST.of(STAND_IN), twists.append, TARGET_TWIST.qos)
        node.create_service(SetBool, STAND_IN + PAUSE[1:], on_pause)
        status = DiagnosticStatus(message='stands', values=[KeyValue(key='tip_frame', value='tool')])
        publisher = node.create_publisher(SERVO_STATUS.type, SERVO_STATUS.of(STAND_IN), SERVO_STATUS.qos)
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        ours, theirs = pty.openpty()
        process = subprocess.Popen(
            [sys.executable, '-m', 'ros_ik_pkg.tools.teleop', '--node', STAND_IN], cwd=ROOT,
            stdin=theirs, stdout=theirs, env=os.environ | {'TERM': 'xterm'},
        )  # fmt: skip
        os.set_blocking(ours, False)
        try:

            def until(condition, key: str) -> None:
                deadline = time.monotonic() + TIMEOUT
                while not condition():
                    assert process.poll() is None and time.monotonic() < deadline
                    os.write(ours, key.encode())
                    publisher.publish(DiagnosticArray(status=[status]))
                    executor.spin_once(timeout_sec=0.1)
                    with contextlib.suppress(BlockingIOError):
                        os.read(ours, 65536)

            until(lambda: any(twist.twist.linear.y > 0.0 for twist in twists), 'a')
            assert twists[-1].header.frame_id == ''
            until(lambda: pauses, 'p')
            twists.clear()
            os.write(ours, b't')
            until(lambda: any(twist.header.frame_id == 'tool' and twist.twist.angular.z < 0.0 for twist in twists), 'l')
            os.write(ours, b'q')
            assert process.wait(TIMEOUT) == 0
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGKILL)
                process.wait()
            os.close(ours)
            os.close(theirs)


def test_without_a_terminal_it_says_so():
    done = subprocess.run(
        [sys.executable, '-m', 'ros_ik_pkg.tools.teleop'], cwd=ROOT, stdin=subprocess.DEVNULL, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1 and 'terminal' in done.stderr
