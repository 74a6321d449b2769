"""Ten minutes of commands at 500 Hz for each of three arms, one of them with five joints, by the servo of the node
without its threads and messages: twists in base and tip axes, poses near and anywhere, bursts, reversals, runs into
singularities, joint limits and a contact, pauses, silence of commands and of joint states, other options, and a new
start. The differences of the published positions are held against the limits of position, velocity, acceleration and
jerk; one command is one period. Then lines of the tip across the reach of an arm: the tip stays on its line, by
Pinocchio, or the arm halts and says why. Last, how long an arm moves after the last twist."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik import Arm, SolveOptions, load_arm
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, SERVO_OPTIONS, ServoSettings, Thresholds
from ros_ik_pkg.ros.servo.codes import Code
from ros_ik_pkg.ros.servo.servo import Servo
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand
from torture.plan import Check, Plan, progress, unless

MINUTES = 10.0
RATE, PER_COMMAND = 500.0, 5  # Hz, and periods from one command to the next
PERIOD = 1.0 / RATE
SETTINGS = replace(ServoSettings(**{option.name: option.default for option in SERVO_OPTIONS}), command_rate=RATE)
THRESHOLDS = Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS})
BASE = np.eye(3)
ROUNDING = 1e-9  # of a limit
LINE = 1e-3  # m
LINE_TIME = 12.0  # s outwards at 0.2 m/s: further than any of these arms reaches
UR5_START = np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])
TILT = (1, 1, 1, 1, 1, 0)  # the rows that five joints can follow
KINDS = ('push', 'shake', 'near', 'anywhere', 'pause', 'silence', 'deaf', 'options', 'start')
OTHERS = (SolveOptions(), SolveOptions(method='sdls'), SolveOptions(task_weights=(1, 1, 1, 0, 0, 0)))


def arms() -> dict[str, tuple[Arm, np.ndarray, SolveOptions]]:
    """Return arms by name, with a start (n,) [rad] and the options of their solves."""
    panda, ur5 = load_arm('panda'), load_arm('ur5')
    five = load_arm('ur5', tip='link5')
    return {
        'panda': (panda, panda.home, SolveOptions()),
        'ur5': (ur5, UR5_START, SolveOptions()),
        'five joints': (five, UR5_START[:5], SolveOptions(task_weights=TILT, task_frame='tip')),
    }


def run(plan: Plan) -> Iterator[Check]:
    """Stream for the minutes of the plan, a third of them for each arm unless they are the default."""
    minutes = MINUTES if plan.minutes is None else plan.minutes / 3.0
    for name, (arm, start, options) in arms().items():
        yield from _stream(name, arm, start, options, plan, minutes)
    for name, (arm, start, options) in arms().items():
        yield _line(name, arm, start, options)
    for name, (arm, start, options) in arms().items():
        yield _stop(name, arm, start, options)


def _stream(
    name: str, arm: Arm, start: np.ndarray, options: SolveOptions, plan: Plan, minutes: float
) -> Iterator[Check]:
    ticks = round(60.0 * minutes * RATE)
    wild = Wild(arm, start, options, np.random.default_rng(plan.seed))
    for _ in progress(range(ticks), name):
        wild.tick()
    broken = ', '.join(f'{count} {what}' for what, count in wild.judge.broken.items())
    yield Check(f'{name}: commands over a limit', broken or f'0 of {ticks}', broken)
    seen = ', '.join(f'{count} {code.label}' for code, count in wild.codes.most_common())
    yield Check(f'{name}: what was said', seen, unless(len(wild.codes) > 5 or minutes < 0.5, 'too little was tried'))


class Judge:
    """Holds the differences of commands against the limits; rest comes before the first."""

    def __init__(self, servo: Servo, start: np.ndarray) -> None:
        self._limits, self._last = servo.limits, [start] * 3
        self.broken: Counter[str] = Counter()

    def see(self, command: np.ndarray) -> None:
        """Count what a command (n,) breaks."""
        a, b, c = self._last
        differences = {
            'velocity': (command - c, self._limits.velocity * PERIOD),
            'acceleration': (command - 2.0 * c + b, self._limits.acceleration * PERIOD**2),
            'jerk': (command - 3.0 * c + 3.0 * b - a, self._limits.jerk * PERIOD**3),
        }
        for what, (value, limit) in differences.items():
            self.broken.update({what: 1} if not np.all(np.abs(value) <= limit * (1.0 + ROUNDING)) else {})
        inside = np.all((self._limits.lower <= command) & (command <= self._limits.upper))
        self.broken.update({'position': 1} if not inside else {})
        self._last = [b, c, command]

    def start_again(self, q: np.ndarray) -> None:
        """Note that the stream begins anew at q (n,)."""
        self._last = [q] * 3


class Wild:
    """A servo, and a hand that does anything with it."""

    def __init__(self, arm: Arm, start: np.ndarray, options: SolveOptions, rng: np.random.Generator) -> None:
        self._arm, self._options, self._rng, self._now, self._left = arm, options, rng, 0.0, 0
        self._wall = arm.forward(start)[2, 3] - 0.3  # m: a table below the tip
        self.codes: Counter[Code] = Counter()
        self._servo = self._new(start)
        self.judge = Judge(self._servo, start)

    def _new(self, q: np.ndarray) -> Servo:
        servo = Servo(self._arm, self._options, SETTINGS, THRESHOLDS, 1.0, q, self._clearance)
        servo.hear_joint_states(self._now)
        return servo

    def _clearance(self, q: np.ndarray) -> tuple[float, str]:
        return float(self._arm.forward(q)[2, 3] - self._wall), 'tip and table'

    def tick(self) -> None:
        """Do something, or go on with it, and judge the next command."""
        if self._left == 0:
            self._choose()
        if self._left % PER_COMMAND == 0:
            self._command()
        self._left -= 1
        self._now += PERIOD
        if self._kind != 'deaf':
            self._servo.hear_joint_states(self._now)
        self.judge.see(self._servo.tick(self._now))
        self.codes[self._servo.finding.code] += 1

    def _choose(self) -> None:
        """Choose what the hand does next."""
        rng = self._rng
        self._servo.pause(False)
        self._kind = rng.choice(KINDS, p=(0.35, 0.15, 0.1, 0.1, 0.05, 0.1, 0.05, 0.05, 0.05))
        self._left = int(rng.integers(1, 1000))
        self._axes = [None, BASE, pin.exp3(rng.normal(size=3))][rng.integers(3)]
        self._twist = rng.normal(size=6) * rng.choice([0.02, 0.2, 1.0]) * (1.0, 1.0, 1.0, 3.0, 3.0, 3.0)
        if self._kind == 'pause':
            self._servo.pause(True)
        elif self._kind == 'options' and self._arm.n >= 6:
            self._servo.use(OTHERS[rng.integers(len(OTHERS))])
        elif self._kind == 'start' and self._servo.at_rest:
            self._servo = self._new(self._servo.position)
            self.judge.start_again(self._servo.position)

    def _command(self) -> None:
        """Send what goes with what the hand does."""
        rng = self._rng
        if self._kind in ('push', 'deaf', 'options', 'start', 'pause'):
            self._servo.twist(TwistCommand(self._twist, self._axes), self._now)
        elif self._kind == 'shake':
            self._servo.twist(TwistCommand(self._twist * rng.choice([-1.0, 0.0, 1.0]), self._axes), self._now)
        elif self._kind == 'near':
            self._servo.pose(self._inside(self._servo.position + rng.normal(size=self._arm.n) * 0.01), self._now)
        elif self._kind == 'anywhere' and rng.random() < 0.05:
            low, high = np.maximum(self._arm.lower, -math.pi), np.minimum(self._arm.upper, math.pi)
            self._servo.pose(rng.uniform(low, high), self._now)

    def _inside(self, q: np.ndarray) -> np.ndarray:
        return np.clip(q, self._arm.lower, self._arm.upper)


def _line(name: str, arm: Arm, start: np.ndarray, options: SolveOptions) -> Check:
    """Drive the tip outwards beyond the reach, and back; see how far it leaves its line, and why it halts."""
    servo, now, last, tips = Servo(arm, options, SETTINGS, THRESHOLDS, 1.0, start), 0.0, '', []
    for sign in (1.0, -1.0):
        for k in range(round(LINE_TIME * RATE)):
            if k % PER_COMMAND == 0:
                servo.twist(TwistCommand(sign * np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0]), BASE), now)
            now += PERIOD
            tips.append(_tip(arm, servo.tick(now)))
        last = last or servo.finding.sentence
    off = float(np.linalg.norm(np.array(tips)[:, 1:] - _tip(arm, start)[1:], axis=1).max())
    fault = unless(off < LINE, f'{1e3 * off:.2f} mm off the line') or unless(last.startswith('halted: '), 'no reason')
    return Check(f'{name}: a line out to the edge of reach and back', f'{1e3 * off:.3f} mm off; {last}', fault)


def _stop(name: str, arm: Arm, start: np.ndarray, options: SolveOptions) -> Check:
    """Measure the time from the last twist to standstill."""
    servo, now = Servo(arm, options, SETTINGS, THRESHOLDS, 1.0, start), 0.0
    for k in range(round(0.8 * RATE)):
        if k % PER_COMMAND == 0:
            servo.twist(TwistCommand(np.array([0.0, 0.2, 0.1, 0.0, 0.0, 0.5]), BASE), now)
            last = now
        now += PERIOD
        servo.tick(now)
    while servo.finding.code is not Code.COMMANDS_STOPPED:
        needed = servo._limiter.time_to_rest
        now += PERIOD
        servo.tick(now)
    while not servo.at_rest:
        now += PERIOD
        servo.tick(now)
    took, allowed = now - last, SETTINGS.command_timeout + needed + 3.0 * PERIOD
    figure = f'{took:.3f} s, of which {SETTINGS.command_timeout:g} s is command_timeout and {needed:.3f} s the stop'
    return Check(f'{name}: last twist to standstill', figure, unless(took <= allowed, f'more than {allowed:.3f} s'))


def _tip(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Return the position (3,) [m] of the tip by Pinocchio."""
    values = np.zeros(arm.model.nq)
    for joint, position in zip(arm.joint_names, q):
        values[arm.model.joints[arm.model.getJointId(joint)].idx_q] = position
    pin.framesForwardKinematics(arm.model, arm._data, values)
    base, tip = (arm._data.oMf[arm.model.getFrameId(frame)] for frame in (arm.base_frame, arm.tip_frame))
    return base.actInv(tip).translation.copy()
