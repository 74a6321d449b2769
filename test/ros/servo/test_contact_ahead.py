"""The stream in a room: it slows down before contact, never touches, and goes on where it may; judged by coal."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from smooth_commands import assert_within_limits

from bench.published_robots import PANDA, UR5
from ros_ik_pkg.ik import Arm, Obstacle, SolveOptions, World, load_arm
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, SERVO_OPTIONS, ServoSettings, Thresholds
from ros_ik_pkg.ros.servo.codes import Code
from ros_ik_pkg.ros.servo.contact_ahead import ContactAhead
from ros_ik_pkg.ros.servo.servo import Servo
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand

PERIOD = 0.002  # s
SETTINGS = replace(ServoSettings(**{option.name: option.default for option in SERVO_OPTIONS}), command_rate=500.0)
THRESHOLDS = Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS})
STARTS = {
    'panda': np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]),
    'ur5': np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2]),
}
DOWN, UP = np.array([0.0, 0.0, -0.2, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0])


@cache
def arm_of(name: str) -> Arm:
    urdf, srdf, tip = {'panda': PANDA, 'ur5': UR5}[name]
    return load_arm(urdf, tip=tip, srdf=srdf)


def box(name, place, size) -> Obstacle:
    pose = np.eye(4)
    pose[:3, 3] = place
    return Obstacle(name, 'box', size, pose)


def table_below(name: str) -> World:
    """Return a table 0.3 m below the tip."""
    tip = arm_of(name).forward(STARTS[name])[:3, 3]
    return World(obstacles=(box('table', tip - (0.0, 0.0, 0.3), (0.4, 0.4, 0.05)),))


class Run:
    """A servo in a room, and every command with its clearance by coal."""

    def __init__(self, name: str, world: World, start=None, **settings) -> None:
        self.arm, self.start = arm_of(name), STARTS[name] if start is None else start
        self.room = self.arm.contacts.room(world)
        ahead = ContactAhead(self.arm, self.room, THRESHOLDS, 0.0)
        self.servo = Servo(
            self.arm, SolveOptions(), replace(SETTINGS, **settings), THRESHOLDS, 1.0, self.start, ahead)
        self.now, self.commands, self.codes = 10.0, [self.start], []

    def ticks(self, count: int, twist=None) -> None:
        for k in range(count):
            if twist is not None and k % 5 == 0:
                self.servo.twist(TwistCommand(twist, np.eye(3)), self.now)
            self.now += PERIOD
            self.commands.append(self.servo.tick(self.now))
            self.codes.append(self.servo.finding.code)

    @property
    def clearances(self) -> np.ndarray:
        """Clearance [m] at every tenth command and the last one, by coal."""
        return np.array([self.room.look(q).clearance for q in (*self.commands[::10], self.commands[-1])])

    def assert_smooth(self) -> None:
        assert_within_limits(self.commands, self.servo.limits, PERIOD)


@pytest.mark.parametrize('name', ['panda', 'ur5'])
def test_towards_a_table_the_tip_slows_down_halts_before_it_says_so_and_may_leave(name):
    run = Run(name, table_below(name))
    run.ticks(1800, DOWN)
    assert {Code.SLOWED_CONTACT, Code.HALTED_CONTACT} <= set(run.codes)
    assert run.codes[-1] == Code.HALTED_CONTACT and 'mm between' in run.servo.finding.text
    assert 'table' in run.servo.finding.text
    assert 0.95 * THRESHOLDS.contact_halt < run.clearances[-1] < 1.1 * THRESHOLDS.contact_halt
    assert run.clearances.min() > 0.95 * THRESHOLDS.contact_halt
    height = run.arm.forward(run.commands[-1])[2, 3]
    run.ticks(400, UP)
    assert run.arm.forward(run.commands[-1])[2, 3] > height + 0.1
    run.assert_smooth()


@pytest.mark.parametrize('smoothing', ['own', 'ruckig', 'none'])
def test_a_pose_on_the_other_side_of_a_post_is_not_reached_through_it(smoothing):
    pytest.importorskip('ruckig') if smoothing == 'ruckig' else None
    arm, start = arm_of('ur5'), STARTS['ur5']
    beyond = start.copy()
    beyond[0] -= 1.6
    middle = start.copy()
    middle[0] -= 0.8
    post = box('post', arm.forward(middle)[:3, 3], (0.06, 0.06, 0.8))
    run = Run('ur5', World(obstacles=(post,)), smoothing=smoothing)
    assert not run.room.is_clear(middle) and run.room.is_clear(beyond)
    if smoothing == 'none':  # its goals come in steps
        for k in range(200):
            run.servo.pose(start + k / 199 * (beyond - start), run.now)
            run.ticks(1)
    else:
        run.servo.pose(beyond, run.now)
        run.ticks(1500)
    assert run.codes[-1] == Code.HALTED_CONTACT and 'post' in run.servo.finding.text
    assert run.servo.at_rest and run.clearances.min() > 0.0
    if smoothing != 'none':
        run.assert_smooth()
    run.servo.pose(start, run.now)
    run.ticks(1500)
    assert np.allclose(run.commands[-1], start, atol=1e-5)


def test_without_a_look_ahead_the_same_motion_touches():
    run = Run('ur5', table_below('ur5'))
    run.servo.see(None)
    run.ticks(1200, DOWN)
    assert run.clearances.min() < 0.0


def test_parts_that_are_always_near_each_other_do_not_slow_the_arm():
    run = Run('ur5', World())
    assert run.room.look(run.start).clearance < THRESHOLDS.contact_slow  # of the wrist
    run.ticks(300, np.array([0.0, 0.0, 0.1, 0.0, 0.0, 0.2]))
    assert set(run.codes) == {Code.FOLLOWING}


def test_an_obstacle_that_appears_in_the_way_of_a_motion_halts_it():
    run = Run('panda', World())
    tip = run.arm.forward(run.start)[:3, 3]
    run.ticks(200, DOWN)
    room = run.arm.contacts.room(World(obstacles=(box('box', tip - (0.0, 0.0, 0.3), (0.3, 0.3, 0.2)),)))
    run.servo.see(ContactAhead(run.arm, room, THRESHOLDS, 0.0))
    run.room = room
    run.ticks(1200, DOWN)
    assert run.codes[-1] == Code.HALTED_CONTACT and run.clearances.min() > 0.0
    run.assert_smooth()


def test_an_arm_that_touches_something_may_leave_it_and_may_not_go_deeper():
    arm = arm_of('ur5')
    place = arm.forward(STARTS['ur5'])[:3, 3]
    world = World(obstacles=(box('box', place - (0.0, 0.0, 0.06), (0.2, 0.2, 0.2)),))
    depth = arm.contacts.room(world).look(STARTS['ur5']).clearance
    assert depth < -0.01
    run = Run('ur5', world)
    run.ticks(300, DOWN)
    assert run.clearances.min() > depth - 1e-3 and run.codes[-1] == Code.HALTED_CONTACT
    run.ticks(1000, UP)
    assert run.clearances[-1] > 0.01
    run.assert_smooth()


def test_a_margin_counts_as_contact():
    arm, world = arm_of('panda'), table_below('panda')
    ahead = ContactAhead(arm, arm.contacts.room(world), THRESHOLDS, 0.03)
    run = Run('panda', world)
    run.servo.see(ahead)
    run.ticks(1800, DOWN)
    assert 0.039 < run.clearances[-1] < 0.042
