"""Twists to joint positions, a period at a time; Pinocchio says where the tip is."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from chains import pinocchio_tip
from smooth_commands import assert_within_limits

from ros_ik_pkg.ik import Arm, SolveOptions, load_arm
from ros_ik_pkg.ros.interface.servo_settings import BLOCKED, CAUTION_OPTIONS, GO_ON, STOP, Thresholds
from ros_ik_pkg.ros.servo.caution import Caution
from ros_ik_pkg.ros.servo.codes import FOLLOWING, Code
from ros_ik_pkg.ros.servo.limiter import Motion, MotionLimits, make_limiter
from ros_ik_pkg.ros.servo.reference import Reference
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand, TwistFollower

PERIOD = 0.002  # s
ACCELERATION, JERK = 10.0, 200.0
BASE = np.eye(3)
THRESHOLDS = Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS})
UR5_START = np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])


@cache
def arm_of(name: str) -> Arm:
    """Return an arm; `five` is a UR5 without its last joint."""
    return load_arm('ur5', tip='link5') if name == 'five' else load_arm(name)


def start_of(name: str) -> np.ndarray:
    return {'ur5': UR5_START, 'five': UR5_START[:5]}.get(name, arm_of(name).home)


def limits_of(arm: Arm) -> MotionLimits:
    full = np.ones(arm.n)
    speed = np.minimum(arm.velocity_limits, 3.0)
    return MotionLimits(arm.lower, arm.upper, speed, ACCELERATION * full, JERK * full)


class Servo:
    """A follower, a reference and a limiter in a row, and all that they put out."""

    def __init__(self, name: str, start=None, options=None, **settings) -> None:
        self.arm = arm_of(name)
        start = start_of(name) if start is None else start
        limits = limits_of(self.arm)
        caution = Caution(self.arm, limits, THRESHOLDS)
        self.follower = TwistFollower(self.arm, limits, options or SolveOptions(), caution, PERIOD, **settings)
        self.follower.start(start)
        self.reference = Reference(Motion.rest(start), PERIOD, 0.0)
        self.limiter = make_limiter('own', limits, PERIOD, start)
        self.commands, self.findings = [start], []

    def run(self, twist, time: float, axes=BASE) -> None:
        """Command a twist for a time [s]."""
        for _ in range(round(time / PERIOD)):
            motion, finding = self.follower.step(TwistCommand(np.array(twist, dtype=float), axes))
            smooth = self.reference.follow(motion.position, motion.velocity)
            self.commands.append(self.limiter.advance(smooth))
            self.findings.append(finding)

    def tips(self) -> np.ndarray:
        """Poses (k, 4, 4) of the tip at every command, by Pinocchio."""
        return np.array([pinocchio_tip(self.arm, q) for q in self.commands])

    def assert_within_limits(self) -> None:
        assert_within_limits(self.commands, limits_of(self.arm), PERIOD)


def off_line(tips: np.ndarray, direction) -> float:
    """Return the greatest distance [m] of the tips from a line through the first one."""
    way = tips[:, :3, 3] - tips[0, :3, 3]
    direction = np.array(direction) / np.linalg.norm(direction)
    return float(np.linalg.norm(way - np.outer(way @ direction, direction), axis=1).max())


def turned(tips: np.ndarray) -> float:
    """Return the greatest angle [rad] between the tips and the first one."""
    return max(float(np.linalg.norm(pin.log3(tip[:3, :3] @ tips[0, :3, :3].T))) for tip in tips)


@pytest.mark.parametrize('name', ['panda', 'ur5', 'iiwa14', 'puma560'])
def test_the_tip_goes_straight_at_the_commanded_speed_and_stops(name):
    servo = Servo(name)
    servo.run([0.0, 0.06, -0.08, 0.0, 0.0, 0.0], 1.0)
    servo.run(np.zeros(6), 0.6)
    tips = servo.tips()
    assert off_line(tips, [0.0, 0.6, -0.8]) < 1e-4 and turned(tips) < 1e-4
    speed = np.linalg.norm(np.diff(tips[:, :3, 3], axis=0), axis=1) / PERIOD
    assert np.all(np.abs(speed[300:500] - 0.1) < 0.002)
    assert servo.limiter.at_rest and servo.follower.standing
    servo.assert_within_limits()


def test_a_line_at_a_tenth_of_a_metre_a_second_is_smooth():
    servo = Servo('panda')
    servo.run([0.0, 0.1, 0.0, 0.0, 0.0, 0.0], 1.5)
    jerk = np.diff(np.array(servo.commands), n=3, axis=0) / PERIOD**3
    assert np.sqrt(np.mean(jerk**2, axis=0)).max() < 60.0  # rad/s^3


def test_the_first_command_after_a_twist_obeys_it():
    servo = Servo('panda')
    servo.run([0.0, 0.1, 0.0, 0.0, 0.0, 0.0], PERIOD)
    assert servo.tips()[-1][1, 3] > servo.tips()[0][1, 3]


def test_a_turn_leaves_the_tip_where_it_is():
    servo = Servo('panda')
    servo.run([0.0, 0.0, 0.0, 0.0, 0.3, 0.0], 1.0)
    tips = servo.tips()
    assert np.linalg.norm(tips[:, :3, 3] - tips[0, :3, 3], axis=1).max() < 1e-4
    axis = pin.log3(tips[-1][:3, :3] @ tips[0][:3, :3].T)
    assert np.allclose(axis / np.linalg.norm(axis), [0.0, 1.0, 0.0], atol=1e-4)


def test_a_twist_in_the_axes_of_the_tip_turns_with_it():
    servo = Servo('ur5')
    servo.run([0.0, 0.0, 0.05, 0.0, 0.0, 0.4], 1.0, axes=None)
    tips = servo.tips()
    assert off_line(tips, tips[0][:3, 2]) < 1e-4  # its z axis stays as it is
    assert turned(tips) > 0.3


def test_a_twist_in_other_axes_is_turned_into_those_of_the_base():
    axes = pin.exp3(np.array([0.3, -0.5, 0.8]))
    servo = Servo('ur5')
    servo.run([0.05, 0.0, 0.0, 0.0, 0.0, 0.0], 0.8, axes=axes)
    assert off_line(servo.tips(), axes[:, 0]) < 1e-4


def test_at_a_joint_limit_the_whole_motion_stops_and_the_tool_does_not_drift():
    servo = Servo('panda')
    servo.run([0.0, 0.0, 0.0, 0.0, 0.0, 1.0], 6.0)
    assert servo.findings[-1].code == Code.HALTED_JOINT_LIMIT
    assert 'panda_joint7' in servo.findings[-1].sentence
    tips = servo.tips()
    assert np.linalg.norm(tips[:, :3, 3] - tips[0, :3, 3], axis=1).max() < 1e-3
    assert np.allclose(servo.commands[-1], servo.commands[-50], atol=1e-4)
    servo.assert_within_limits()


@pytest.mark.parametrize('name', ['panda', 'ur5'])
def test_out_of_reach_the_tip_stays_on_its_line_says_why_and_comes_back_the_same_way(name):
    servo = Servo(name)
    servo.run([0.3, 0.0, 0.0, 0.0, 0.0, 0.0], 6.0)
    assert servo.findings[-1].code == Code.HALTED_SINGULARITY
    edge = len(servo.commands)
    servo.run([-0.3, 0.0, 0.0, 0.0, 0.0, 0.0], 6.0)
    tips = servo.tips()
    assert off_line(tips, [1.0, 0.0, 0.0]) < 1e-3 and turned(tips) < 1e-2
    back = edge + int(np.argmax(tips[edge:, 0, 3] <= tips[0][0, 3]))  # between this command and the one before
    before, after = tips[back - 1, 0, 3], tips[back, 0, 3]
    share = (before - tips[0][0, 3]) / (before - after)
    posture = (1.0 - share) * servo.commands[back - 1] + share * servo.commands[back]
    assert np.allclose(posture, servo.commands[0], atol=1e-3)
    servo.assert_within_limits()


def test_a_line_towards_a_stretched_elbow_stops_on_the_line():
    servo = Servo('ur5', np.array([0.0, -1.2, 1.6, -1.2, 0.25, 0.2]))
    servo.run([0.0, -0.1, 0.0, 0.0, 0.0, 0.0], 6.0)
    assert servo.findings[-1].code.halted
    assert off_line(servo.tips(), [0.0, 1.0, 0.0]) < 1e-3
    servo.assert_within_limits()


def test_a_five_joint_arm_follows_what_it_is_asked_for_and_leaves_the_free_row_alone():
    servo = Servo('five', options=SolveOptions(task_weights=(1, 1, 1, 1, 1, 0), task_frame='tip'))
    servo.run([0.0, 0.05, -0.05, 0.0, 0.0, 0.0], 1.0)
    servo.run(np.zeros(6), 0.5)
    tips = servo.tips()
    assert off_line(tips, [0.0, 1.0, -1.0]) < 1e-4
    assert np.linalg.norm(tips[-1][:3, 3] - tips[0][:3, 3]) > 0.05
    assert np.allclose(tips[-1][:3, 2], tips[0][:3, 2], atol=1e-4)  # only the turn about the tip's z is free
    servo.assert_within_limits()


def test_the_tip_of_a_five_joint_arm_keeps_to_its_line_if_the_orientation_is_free():
    servo = Servo('so101', options=SolveOptions(task_weights=(1, 1, 1, 0, 0, 0)))
    servo.run([0.0, 0.05, 0.03, 0.0, 0.0, 0.0], 1.0)
    servo.run(np.zeros(6), 0.5)
    tips = servo.tips()
    assert off_line(tips, [0.0, 0.5, 0.3]) < 1e-4
    assert np.linalg.norm(tips[-1][:3, 3] - tips[0][:3, 3]) > 0.05
    servo.assert_within_limits()


@pytest.mark.parametrize('name', ['five', 'planar3r', 'so101'])
def test_an_arm_with_fewer_joints_than_rows_makes_the_nearest_motion_and_does_not_stop(name):
    servo = Servo(name, start_of(name) + 0.3)
    servo.run([0.05, 0.05, 0.05, 0.0, 0.0, 0.0], 0.5)
    assert not any(finding.code.halted for finding in servo.findings)
    way = servo.tips()[-1][:3, 3] - servo.tips()[0][:3, 3]
    assert way @ np.ones(3) > 0.005
    servo.assert_within_limits()


def test_rows_that_are_left_free_may_drift_and_the_others_do_not():
    servo = Servo('ur5', options=SolveOptions(task_weights=(1, 1, 1, 0, 0, 0)))
    servo.run([0.3, 0.0, 0.0, 0.0, 0.0, 1.0], 1.0)
    assert off_line(servo.tips(), [1.0, 0.0, 0.0]) < 1e-3
    servo.assert_within_limits()


def test_by_option_the_other_joints_go_on_when_one_is_blocked():
    servos = {blocked: Servo('ur5', blocked=blocked) for blocked in BLOCKED}
    for servo in servos.values():
        servo.follower._caution = _NoCaution()
        servo.run([0.3, 0.0, 0.3, 0.0, 0.0, 0.0], 4.0)
        servo.assert_within_limits()
    assert servos[STOP].findings[-1].code == Code.HALTED_BLOCKED
    assert all(finding.code == Code.FOLLOWING for finding in servos[GO_ON].findings)
    assert np.allclose(servos[STOP].commands[-1], servos[STOP].commands[-50], atol=1e-6)


class _NoCaution:
    contact_ahead = None

    def judge(self, *_):
        return FOLLOWING


def test_reversals_and_runs_into_everything_keep_all_limits():
    rng, servo = np.random.default_rng(0), Servo('ur5')
    for _ in range(40):
        servo.run(rng.uniform(-1.0, 1.0, 6) * rng.choice([0.0, 0.3, 3.0]), 0.1)
    servo.assert_within_limits()
