"""The servo: which command controls the arm, when the arm halts, and the next command. No threads, no messages."""

from __future__ import annotations

import enum
import math
from dataclasses import replace

import numpy as np

from ros_ik_pkg.ik import Arm, SolveOptions
from ros_ik_pkg.ros.interface.servo_settings import LINE, ServoSettings, Thresholds
from ros_ik_pkg.ros.servo.caution import Caution
from ros_ik_pkg.ros.servo.codes import FOLLOWING, Code, Finding
from ros_ik_pkg.ros.servo.contact_ahead import ContactAhead
from ros_ik_pkg.ros.servo.goal_stream import GoalStream
from ros_ik_pkg.ros.servo.limiter import JerkLimiter, Motion, MotionLimits, make_limiter
from ros_ik_pkg.ros.servo.reference import Reference
from ros_ik_pkg.ros.servo.straight_move import StraightMove
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand, TwistFollower, moved, way_between

SETTLING = 0.5  # s at rest, after which a joint that is not at its command has been moved by something else
FASTEST_POSES = np.array([2.0, 2.0, 2.0, 6.0, 6.0, 6.0])  # m/s, rad/s; from one pose of a stream to the next
STANDING = Finding(1.0, Code.STANDING, 'stands and waits for commands')
PAUSED = Finding(0.0, Code.PAUSED, 'paused; ~/pause lets it go on')


class Owner(enum.Enum):
    """The kind of command that controls the arm."""

    NOBODY = 'nobody'
    TWIST = 'twist'
    POSE = 'pose'


class Servo:
    """Computes the commands for one arm, one per period, within all limits and rules of caution.

    Times are of any steady clock [s]. Nothing moves before the first command, nor after a pause before the next one.
    """

    def __init__(
        self,
        arm: Arm,
        options: SolveOptions,
        settings: ServoSettings,
        thresholds: Thresholds,
        velocity_scale: float,
        start: np.ndarray,
        contact: ContactAhead | None = None,
    ) -> None:
        """start: (n,) joint positions [rad, m]. contact: None if contact does not count."""
        self.arm, self.settings, self.period = arm, settings, 1.0 / settings.command_rate
        self.limits = motion_limits(arm, settings, velocity_scale)
        self.finding, self.owner = STANDING, Owner.NOBODY
        self._thresholds, self._contact = thresholds, contact
        self._command, self._commanded = TwistCommand(np.zeros(6)), -math.inf
        self._start = tuple(start.tolist())
        self._place(start)
        self.use(options)
        self._joint_states_heard = math.inf  # time of the last one; inf before the first
        self._paused = self._closing = False
        self._stopped = True  # until a command takes control
        self._rested = math.inf  # s: time that the commands have been at rest, counted in periods
        self._refused: Finding | None = None  # why the arm must stop before it goes on

    def use(self, options: SolveOptions, arm: Arm | None = None) -> None:
        """Solve with other options from now on, or with another tool on the arm; the motion goes on.

        With another tool the last twist ends, because its axes may have been those of the tool, and so does a line to
        a pose.
        """
        if arm is not None and not np.array_equal(arm.tip_from_tool, self.arm.tip_from_tool):
            self._commanded = -math.inf
            if self.owner is Owner.POSE and self._straight:
                self.drop_command()
        self.arm = arm or self.arm
        if options.null_space == 'posture' and not options.posture:
            options = replace(options, posture=self._start)
        caution = self._caution = Caution(self.arm, self.limits, self._thresholds, self._contact)
        self._follower = TwistFollower(
            self.arm, self.limits, options, caution, self.period, self.settings.blocked,
            (self.settings.line_speed, self.settings.line_turning),
        )  # fmt: skip
        self._begin()

    def see(self, contact: ContactAhead | None) -> None:
        """Avoid contact in another room from now on; None: contact does not count."""
        self._contact = self._caution.contact_ahead = contact

    @property
    def joint_names(self) -> frozenset[str]:
        """Names of the joints."""
        return frozenset(self.arm.joint_names)

    @property
    def position(self) -> np.ndarray:
        """The last command (n,) [rad, m]."""
        return self._limiter.position

    @property
    def motion(self) -> Motion:
        """The last command and its derivatives."""
        return self._limiter.motion

    @property
    def smoothing(self) -> str:
        """The limiter at work."""
        return self._limiter.name

    @property
    def _straight(self) -> bool:
        """Whether the tip goes to poses on straight lines."""
        return self.settings.pose_motion == LINE

    @property
    def at_rest(self) -> bool:
        """Whether the last command stands still."""
        return self._limiter.at_rest

    def twist(self, command: TwistCommand, now: float, joint_state: np.ndarray | None = None) -> None:
        """Take a twist; joint_state (n,): the joint positions [rad, m], if they are known."""
        if self._paused:
            return
        if self.owner is not Owner.TWIST or self._stopped:
            self._take(Owner.TWIST, joint_state)
        self._command, self._commanded = command, now

    def pose(self, q: np.ndarray, now: float, joint_state: np.ndarray | None = None) -> str:
        """Take the joints (n,) of a target pose as the goal; return why they are refused, or ''."""
        if self._paused:
            return PAUSED.sentence
        if self.owner is not Owner.POSE or self._stopped:
            self._take(Owner.POSE, joint_state)
            start = self.arm.forward(self.position)
            self._goals = GoalStream(self.position, self.limits.velocity) if not self._straight else GoalStream(
                start, FASTEST_POSES, way_between, moved
            )  # fmt: skip
        self._goals.put(self.arm.forward(q) if self._straight else q, now)
        self._goal, self._refused = q, None
        if self._straight:
            return ''
        if self._goals.alone and self.at_rest and self.smoothing != 'none':
            self._move = StraightMove(self.position, q, self.limits, self.period)
        elif self._move is not None:
            self._begin()
        return ''

    def pause(self, paused: bool) -> None:
        """Halt until this is called with False, and then wait for the next command."""
        self._paused = paused
        if paused:
            self.drop_command()

    def drop_command(self) -> None:
        """Halt, and wait for the next command."""
        self.owner = Owner.NOBODY

    def close(self) -> None:
        """Halt for good."""
        self._closing = True

    def hear_joint_states(self, now: float) -> None:
        """Note that a joint state came."""
        self._joint_states_heard = now

    def tick(self, now: float) -> np.ndarray:
        """Return the next command (n,) [rad, m].

        Raises RuntimeError if the command does not pass the final check: it must not be published.
        """
        before, halt = self._limiter.state, self._halt(now)
        self._rested = self._rested + self.period if self.at_rest else 0.0
        smooth = None if halt is not None else self._smooth(now)
        if smooth is not None:
            command = self._limiter.advance(smooth)
            halt = self._refused = self._contact_ahead(before[0])
            if halt is not None:  # the stop from the last state is known to be clear
                self._limiter.take_back(before)
        if smooth is None or halt is not None:
            self.finding, self._stopped = halt or STANDING, True
            command = self._limiter.halt()
            self._begin()
        if self.smoothing != 'none' and not np.all(np.abs(command - before[0]) <= self.limits.velocity * self.period):
            raise RuntimeError(f'a command leaps from {before[0].tolist()} to {command.tolist()}')
        return command

    def _contact_ahead(self, before: np.ndarray) -> Finding | None:
        """Return why the step that the limiter made from a command (n,) must be taken back; None if it may stay.

        It may stay if the arm can stop after it without contact. So a clear stop exists at any time.
        """
        if self._contact is None:
            return None
        state = self._limiter.state
        if self.smoothing == 'none':  # it stops at once
            state[1:] = 0.0
        fault = self._contact.fault(before, state, self._limiter.limits, self.period)
        return Finding(0.0, Code.HALTED_CONTACT, fault) if fault else None

    def _smooth(self, now: float) -> Motion | None:
        """Return the motion over the period that the command in control wants; None without one."""
        if self.owner is Owner.TWIST:
            motion, finding = self._follower.step(self._command)
            resting = self._follower.standing and not self._command.twist.any()
            self.finding = STANDING if resting and finding.code is Code.FOLLOWING else finding
            return self._reference.follow(*motion[:3])
        if self.owner is Owner.POSE and self._straight:
            motion, finding = self._follower.approach(*self._goals.at(now), self._goal)
            self.finding = STANDING if self._follower.standing and finding.code is Code.FOLLOWING else finding
            return self._reference.follow(*motion[:3])
        if self.owner is Owner.POSE:
            self.finding = STANDING if self._goals.reached(self.position) else FOLLOWING
            if self._move is not None:
                return self._move.step()
            return self._reference.follow(*self._goals.at(now))
        return None

    def _halt(self, now: float) -> Finding | None:
        """Return why the arm must halt now, or None."""
        if self._paused:
            return PAUSED
        if self._closing:
            return Finding(0.0, Code.WAITING, 'the settings change or the node ends')
        silent, longest = now - self._joint_states_heard, self.settings.joint_states_timeout
        if longest and silent > longest and self.owner is not Owner.NOBODY:
            return Finding(0.0, Code.JOINT_STATES_STOPPED, f'no joint state for more than {longest:g} s')
        if self._refused is not None and (self.owner is Owner.POSE or not self._limiter.at_rest):
            return self._refused
        silent, longest = now - self._commanded, self.settings.command_timeout
        if self.owner is Owner.TWIST and silent > longest:
            if not self._command.twist.any() and self._limiter.at_rest:
                return STANDING
            return Finding(0.0, Code.COMMANDS_STOPPED, f'no twist for more than {longest:g} s')
        return None

    def _take(self, owner: Owner, joint_state: np.ndarray | None) -> None:
        """Give control to one kind of command; a motion continues from its present state."""
        self.owner, self._stopped = owner, False
        if joint_state is not None and self.at_rest and self._rested > SETTLING:
            off = np.abs(joint_state - self.position).max()
            if off > self.settings.resync:
                self._place(joint_state)
        self._begin()

    def _place(self, q: np.ndarray) -> None:
        """Start the stream at rest at q (n,)."""
        self._limiter: JerkLimiter = make_limiter(self.settings.smoothing, self.limits, self.period, q)

    def _begin(self) -> None:
        """Let the followers of commands begin at the last command."""
        motion = self._limiter.motion
        self._follower.start(motion.position, motion.velocity)
        smoothed = self.owner is Owner.POSE and not self._straight
        constant = self.settings.response_time if smoothed else 0.0
        self._reference = Reference(motion, self.period, constant)
        self._move: StraightMove | None = None


def motion_limits(arm: Arm, settings: ServoSettings, velocity_scale: float) -> MotionLimits:
    """Return the limits of the stream: those of the arm, and those of the settings for joints without."""

    def known(limits: np.ndarray, otherwise: float) -> np.ndarray:
        return np.where(np.isfinite(limits), limits, otherwise)

    return MotionLimits(
        arm.lower,
        arm.upper,
        velocity_scale * known(arm.velocity_limits, settings.max_velocity),
        known(arm.acceleration_limits, settings.max_acceleration),
        known(arm.jerk_limits, settings.max_jerk),
    )
