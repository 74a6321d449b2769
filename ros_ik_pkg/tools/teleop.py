"""Move the tip of the arm by keys: sends twists to the running IK node while a key is held down."""

from __future__ import annotations

import argparse
import curses
import sys
import time
from collections.abc import Callable

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import SetBool

from ros_ik_pkg.ros.interface.topics import NODE_NAME, PAUSE, SERVO_STATUS, TARGET_TWIST
from ros_ik_pkg.ros.reply import values
from ros_ik_pkg.ros.runtime.node_names import full_name
from ros_ik_pkg.tools.processes import ros_node

PERIOD = 0.02  # s between two twists
HELD = 0.25  # s for which a key counts as held after the terminal sent it; a terminal tells no release
FADE = 0.5  # s for which zeros are sent after a key, so that the arm stops because it is told to
KEYS = {
    'w': (0, 1), 's': (0, -1), 'a': (1, 1), 'd': (1, -1), 'r': (2, 1), 'f': (2, -1),
    'u': (3, 1), 'o': (3, -1), 'i': (4, 1), 'k': (4, -1), 'j': (5, 1), 'l': (5, -1),
}  # fmt: skip
HELP = (
    'w s   along x        u o   about x',
    'a d   along y        i k   about y',
    'r f   along z        j l   about z',
    '+ -   speed          t     axes of the base or of the tip',
    'p     pause          space stop          q  quit',
)
FASTER = 1.25
SPEEDS = 0.005, 1.0  # m/s


class Teleop:
    """What keys mean: a twist while one is held, its speed, and its axes."""

    def __init__(self, linear: float, angular: float) -> None:
        """linear, angular: the speeds to begin with [m/s, rad/s]."""
        self.linear, self._radians_per_metre = linear, angular / linear
        self.in_tip_axes = self.paused = self.ended = False
        self._key, self._pressed = '', -np.inf

    @property
    def angular(self) -> float:
        """Speed of turns [rad/s]."""
        return self.linear * self._radians_per_metre

    def press(self, key: str, now: float) -> None:
        """Take a key at a time [s]."""
        if key in KEYS:
            self._key, self._pressed = key, now
        elif key in ('+', '=', '-'):
            faster = FASTER if key != '-' else 1.0 / FASTER
            self.linear = float(np.clip(self.linear * faster, *SPEEDS))
        elif key == 't':
            self.in_tip_axes = not self.in_tip_axes
        elif key == 'p':
            self.paused = not self.paused
        elif key == 'q':
            self.ended = True
        if key not in KEYS:
            self._key = ''

    def twist(self, now: float) -> np.ndarray | None:
        """Return the twist (6,) [m/s, rad/s] to send at a time [s]; None for none."""
        if now - self._pressed > HELD + FADE:
            return None
        twist = np.zeros(6)
        if self._key and now - self._pressed <= HELD:
            axis, sign = KEYS[self._key]
            twist[axis] = sign * (self.linear if axis < 3 else self.angular)
        return twist

    def lines(self, status: str) -> list[str]:
        """Return what the screen shows."""
        axes = 'tip' if self.in_tip_axes else 'base'
        return [
            *HELP,
            '',
            f'speed {self.linear:.3f} m/s, {self.angular:.3f} rad/s   axes of the {axes}' + '   paused' * self.paused,
            status,
        ]


class Link:
    """The topics and the service of the IK node that teleop uses."""

    def __init__(self, node: Node, name: str) -> None:
        target = full_name(name, node)
        self.status, self._tip_frame = f'no word of {target} yet: is its command_rate above 0?', ''
        self._clock = node.get_clock()
        self._twists = node.create_publisher(TARGET_TWIST.type, TARGET_TWIST.of(target), TARGET_TWIST.qos)
        self._pause = node.create_client(SetBool, f'{target}{PAUSE[1:]}')
        node.create_subscription(SERVO_STATUS.type, SERVO_STATUS.of(target), self._on_status, SERVO_STATUS.qos)

    def send(self, twist: np.ndarray, in_tip_axes: bool) -> None:
        """Send a twist (6,) [m/s, rad/s], as soon as the name of the tip frame is known if it is in its axes."""
        if in_tip_axes and not self._tip_frame:
            return
        message = TwistStamped()
        message.header.stamp = self._clock.now().to_msg()
        message.header.frame_id = self._tip_frame if in_tip_axes else ''
        linear, angular = message.twist.linear, message.twist.angular
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = twist.tolist()
        self._twists.publish(message)

    def pause(self, paused: bool) -> None:
        """Ask the node to pause, or to go on."""
        self._pause.call_async(SetBool.Request(data=paused))

    def _on_status(self, message: DiagnosticArray) -> None:
        self.status = message.status[0].message
        self._tip_frame = values(message.status[0])['tip_frame']


def drive(teleop: Teleop, link: Link, read_keys: Callable[[], list[str]], show: Callable[[list[str]], None]) -> None:
    """Send, once, what the keys mean at this moment."""
    now, paused = time.monotonic(), teleop.paused
    for key in read_keys():
        teleop.press(key, now)
    if teleop.paused != paused:
        link.pause(teleop.paused)
    twist = teleop.twist(now)
    if twist is not None:
        link.send(twist, teleop.in_tip_axes)
    show(teleop.lines(link.status))


def run(window: curses.window, node: Node, given: argparse.Namespace) -> None:
    """Drive from a window of curses until the user quits."""
    window.nodelay(True)

    def read_keys() -> list[str]:
        keys = []
        while (code := window.getch()) != curses.ERR:
            keys.append(chr(code) if 0 <= code < 128 else '')
        return keys

    def show(lines: list[str]) -> None:
        window.erase()
        height, width = window.getmaxyx()
        for row, line in enumerate(lines[:height]):
            window.addnstr(row, 0, line, width - 1)
        window.refresh()

    teleop, link, executor = Teleop(given.linear, given.angular), Link(node, given.node), SingleThreadedExecutor()
    executor.add_node(node)
    while not teleop.ended:
        until = time.monotonic() + PERIOD
        drive(teleop, link, read_keys, show)
        while (left := until - time.monotonic()) > 0.0:
            executor.spin_once(timeout_sec=left)


def arguments() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(prog='teleop', description=__doc__)
    parser.add_argument('--linear', type=_speed, default=0.1, help='speed to begin with, m/s (default: %(default)s)')
    parser.add_argument('--angular', type=_speed, default=0.5, help='and of turns, rad/s (default: %(default)s)')
    parser.add_argument('--node', default=NODE_NAME, help='name of the node (default: %(default)s)')
    return parser


def _speed(text: str) -> float:
    value = float(text)
    if not 0.0 < value <= 10.0:
        raise argparse.ArgumentTypeError(f'{text} is not allowed: expected a number above 0, at most 10')
    return value


def main() -> int:
    """Drive until q or Ctrl-C; 1 if there is no terminal or the name is none."""
    given = arguments().parse_args()
    if not sys.stdin.isatty():
        print('teleop: keys are read from a terminal, and this is none', file=sys.stderr)
        return 1
    try:
        with ros_node('teleop') as node:
            curses.wrapper(run, node, given)
    except ValueError as error:
        print(f'teleop: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == '__main__':
    sys.exit(main())
