"""The names of singularities, of arms in configurations whose singularity is known from their geometry."""

from __future__ import annotations

import numpy as np
import pytest

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.servo.caution import posture
from ros_ik_pkg.ros.servo.singularity import OTHERWISE, name_singularity

A2, A3, D5 = 0.425, 0.39225, 0.09465  # m, of the UR5


def name_of(robot: str, q) -> str:
    arm = load_arm(robot)
    here = posture(arm, np.array(q, dtype=float), np.eye(6))
    assert here.sigma < 0.01
    return name_singularity(here.jacobian, here.idle, here.lost, arm.joint_names)


def above_the_first_axis(q2: float, q3: float) -> float:
    """Return the fourth joint [rad] of a UR5 whose wrist is on the first axis."""
    return float(np.arcsin((A2 * np.cos(q2) + A3 * np.cos(q2 + q3)) / D5)) - q2 - q3


@pytest.mark.parametrize('elbow', [-0.02, 0.02])
def test_a_stretched_elbow_is_too_far(elbow):
    assert name_of('ur5', [0.4, -0.9, elbow, -1.2, 1.3, 0.2]) == 'too far: elbow_joint is nearly stretched'
    puma = np.arctan2(0.0203, 0.4318) - np.pi / 2.0  # its forearm is bent
    assert name_of('puma560', [0.3, 0.4, puma + 0.5 * elbow, 0.5, 0.8, 0.1]) == 'too far: joint3 is nearly stretched'


def test_a_folded_elbow_is_too_near():
    q2, q3 = -0.9, np.pi - 0.005
    assert name_of('ur5', [0.4, q2, q3, -1.5 - q2 - q3, 1.3, 0.2]) == 'too near: elbow_joint is nearly folded'


def test_a_wrist_on_the_first_axis_is_too_near():
    q2, q3 = -1.9, 0.9
    found = name_of('ur5', [0.4, q2, q3, above_the_first_axis(q2, q3), 1.3, 0.2])
    assert found == 'too near: the wrist is nearly on the axis of shoulder_pan_joint'


@pytest.mark.parametrize(
    ('robot', 'q', 'joints'),
    [
        ('ur5', [0.4, -1.2, 1.4, -0.6, 0.01, 0.2], 'wrist_1_joint and wrist_3_joint'),
        ('ur5', [0.4, -1.2, 1.4, -0.6, 3.13, 0.2], 'wrist_1_joint and wrist_3_joint'),
        ('puma560', [0.3, 0.6, -0.9, 0.3, 0.005, 0.4], 'joint4 and joint6'),
    ],
)
def test_a_wrist_with_parallel_axes_is_named_by_them(robot, q, joints):
    assert name_of(robot, q) == f'the axes of {joints} are nearly parallel'


def test_three_parallel_axes_are_no_wrist():
    arm = load_arm('planar3r')
    here = posture(arm, np.array([0.3, 0.0, 0.0]), np.eye(6)[:2])
    found = name_singularity(here.jacobian, here.idle, here.lost, arm.joint_names)
    assert found == f'too far: {arm.joint_names[1]} is nearly stretched'


@pytest.mark.parametrize(
    ('robot', 'q', 'elbow'),
    [
        ('panda', [0.3, 0.4, 0.5, -0.466, 0.3, 1.5, 0.0], 'panda_joint4'),  # its elbow is beside its upper arm
        ('iiwa14', [0.3, 0.4, 0.5, 0.002, 0.3, 1.0, 0.0], 'iiwa_joint_4'),
    ],
)
def test_a_stretched_elbow_below_a_shoulder_that_is_a_ball_is_too_far(robot, q, elbow):
    assert name_of(robot, q) == f'too far: {elbow} is nearly stretched'


def test_a_shoulder_that_is_a_ball_is_named_by_its_outer_axes():
    # At 0.0 the tip loses nothing by two motions of the joints, and any mix of them may come out.
    found = name_of('iiwa14', [0.3, 0.01, np.pi / 2.0, 1.2, 0.3, 1.0, 0.0])
    assert found == 'the axes of iiwa_joint_1 and iiwa_joint_3 are nearly parallel'


def test_an_elbow_that_is_folded_below_the_first_axis_is_folded():
    q2, q3 = -0.9, np.pi - 0.03
    found = name_of('ur5', [0.4, q2, q3, above_the_first_axis(q2, q3) + 0.2, 1.3, 0.2])
    assert found == 'too near: elbow_joint is nearly folded'


def test_an_arm_with_a_bent_elbow_and_no_parallel_axes_is_nearly_singular():
    arm = load_arm('panda')
    here = posture(arm, np.array([0.0, 0.4, 0.5, -1.5, 0.3, 1.0, 0.0]), np.eye(6))
    assert name_singularity(here.jacobian, here.idle, here.lost, arm.joint_names) == OTHERWISE
