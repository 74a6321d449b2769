"""Robots by name, each judged by Pinocchio's forward kinematics of a second source: the URDF of example-robot-data, or
the placements that the maker publishes in another form than config/robots has them."""

from __future__ import annotations

import sysconfig
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from numerics import random_configurations

from ros_ik_pkg.ik import load_arm, robot_names

HALF, PI = np.pi / 2.0, np.pi
X, Y, Z = np.eye(3)
ROUNDING = 2e-5  # m, rad: URDFs write 1.5708 and 3.14159
INSTALLED = Path(sysconfig.get_path('purelib'), 'cmeel.prefix', 'share', 'example-robot-data', 'robots')
NEW = ('fr3', 'gen3', 'openarm', 'so100', 'so101', 'ur10e', 'ur3e', 'ur5e', 'xarm7')


def at(xyz=(0.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.0)) -> pin.SE3:
    """Return the placement of an <origin>."""
    return pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.array(xyz, dtype=float))


def ur(d1, a2, a3, d4, d5, d6):
    """Return the chain of a UR as ur_description has it from `base` on: `base_link` is `base` turned by half a turn."""
    shoulder = at((0.0, 0.0, d1), (0.0, 0.0, PI))
    return [
        (at(rpy=(0.0, 0.0, PI)) * shoulder, Z), (at(rpy=(HALF, 0.0, 0.0)), Z), (at((a2, 0.0, 0.0)), Z),
        (at((a3, 0.0, d4)), Z), (at((0.0, -d5, 0.0), (HALF, 0.0, 0.0)), Z),
        (at((0.0, d6, 0.0), (HALF, PI, PI)), Z),
    ], at()  # fmt: skip


# (placement of the joint in the link before, its axis) of all joints, and the placement of the tip
CHAINS = {
    # Universal_Robots_ROS2_Description, config/*/default_kinematics.yaml
    'ur3e': ur(0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921),
    'ur5e': ur(0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996),
    'ur10e': ur(0.1807, -0.6127, -0.57155, 0.17415, 0.11985, 0.11655),
    # franka_description, robots/fr3/kinematics.yaml
    'fr3': ([
        (at((0, 0, 0.333)), Z), (at(rpy=(-HALF, 0, 0)), Z), (at((0, -0.316, 0), (HALF, 0, 0)), Z),
        (at((0.0825, 0, 0), (HALF, 0, 0)), Z), (at((-0.0825, 0.384, 0), (-HALF, 0, 0)), Z),
        (at(rpy=(HALF, 0, 0)), Z), (at((0.088, 0, 0), (HALF, 0, 0)), Z),
    ], at((0, 0, 0.107))),
    # Kinova, Gen3 user guide: the table of classical DH parameters as transforms, joints turning about -z of the base
    'gen3': ([
        (at((0, 0, 0.1564), (PI, 0, 0)), Z), (at((0, 0.0054, -0.1284), (HALF, 0, 0)), Z),
        (at((0, -0.2104, -0.0064), (-HALF, 0, 0)), Z), (at((0, 0.0064, -0.2104), (HALF, 0, 0)), Z),
        (at((0, -0.2084, -0.0064), (-HALF, 0, 0)), Z), (at((0, 0, -0.1059), (HALF, 0, 0)), Z),
        (at((0, -0.1059, 0), (-HALF, 0, 0)), Z),
    ], at((0, 0, -0.0615), (PI, 0, 0))),
    # openarm_mujoco, v1/openarm_bimanual.xml: bodies from openarm_left_link0 to openarm_left_hand_tcp
    'openarm': ([
        (at((0, 0, 0.0625)), Z), (at((-0.0301, 0, 0.06), (-HALF, 0, 0)), -X), (at((0.0301, 0, 0.06625)), Z),
        (at((0, 0.0315, 0.15375)), Y), (at((0, -0.0315, 0.0955)), Z), (at((0.0375, 0, 0.1205)), X),
        (at((-0.0375, 0, 0)), -Y),
    ], at((1e-6, 0.0205, 0)) * at((0, -0.025, 0.1001)) * at((0, 0, 0.08))),
}  # fmt: skip
PRECISION = {'gen3': 1e-3}  # [m] the user guide gives tenths of a millimetre, and leaves out two of 0.2 mm
URDFS = {
    'so100': ('so_arm_description/urdf/so100.urdf', 'base', 'gripper'),
    'so101': ('so_arm_description/urdf/so101.urdf', 'base_link', 'gripper_frame_link'),
    'xarm7': ('xarm_description/urdf/xarm7.urdf', 'link_base', 'link_eef'),
}


def chain_model(chain) -> pin.Model:
    """Return the Pinocchio model of a chain."""
    joints, tip = chain
    model, parent = pin.Model(), 0
    for k, (placement, axis) in enumerate(joints):
        parent = model.addJoint(parent, pin.JointModelRevoluteUnaligned(axis), placement, f'j{k}')
    model.addFrame(pin.Frame('tip', parent, 0, tip, pin.FrameType.BODY))
    return model


def tip_pose(model: pin.Model, frame: str, q: np.ndarray) -> np.ndarray:
    """Return the pose (4, 4) of a link of a model whose first joints are those of the arm."""
    data, whole = model.createData(), np.zeros(model.nq)
    whole[: len(q)] = q
    pin.framesForwardKinematics(model, data, whole)
    return data.oMf[model.getFrameId(frame, pin.FrameType.BODY)].homogeneous


@pytest.mark.parametrize('name', sorted(CHAINS))
def test_a_robot_by_name_is_the_one_that_its_maker_publishes(name):
    arm, model = load_arm(name), chain_model(CHAINS[name])
    for q in random_configurations(arm, np.random.default_rng(1), 50):
        np.testing.assert_allclose(arm.forward(q), tip_pose(model, 'tip', q), atol=PRECISION.get(name, ROUNDING))


@pytest.mark.parametrize('name', sorted(URDFS))
def test_a_robot_by_name_is_the_one_of_the_urdf_that_is_installed(name):
    file, base, tip = URDFS[name]
    path = INSTALLED / file
    arm, model = load_arm(name), pin.buildModelFromUrdf(str(path))
    assert (arm.base_frame, arm.tip_frame) == (base, tip)
    assert list(arm.joint_names) == list(model.names)[1 : arm.n + 1]
    np.testing.assert_allclose(arm.lower, model.lowerPositionLimit[: arm.n], atol=1e-5)
    np.testing.assert_allclose(arm.upper, model.upperPositionLimit[: arm.n], atol=1e-5)
    for q in random_configurations(arm, np.random.default_rng(2), 50):
        np.testing.assert_allclose(arm.forward(q), tip_pose(model, tip, q), atol=ROUNDING)


def test_every_new_robot_has_a_second_source():
    assert sorted([*CHAINS, *URDFS]) == sorted(NEW)
    assert set(NEW) < set(robot_names())


@pytest.mark.parametrize('name', NEW)
def test_a_robot_by_name_needs_nothing_else_and_names_its_licence_or_its_makers_document(name):
    arm = load_arm(name)
    assert arm.n in (5, 6, 7) and np.all(np.isfinite(arm.velocity_limits)) and not arm.warnings
    assert np.all((arm.lower < arm.home) & (arm.home < arm.upper))
