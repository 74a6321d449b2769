"""The stream of commands: a thread that asks the servo for one command per period, and the input of commands."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from geometry_msgs.msg import TwistStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState

from ros_ik_pkg.ik import ArgumentError, Arm
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.interface.parameters import Settings
from ros_ik_pkg.ros.servo.codes import Code, Finding
from ros_ik_pkg.ros.servo.contact_ahead import ContactAhead
from ros_ik_pkg.ros.servo.limiter import Motion
from ros_ik_pkg.ros.servo.servo import Servo
from ros_ik_pkg.ros.servo.twist_input import command_of

LOG_PERIOD = 1.0  # s between log lines of one kind
COMPILING = 'what a stream of commands needs is still being compiled'
OFF = 'target_twist is not followed: command_rate is 0, so there is no stream of commands'
Publish = Callable[[Arm, Motion, float], None]


class State(NamedTuple):
    """The content of ~/servo_status at one moment."""

    finding: Finding
    owner: str
    smoothing: str
    motion: Motion | None
    late: int  # periods without a command since the last call


class Stream:
    """Runs the servo of the node's arm, if command_rate is above 0.

    publish(arm, motion, period): publishes a command, on the thread of the stream. compiled: whether all that a stream
    calls is compiled; until then commands are refused, so that neither the stream nor the executor waits for it.
    """

    def __init__(self, node: Node, handler: TargetHandler, publish: Publish, compiled: Callable[[], bool]) -> None:
        self._node, self._handler, self._publish, self._compiled = node, handler, publish, compiled
        self._lock = threading.Lock()  # of all below
        self._servo: Servo | None = None
        self._arm: Arm | None = None
        self._settings: Settings | None = None
        self._refusal, self._no_goal, self._paused, self._late = '', '', False, 0
        self._end = threading.Event()
        self._thread: threading.Thread | None = None
        self._contact: ContactAhead | None = None  # for the executor's thread alone
        self._last: dict[str, float] = {}  # the last command of every joint of the robot, by name

    @property
    def on(self) -> bool:
        """Whether there is a stream."""
        return self._settings is not None and self._settings.servo.command_rate > 0.0

    @property
    def position(self) -> np.ndarray | None:
        """The last command (n,) of the stream [rad, m], None if there is none."""
        with self._lock:
            return None if self._servo is None else self._servo.position

    def take_over(self, settings: Settings, arm: Arm | None) -> None:
        """Go on with other settings, tool or arm; if limits or joints change, after a halt within the old ones."""
        same_robot = arm is not None and arm.same_robot(self._arm)
        same = self._settings is not None and same_robot and _stream_of(settings) == _stream_of(self._settings)
        if not same:
            self._stop()
        with self._lock:
            if arm is not None and self._arm is not None and arm.name != self._arm.name:
                self._last = {}
            self._settings, self._arm, self._refusal, self._no_goal = settings, arm, '', ''
            self._contact = None
            if self._servo is not None:
                self._servo.use(settings.options, arm)
        self.look_around()

    def on_twist(self, message: TwistStamped) -> None:
        """Follow a twist."""
        if not self.on:
            self._node.get_logger().warning(OFF, throttle_duration_sec=LOG_PERIOD)
            return
        try:
            arm = self._known_arm()
            command = command_of(message, arm, self._handler, self._settings.servo.command_timeout)
            joint_state = self._joint_state(arm)
            servo = self._running(arm)
        except RefusedError as error:
            self._refuse(str(error))
            return
        with self._lock:
            self._refusal = self._no_goal = ''
            servo.twist(command, time.monotonic(), joint_state)

    def on_pose(self, arm: Arm, q: np.ndarray) -> str:
        """Take the joints (n,) of a target pose as the goal; return why they are refused, or ''."""
        try:
            joint_state = self._joint_state(arm)
            servo = self._running(arm)
        except RefusedError as error:
            return str(error)
        with self._lock:
            self._refusal = self._no_goal = ''
            return servo.pose(q, time.monotonic(), joint_state)

    def on_no_goal(self, why: str) -> None:
        """Note why the last target pose has no joints to go to: the arm waits at the goal before it."""
        with self._lock:
            self._no_goal = f'the last pose: {why}'

    def look_around(self) -> None:
        """Avoid contact in the present room; if the arm touches it in every configuration, commands are refused."""
        if not self.on or self._arm is None or not self._compiled():
            return
        try:
            contact = self._ahead(self._arm)
        except RefusedError as error:
            self._refuse(str(error))
            with self._lock:
                if self._servo is not None:
                    self._servo.drop_command()
            return
        with self._lock:
            if self._servo is not None:
                self._servo.see(contact)

    def on_joint_state(self, message: JointState) -> None:
        """Note that joint states of the arm have arrived."""
        with self._lock:
            if self._servo is not None and not self._servo.joint_names.isdisjoint(message.name):
                self._servo.hear_joint_states(time.monotonic())

    def pause(self, paused: bool) -> str:
        """Halt the arm, or let it take commands again; return the effect in words."""
        with self._lock:
            self._paused = paused
            if self._servo is not None:
                self._servo.pause(paused)
        return 'the arm halts and takes no commands' if paused else 'the next command moves the arm'

    def look(self) -> State:
        """Return the state of the servo."""
        with self._lock:
            late, self._late = self._late, 0
            servo, refusal = self._servo, self._refusal
            if servo is None or servo.finding.code is Code.STANDING:
                refusal = refusal or self._no_goal
            refused = Finding(0.0, Code.REFUSED, refusal)
            if servo is None:
                finding = refused if refusal else Finding(0.0, Code.WAITING, 'no command yet')
                return State(finding, 'nobody', '', None, late)
            finding = refused if refusal else servo.finding
            return State(finding, servo.owner.value, servo.smoothing, servo.motion, late)

    def close(self) -> None:
        """Halt the arm within its limits, then end the thread."""
        self._stop()

    def _known_arm(self) -> Arm:
        if self._arm is None:
            raise RefusedError('no_robot', 'there is no robot yet')
        return self._arm

    def _refuse(self, why: str) -> None:
        self._node.get_logger().warning(f'twist refused: {why}', throttle_duration_sec=LOG_PERIOD)
        with self._lock:
            self._refusal = why

    def _joint_state(self, arm: Arm) -> np.ndarray | None:
        """Return the joint positions (n,); None if seeds do not come from joint states. Refuses unknown ones."""
        if self._settings.seed_source != 'joint_states' or self._handler.joint_states.empty:
            return None
        return self._handler.joint_states.seed(arm.joint_names)

    def _running(self, arm: Arm) -> Servo:
        """Return the servo, made at the first command: it starts at the last command, or else at the joint
        positions."""
        if not self._compiled():
            raise RefusedError('compiling', COMPILING)
        settings, contact = self._settings, self._ahead(arm)
        with self._lock:
            if self._servo is not None:
                self._servo.see(contact)
                return self._servo
        known = all(name in self._last for name in arm.joint_names)
        start = np.array([self._last[name] for name in arm.joint_names]) if known else self._handler.start(arm)
        servo = Servo(
            arm, settings.options, settings.servo, settings.thresholds, settings.velocity_scale, start, contact
        )
        servo.pause(self._paused)
        if settings.seed_source == 'joint_states' and not self._handler.joint_states.empty:
            servo.hear_joint_states(time.monotonic())
        self._end.clear()
        with self._lock:
            self._servo = servo
        self._thread = threading.Thread(target=self._run, args=(servo,), name='stream')
        self._thread.start()
        return servo

    def _ahead(self, arm: Arm) -> ContactAhead | None:
        """Return the look-ahead for contact in the present room; None if contact does not count. Refuses a room in
        which the arm touches something in every configuration."""
        try:
            world, notes = self._handler.surroundings.world(arm, self._settings)
            room = None if world is None else arm.contacts.room(world)
        except ArgumentError as error:
            raise RefusedError('contact', str(error)) from error
        for note in notes:
            self._node.get_logger().warning(note)
        if room is None:
            return None
        if self._contact is None or self._contact.room is not room:
            self._contact = ContactAhead(
                arm, room, self._settings.thresholds, self._settings.options.collision_margin
            )
        return self._contact

    def _stop(self) -> None:
        """End the thread after a halt."""
        if self._thread is None:
            return
        with self._lock:
            self._servo.close()
        self._end.set()
        self._thread.join()
        with self._lock:
            self._last |= zip(self._servo.arm.joint_names, self._servo.position.tolist())
            self._servo = self._thread = None

    def _run(self, servo: Servo) -> None:
        """Publish a command each period until the stream ends and the arm is at rest."""
        due = time.monotonic()
        while not (self._end.is_set() and servo.at_rest):
            try:
                with self._lock:
                    servo.tick(time.monotonic())
                    motion = servo.motion
                self._publish(servo.arm, motion, servo.period)
            except Exception:
                self._node.get_logger().error(traceback.format_exc(), throttle_duration_sec=LOG_PERIOD)
                if self._end.is_set():
                    return
            due += servo.period
            behind = time.monotonic() - due
            if behind > 0.0:  # a late command delays the next ones: two at once would be a jump
                with self._lock:
                    self._late += 1 + int(behind / servo.period)
                due += behind
            else:
                time.sleep(-behind)


def _stream_of(settings: Settings) -> tuple:
    """Return the settings that a new stream depends on."""
    return settings.servo, settings.thresholds, settings.velocity_scale, settings.seed_source
