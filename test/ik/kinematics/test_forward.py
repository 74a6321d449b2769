"""Forward kinematics and the geometric Jacobian against Pinocchio, finite differences and closed forms."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from chains import joint_positions, pinocchio_pose, random_urdf
from hypothesis import given
from hypothesis import strategies as st
from numerics import SEEDS, few, get_arm, numeric_jacobian, pinocchio_tip, random_configurations

from ros_ik_pkg.ik import load_arm

EXACT = 1e-12
ROBOTS = ('iiwa14', 'panda', 'planar3r', 'puma560', 'stanford', 'ur5')


def made_up_arm(seed, joints, mimics):
    """Load a random chain of all joint kinds; return it, its URDF and a configuration."""
    rng = np.random.default_rng(seed)
    text = random_urdf(rng, joints=joints, branches=seed % 3, mimics=mimics)
    arm = load_arm(text, 'base', 'tip')
    return arm, text, random_configurations(arm, rng, 1)[0]


def pinocchio_jacobian(text, arm, q):
    """Jacobian (6, n) in base axes by Pinocchio's own reading of the URDF, mimic joints summed up."""
    model = pin.buildModelFromXML(text)
    data, values = model.createData(), pin.neutral(model)
    positions = joint_positions(arm, q)
    for name, value in positions.items():
        joint = model.joints[model.getJointId(name)]
        ends = joint.idx_q, joint.idx_q + joint.nq
        values[slice(*ends)] = value if joint.nq == 1 else (np.cos(value), np.sin(value))
    frame = model.getFrameId('tip', pin.FrameType.BODY)
    by_joint = pin.computeFrameJacobian(model, data, values, frame, pin.LOCAL_WORLD_ALIGNED).reshape(6, -1)
    J = np.zeros((6, arm.n))
    for k, name in enumerate(positions):
        J[:, arm.variable[k]] += arm.multiplier[k] * by_joint[:, model.joints[model.getJointId(name)].idx_v]
    return J


@few
@given(SEEDS, st.integers(1, 12), st.integers(0, 3))
def test_a_random_chain_is_where_pinocchio_says(seed, joints, mimics):
    arm, text, q = made_up_arm(seed, joints, mimics)
    expected = pinocchio_pose(text, 'base', 'tip', joint_positions(arm, q))
    np.testing.assert_allclose(arm.forward(q), expected, rtol=0, atol=EXACT)


@few
@given(SEEDS, st.integers(1, 12), st.integers(0, 3))
def test_the_jacobian_of_a_random_chain_is_pinocchios(seed, joints, mimics):
    arm, text, q = made_up_arm(seed, joints, mimics)
    np.testing.assert_allclose(arm.jacobian(q), pinocchio_jacobian(text, arm, q), rtol=0, atol=EXACT)


@few
@given(SEEDS, st.integers(1, 9), st.integers(0, 2))
def test_the_jacobian_is_the_derivative_of_the_pose(seed, joints, mimics):
    arm, _, q = made_up_arm(seed, joints, mimics)
    np.testing.assert_allclose(arm.jacobian(q), numeric_jacobian(arm, q), rtol=0, atol=1e-8)


@pytest.mark.parametrize('name', ROBOTS)
def test_shipped_robots_agree_with_pinocchio_everywhere(name):
    arm = get_arm(name)
    for q in random_configurations(arm, np.random.default_rng(4), 50):
        np.testing.assert_allclose(arm.forward(q), pinocchio_tip(arm, q), rtol=0, atol=EXACT)
        np.testing.assert_allclose(arm.jacobian(q), numeric_jacobian(arm, q), rtol=0, atol=1e-8)


@pytest.mark.parametrize('q', [(0.0, 0.0, 0.0), (0.3, -0.8, 1.9), (np.pi / 2, 0.0, -np.pi / 2), (-2.9, 2.9, -2.9)])
def test_a_planar_arm_has_its_closed_form(q):
    arm = get_arm('planar3r')
    links, angles = np.array([0.4, 0.3, 0.2]), np.cumsum(q)
    ends = np.array([links * np.cos(angles), links * np.sin(angles)])
    x, y = ends.sum(axis=1)
    expected = np.eye(4)
    expected[:2, :2] = [[np.cos(angles[2]), -np.sin(angles[2])], [np.sin(angles[2]), np.cos(angles[2])]]
    expected[:2, 3] = x, y
    np.testing.assert_allclose(arm.forward(q), expected, rtol=0, atol=EXACT)

    J = np.zeros((6, 3))
    for i in range(3):
        x, y = ends[:, i:].sum(axis=1)
        J[:, i] = -y, x, 0, 0, 0, 1
    np.testing.assert_allclose(arm.jacobian(q), J, rtol=0, atol=EXACT)


def test_whole_turns_change_nothing():
    arm = get_arm('ur5')
    q = np.array([0.4, -1.1, 0.7, 2.0, -0.3, 1.0])
    turned = q + 2.0 * np.pi * np.array([1, -3, 1000, 0, 2, -50])
    np.testing.assert_allclose(arm.forward(turned), arm.forward(q), rtol=0, atol=EXACT)
    np.testing.assert_allclose(arm.jacobian(turned), arm.jacobian(q), rtol=0, atol=EXACT)


def test_the_configuration_is_not_written_to():
    arm = get_arm('panda')
    q = arm.home.copy()
    arm.forward(q)
    arm.jacobian(q)
    np.testing.assert_array_equal(q, arm.home)
