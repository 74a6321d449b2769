"""The rules of caution: what slows, what halts, what is let go, and what is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, Thresholds
from ros_ik_pkg.ros.servo.caution import Approach, Caution, posture
from ros_ik_pkg.ros.servo.codes import Code, Finding, strictest
from ros_ik_pkg.ros.servo.limiter import MotionLimits

ARM = load_arm('ur5')
ROWS = np.eye(6)
START = np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])
STRETCHED = np.array([0.3, -1.2, 0.05, -0.6, 1.0, 0.2])
OUTWARDS, INWARDS = ARM.jacobian(STRETCHED) @ np.eye(6)[2] * -1.0, ARM.jacobian(STRETCHED) @ np.eye(6)[2]
THRESHOLDS = Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS})


def judge(q, twist, acceleration=10.0, jerk=200.0) -> Finding:
    limits = MotionLimits(ARM.lower, ARM.upper, ARM.velocity_limits, np.full(6, acceleration), np.full(6, jerk))
    caution = Caution(ARM, limits, THRESHOLDS)
    return caution.judge(posture(ARM, q, ROWS), np.asarray(twist), ROWS)


def test_in_the_open_nothing_is_slowed():
    assert judge(START, [0.05, 0.0, 0.0, 0.0, 0.0, 0.0]).share > 2.0


def test_near_a_singularity_the_arm_is_slower_towards_it_than_away_from_it():
    towards, away = (judge(STRETCHED, twist, acceleration=1e4, jerk=1e6) for twist in (OUTWARDS, INWARDS))
    assert towards.share < 0.5 * away.share
    assert towards.code == Code.SLOWED_SINGULARITY and away.code == Code.LEAVING_SINGULARITY
    assert 'sigma_min' in towards.text and 'move along' in towards.text


def test_at_a_singularity_the_arm_halts_and_may_leave():
    nearly = STRETCHED * (1.0, 1.0, 0.4, 1.0, 1.0, 1.0)
    assert judge(nearly, OUTWARDS).share == 0.0
    assert judge(nearly, OUTWARDS).code == Code.SLOWED_SINGULARITY
    assert judge(nearly, INWARDS).share > 0.0


def test_the_direction_that_is_named_is_the_one_that_is_lost():
    lost = posture(ARM, STRETCHED, ROWS).lost
    assert np.linalg.norm(lost @ ARM.jacobian(STRETCHED)) == pytest.approx(posture(ARM, STRETCHED, ROWS).sigma)


@pytest.mark.parametrize(('joint', 'side'), [(5, 'upper'), (5, 'lower'), (3, 'upper')])
def test_before_a_joint_limit_the_arm_slows_until_it_stands_at_the_margin(joint, side):
    sign = 1.0 if side == 'upper' else -1.0
    limit, shares = getattr(ARM, side)[joint], []
    for distance in (2.0, 0.5, 0.1, 0.03, THRESHOLDS.limit_margin):
        q = START.copy()
        q[joint] = limit - sign * distance
        twist = ARM.jacobian(q)[:, joint] * sign
        shares.append(judge(q, twist).share)
        assert judge(q, -twist).share > 1.0
    assert shares == sorted(shares, reverse=True) and shares[0] > 1.0 and shares[-1] == pytest.approx(0.0, abs=1e-9)
    q[joint] = limit
    finding = judge(q, twist)
    assert finding.code.at_standstill == Code.HALTED_JOINT_LIMIT
    assert f'{ARM.joint_names[joint]} is 0 from its {side} limit' in finding.sentence


def test_from_the_speed_that_is_allowed_before_a_limit_the_joint_can_stop():
    for distance in (1.0, 0.3, 0.05, 0.012):
        q = START.copy()
        q[5] = ARM.upper[5] - distance
        speed = judge(q, ARM.jacobian(q)[:, 5]).share  # rad/s, as the twist is that of 1 rad/s
        room = distance - THRESHOLDS.limit_margin
        assert speed**2 / (2.0 * 10.0) + speed * 10.0 / (2.0 * 200.0) < room


def test_no_joint_is_asked_for_more_than_its_top_speed():
    finding = judge(START, ARM.jacobian(START)[:, 0] * 10.0, acceleration=1e6, jerk=1e8)  # rad/s of one joint
    assert 0.9 * ARM.velocity_limits[0] < finding.share * 10.0 < ARM.velocity_limits[0]
    assert finding.code == Code.SLOWED_VELOCITY and ARM.joint_names[0] in finding.text


def test_where_a_line_is_a_narrow_curve_for_the_joints_the_tip_is_slower():
    q = START * (1.0, 1.0, 0.25, 1.0, 1.0, 1.0)
    finding = judge(q, ARM.jacobian(q) @ np.eye(6)[2] * -2.0)
    assert finding.code == Code.SLOWED_ACCELERATION and finding.share < 1.0


def test_what_halted_lets_go_later_than_it_took_hold():
    rule = Approach(slow=0.1, halt=0.02, thresholds=replace(THRESHOLDS, hysteresis=0.5))
    towards = 1e-6
    assert rule.judge(0.021, 0.021 - towards).most > 0.0
    assert rule.judge(0.019, 0.019 - towards).most == 0.0
    assert rule.judge(0.021, 0.021 - towards).most == 0.0
    assert rule.judge(0.031, 0.031 - towards).most > 0.0
    assert rule.judge(0.021, 0.021 - towards).most > 0.0


def test_a_measure_that_trembles_at_the_threshold_does_not_switch_the_rule_on_and_off():
    rule = Approach(slow=0.1, halt=0.02, thresholds=replace(THRESHOLDS, hysteresis=0.2))
    shares = [rule.judge(0.1 + tremble, 0.0).most for tremble in (0.001, -0.001, 0.001, -0.001, 0.03)]
    assert shares[0] == 1.0 and shares[-1] == 1.0
    assert rule.judge(0.099, 0.0).most < 1.0


def test_the_strictest_finding_counts_and_says_how_much_is_left():
    half, third = Finding(0.5, Code.SLOWED_VELOCITY, 'a'), Finding(0.3, Code.SLOWED_JOINT_LIMIT, 'b')
    assert strictest([half, third]) is third
    assert third.sentence == 'slowed to 30 %: b'
    assert Finding(0.0, Code.PAUSED, 'c').sentence == 'halted: c'
    assert Finding(1.0, Code.FOLLOWING, 'd').sentence == 'd'


def test_numbers_and_labels_of_codes_are_one_to_one():
    assert len({code.label for code in Code}) == len(Code) == max(Code) + 1
    assert Code.HALTED_CONTACT.halted and Code.PAUSED.halted and not Code.SLOWED_CONTACT.halted
