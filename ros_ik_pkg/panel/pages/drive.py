"""The folder *Drive*: the gizmo of the target pulls the arm by twists, and the stream of commands is drawn."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TwistStamped
from rclpy.subscription import Subscription

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.panel.answers import values_of
from ros_ik_pkg.panel.commands import Commands
from ros_ik_pkg.panel.markup.commands_html import commands_html, stream_html
from ros_ik_pkg.panel.markup.joint_labels import short_names
from ros_ik_pkg.panel.pages.page import Page, Tools
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.interface.servo_settings import SERVO_OPTIONS

RATE, SCALE = 'command_rate', 'velocity_scale'
COMMAND_RATE = 100.0  # Hz, if the node has no stream yet
GAIN = 4.0  # 1/s: twist for each metre and radian between tip and gizmo
SPEED, TURN = 0.1, 0.5  # m/s, rad/s: the most to begin with
QUEUE = 50  # commands that come within a tick
DRAWN = 0.1  # s between two drawings of the charts
FADE = 0.5  # s for which zeros are sent after a release, so that the arm stops because it is told to


class DrivePage(Page):
    """Streams twists while the gizmo is held: the tip follows it, and stops when it is let go."""

    title = 'drive'
    parameters = (*(option.ros_name for option in SERVO_OPTIONS), SCALE)

    def __init__(self, tools: Tools) -> None:
        super().__init__(tools)
        self._commands: Commands | None = None
        self._heard: Subscription | None = None
        self._rate_before = 0.0  # Hz, of the node, before the page drives
        self._released, self._held = -FADE, False  # s: when the gizmo was let go
        self._target = np.eye(4)  # the last one that the page has seen
        self._at = np.empty(0)  # (n,) the command at whose tip the gizmo was put
        self._drawn = 0.0  # s
        self._status: DiagnosticStatus | None = None
        self._speeds = (SPEED, TURN)
        self._publisher = tools.link.publisher(topics.TARGET_TWIST)
        tools.link.listen(topics.SERVO_STATUS, self._take_status)
        tools.scene.released = lambda: tools.later(self.release)

    def add(self) -> None:
        """Add the controls, and show in them what is known."""
        gui, texts = self._tools.server.gui, self._texts
        self._switch = gui.add_checkbox(texts['drive on'], self.drives, hint=texts['drive hint'])
        self._tools.on(self._switch, self.choose)
        self._speed = gui.add_slider(texts['most speed'], 0.01, 0.5, 0.01, self._speeds[0])
        self._turn = gui.add_slider(texts['most turn'], 0.05, 2.0, 0.05, self._speeds[1])
        for handle in (self._speed, self._turn):
            self._tools.on(handle, lambda _: self._take_speeds())
        self._words = gui.add_html('')
        self._charts = gui.add_html('')
        self._say()

    def begin(self, arm: Arm) -> None:
        """Begin with another arm, which nobody drives."""
        self._end()
        super().begin(arm)

    def _take_speeds(self) -> None:
        self._speeds = float(self._speed.value), float(self._turn.value)

    def choose(self, on: bool) -> None:
        """Drive, or leave the arm where it is and let the target be solved again."""
        if on == self.drives:
            return
        if not on:
            q = self._end()
            if q is not None:
                self._desk.start_from(q)
            return
        rate = float(self._desk.parameters.get(RATE, 0.0))
        self._rate_before = rate
        start = self._tools.scene.standing
        self.drives = True
        self._commands = Commands(self._arm, start, {**self._desk.parameters, RATE: rate or COMMAND_RATE})
        self._heard = self._tools.link.listen(topics.JOINT_TRAJECTORY, self._commands.take, QUEUE)
        self._held, self._released, self._status = False, -FADE, None
        self._take_hold(start)
        self._tools.scene.hide_paths(True)
        if not rate:
            self._desk.set_parameters({RATE: COMMAND_RATE})
        self._say()

    def _end(self) -> np.ndarray | None:
        """Drive no more; return the last command (n,), None if the page did not drive."""
        if self._commands is None:
            return None
        q = self._commands.position
        self._send(np.zeros(6))
        self._tools.link.leave(self._heard)
        self._tools.scene.hide_paths(False)
        self.drives, self._commands, self._heard = False, None, None
        self._switch.value = False
        if not self._rate_before:
            self._desk.set_parameters({RATE: 0.0})
        self._say()
        return q

    def _take_hold(self, q: np.ndarray) -> None:
        """Put the gizmo at the tip of q (n,)."""
        self._desk.start_from(q)
        self._target, self._at = self._desk.target, q

    def release(self) -> None:
        """Take note that the gizmo was let go: it goes back to the tip, which stops."""
        if self._commands is not None:
            self._held, self._released = False, time.monotonic()
            self._take_hold(self._commands.position)

    def tick(self) -> None:
        """Say where the arm is, as a robot does, send a twist while the gizmo is held, and draw the commands."""
        if self._commands is None:
            return
        now, q = time.monotonic(), self._commands.position
        self._tools.link.publish_joints(self._arm, q)
        self._desk.stand_at(q, self._texts['last command'])
        if self._desk.target is not self._target:
            self._held, self._target = True, self._desk.target
        if self._held:
            self._send(self._twist(self._arm.forward(q)))
        else:
            if now - self._released < FADE:
                self._send(np.zeros(6))
            if not np.array_equal(q, self._at):  # it comes to rest
                self._take_hold(q)
        if now - self._drawn >= DRAWN:
            self._drawn = now
            self._charts.content = commands_html(self._commands.peaks, short_names(self._arm.joint_names), self._texts)

    def _twist(self, base_from_tip: np.ndarray) -> np.ndarray:
        """Return the twist (6,) of the tip towards the gizmo, in base axes [m/s, rad/s]."""
        linear = GAIN * (self._target[:3, 3] - base_from_tip[:3, 3])
        angular = GAIN * pin.log3(self._target[:3, :3] @ base_from_tip[:3, :3].T)
        return np.concatenate([_at_most(linear, self._speeds[0]), _at_most(angular, self._speeds[1])])

    def _send(self, twist: np.ndarray) -> None:
        message = TwistStamped()
        message.header.frame_id = self._arm.base_frame
        for part, numbers in ((message.twist.linear, twist[:3]), (message.twist.angular, twist[3:])):
            part.x, part.y, part.z = numbers.tolist()
        self._publisher.publish(message)

    def _take_status(self, message: DiagnosticArray) -> None:
        self._status = message.status[0]
        self._say()

    def _say(self) -> None:
        if not self.drives:
            self._words.content = stream_html(self._texts['drive off'], None)
            self._charts.content = ''
        elif self._status is None:
            self._words.content = stream_html(self._texts['waiting'], None)
        else:
            good = self._status.level == DiagnosticStatus.OK
            text = f'{self._status.message} ({values_of(self._status)["label"]})'
            self._words.content = stream_html(text, good)

    def show(self, parameters: Mapping[str, Any]) -> None:
        """Drive no more if the node has no stream any more, for example after a refusal."""
        if self.drives and not parameters.get(RATE, COMMAND_RATE):
            self._end()


def _at_most(vector: np.ndarray, length: float) -> np.ndarray:
    """Return a vector, shortened to a length if it is longer."""
    return vector * min(1.0, length / max(float(np.linalg.norm(vector)), 1e-12))
