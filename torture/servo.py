"""Ten minutes of commands at 500 Hz for each of four arms, two of them with five joints, by the servo of the node
without its threads and messages: twists in base and tip axes, poses near and anywhere, by joints in step or on lines,
bursts, reversals, runs into singularities, joint limits, the arm itself, a floor, a table and a post, pauses, silence
of commands and of joint states, other options, a new start. The differences of the published positions are held against
the limits of position, velocity, acceleration and jerk; one command is one period. Contact is judged by Pinocchio and
coal on the meshes of the URDF, at every command while the servo speaks of contact, and at every fourth one else; the
so101 has no shapes. Then lines of the tip across the reach of an arm, by twists and by poses: the tip stays on its
line, by Pinocchio, or the arm halts and says why. Then random lines, half of them from beside a singularity. Last, how
long an arm moves after the last twist."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np
import pinocchio as pin

from bench.published_robots import UrdfJudge, moving_pairs
from ros_ik_pkg.ik import Obstacle, SolveOptions, World
from ros_ik_pkg.ik.contacts.coal_library import coal
from ros_ik_pkg.ik.contacts.contacts import Room
from ros_ik_pkg.ros.interface.servo_settings import POSE_MOTIONS
from ros_ik_pkg.ros.servo.codes import Code
from ros_ik_pkg.ros.servo.contact_ahead import ContactAhead
from ros_ik_pkg.ros.servo.servo import Servo
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand
from torture.plan import Check, Plan, progress, unless
from torture.servo_arms import BASE, PER_COMMAND, PERIOD, POSITION, RATE, SETTINGS, THRESHOLDS, Case, arms
from torture.servo_lines import line, random_lines, stop

MINUTES = 10.0
ROUNDING = 1e-9  # of a limit
KINDS = ('push', 'shake', 'near', 'anywhere', 'pause', 'silence', 'deaf', 'options', 'start')
FLOOR = -0.05  # m
SIZES = {'table': (0.4, 0.6, 0.05), 'post': (0.08, 0.08, 1.2)}  # m
NEAR = (Code.SLOWED_CONTACT, Code.HALTED_CONTACT, Code.LEAVING_CONTACT)
SPARSE = 4  # commands from one look at contact to the next, in the open
OTHERS = (SolveOptions(), SolveOptions(method='sdls'), SolveOptions(task_weights=POSITION),
          SolveOptions(null_space='manipulability'), SolveOptions(null_space='clearance'))  # fmt: skip


def run(plan: Plan) -> Iterator[Check]:
    """Stream for the minutes of the plan, a quarter of them for each arm unless they are the default."""
    minutes = MINUTES if plan.minutes is None else plan.minutes / 4.0
    for name, case in arms().items():
        yield from _stream(name, case, plan, minutes)
    for name, case in arms().items():
        for by in ('twists', 'poses'):
            yield line(name, case, by)
    for name, case in arms().items():
        for by in ('twists', 'poses'):
            yield random_lines(name, case, by, plan)
    for name, case in arms().items():
        yield stop(name, case)


def _stream(name: str, case: Case, plan: Plan, minutes: float) -> Iterator[Check]:
    ticks = round(60.0 * minutes * RATE)
    wild = Wild(case, np.random.default_rng(plan.seed))
    for _ in progress(range(ticks), name):
        wild.tick()
    broken = ', '.join(f'{count} {what}' for what, count in wild.judge.broken.items())
    yield Check(f'{name}: commands over a limit', broken or f'0 of {ticks}', broken)
    if wild.place is not None:
        touching, looks = wild.place.touching, wild.place.looks
        fault = unless(not touching, f'{touching} commands')
        yield Check(f'{name}: commands in contact', f'{touching} of {looks}', fault)
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


class Place:
    """A floor, a table below the tip and a post beside it, and what coal sees of an arm there."""

    def __init__(self, case: Case) -> None:
        """The tip starts above the table."""
        tip = case.arm.forward(case.start)[:3, 3]
        places = {'table': tip + np.array([0.0, 0.0, -0.3]), 'post': tip + np.array([0.0, 0.35, 0.0])}
        self._poses = {name: pin.SE3(np.eye(3), place).homogeneous for name, place in places.items()}
        self._case, self._last = case, case.start
        self.touching = self.looks = 0

    @cached_property
    def room(self) -> Room:
        """The arm among them."""
        obstacles = tuple(Obstacle(name, 'box', SIZES[name], pose) for name, pose in self._poses.items())
        return self._case.arm.contacts.room(World(floor=FLOOR, obstacles=obstacles))

    @cached_property
    def _judge(self) -> UrdfJudge:
        """Pinocchio's and coal's view."""
        arm, names = self._case.arm, {*SIZES, 'floor'}
        judge = UrdfJudge(
            self._case.urdf, {pair for pair in moving_pairs(self.room) if not pair & names}, self.room.positions,
            arm.base_frame,
        )  # fmt: skip
        below = pin.SE3(np.eye(3), np.array([0.0, 0.0, FLOOR - 1.0])).homogeneous
        for name in names:
            links = [link for pair in self.room.pairs if name in pair for link in pair if link != name]
            judge.add(name, coal.Box(*SIZES.get(name, (10.0, 10.0, 2.0))), self._poses.get(name, below), links)
        return judge

    def look(self, q: np.ndarray) -> None:
        """Count whether a command (n,) touches anything, unless it is the one before."""
        if np.array_equal(q, self._last):
            return
        self._last = q
        self.looks += 1
        self.touching += self._judge.touches(self._case.arm.joint_names, q)


class Wild:
    """A servo, and a hand that does anything with it."""

    def __init__(self, case: Case, rng: np.random.Generator) -> None:
        self._arm, self._options, self._rng, self._now, self._left = case.arm, case.options, rng, 0.0, 0
        self.codes: Counter[Code] = Counter()
        self.place = None if case.urdf is None else Place(case)
        self._contact = None if self.place is None else ContactAhead(case.arm, self.place.room, THRESHOLDS, 0.0)
        self._servo = self._new(case.start)
        self.judge = Judge(self._servo, case.start)

    def _new(self, q: np.ndarray) -> Servo:
        settings = replace(SETTINGS, pose_motion=POSE_MOTIONS[self._rng.integers(2)])
        servo = Servo(self._arm, self._options, settings, THRESHOLDS, 1.0, q, self._contact)
        servo.hear_joint_states(self._now)
        return servo

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
        command = self._servo.tick(self._now)
        self.judge.see(command)
        code = self._servo.finding.code
        if self.place is not None and (code in NEAR or self.codes.total() % SPARSE == 0):
            self.place.look(command)
        self.codes[code] += 1

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
