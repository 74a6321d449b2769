"""The class that LeRobot's processors call: its interface, its units, and solutions judged by Pinocchio and SciPy."""

from __future__ import annotations

import inspect
import subprocess
import sys

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import minimize

from bench.published_robots import ROBOTS
from ros_ik_pkg.adapters.lerobot import RobotKinematics
from ros_ik_pkg.ik import ArgumentError, ModelError

SO101 = ROBOTS / 'so_arm_description' / 'urdf' / 'so101.urdf'
TIP = 'gripper_frame_link'
MOTORS = ['shoulder_pan', 'shoulder_lift', 'elbow_flex', 'wrist_flex', 'wrist_roll', 'gripper']
BENT = np.array([10.0, -45.0, 70.0, 20.0, 15.0, 33.0])  # deg
EXACT = 1e-5  # m


class Judge:
    """The robot as Pinocchio reads it, with the motors in the order of MOTORS."""

    def __init__(self) -> None:
        self.model = pin.buildModelFromUrdf(str(SO101))
        self.data = self.model.createData()
        self.rows = [self.model.joints[self.model.getJointId(name)].idx_q for name in MOTORS]
        self.lower, self.upper = (limit[self.rows] for limit in (self.model.lowerPositionLimit,
                                                                 self.model.upperPositionLimit))  # fmt: skip

    def pose(self, motors: np.ndarray) -> pin.SE3:
        """Return the pose of the tip for motors [rad]."""
        q = np.zeros(self.model.nq)
        q[self.rows] = motors
        pin.framesForwardKinematics(self.model, self.data, q)
        return self.data.oMf[self.model.getFrameId(TIP)]

    def errors(self, motors: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the errors of position [m] and orientation [rad] at motors [rad]."""
        found = self.pose(motors)
        return target[:3, 3] - found.translation, pin.log3(target[:3, :3] @ found.rotation.T)

    def best(self, cost, start: np.ndarray, target: np.ndarray, exact: bool) -> float:
        """Return the least cost of the errors near a start [rad], with the position exact or not."""
        held = {'type': 'eq', 'fun': lambda q: 10.0 * self.errors(q, target)[0]}
        return minimize(
            lambda q: cost(*self.errors(q, target)), start, bounds=list(zip(self.lower, self.upper)), method='SLSQP',
            constraints=[held] if exact else [], options={'ftol': 1e-14, 'maxiter': 500},
        ).fun  # fmt: skip


JUDGE = Judge()


@pytest.fixture(scope='module')
def kinematics() -> RobotKinematics:
    return RobotKinematics(SO101, TIP, MOTORS)


def turned(pose: np.ndarray, vector, moved=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Return a pose, turned by a rotation vector [rad] and moved [m], both in the base frame."""
    out = pose.copy()
    out[:3, :3] = pin.exp3(np.asarray(vector, dtype=float)) @ pose[:3, :3]
    out[:3, 3] += moved
    return out


def orientation_error(motors: np.ndarray, target: np.ndarray) -> float:
    return float(np.linalg.norm(JUDGE.errors(np.deg2rad(motors), target)[1]))


def position_error(motors: np.ndarray, target: np.ndarray) -> float:
    return float(np.linalg.norm(JUDGE.errors(np.deg2rad(motors), target)[0]))


def test_arguments_and_defaults_are_those_of_lerobot():
    documented = {
        '__init__': {'urdf_path': ..., 'target_frame_name': TIP, 'joint_names': None},
        'forward_kinematics': {'joint_pos_deg': ...},
        'inverse_kinematics': {
            'current_joint_pos': ..., 'desired_ee_pose': ..., 'position_weight': 1.0, 'orientation_weight': 0.01,
        },
    }  # fmt: skip
    for method, arguments in documented.items():
        parameters = list(inspect.signature(getattr(RobotKinematics, method)).parameters.values())[1:]
        given = {one.name: ... if one.default is one.empty else one.default for one in parameters}
        assert given == arguments


def test_poses_are_those_of_pinocchio_from_degrees(kinematics):
    rng = np.random.default_rng(0)
    for _ in range(50):
        motors = rng.uniform(np.rad2deg(JUDGE.lower), np.rad2deg(JUDGE.upper))
        pose = kinematics.forward_kinematics(motors)
        np.testing.assert_allclose(pose, JUDGE.pose(np.deg2rad(motors)).homogeneous, atol=1e-12)


def test_without_names_the_motors_are_all_joints_of_the_robot_in_the_order_of_pinocchio():
    kinematics = RobotKinematics(str(SO101))
    assert (kinematics.joint_names, kinematics.target_frame_name) == (list(JUDGE.model.names)[1:], TIP)


def test_a_pose_that_the_arm_can_have_is_reached_and_the_gripper_stays(kinematics):
    target = kinematics.forward_kinematics(BENT)
    found = kinematics.inverse_kinematics(np.add(BENT, [5, -4, 6, 3, -8, 0]), target)
    assert position_error(found, target) < EXACT and orientation_error(found, target) < EXACT
    assert found[-1] == BENT[-1] and found.shape == BENT.shape


def test_motors_in_another_order_give_the_same_in_that_order(kinematics):
    order = [5, 2, 0, 4, 3, 1]
    other = RobotKinematics(SO101, TIP, [MOTORS[index] for index in order])
    target = turned(kinematics.forward_kinematics(BENT), (0.1, 0.2, 0.0), (0.02, 0.0, 0.01))
    np.testing.assert_array_equal(other.forward_kinematics(BENT[order]), kinematics.forward_kinematics(BENT))
    expected = kinematics.inverse_kinematics(BENT, target)[order]
    np.testing.assert_array_equal(other.inverse_kinematics(BENT[order], target), expected)


def test_positions_beyond_the_named_motors_are_returned_as_given():
    kinematics = RobotKinematics(SO101, TIP, MOTORS[:5])
    found = kinematics.inverse_kinematics([*BENT, 7.0], kinematics.forward_kinematics(BENT))
    np.testing.assert_allclose(found, [*BENT, 7.0], atol=1e-9)


@pytest.mark.parametrize('seed', range(40))
def test_the_position_is_exact_and_the_orientation_within_a_hundredth_of_the_best(kinematics, seed):
    rng = np.random.default_rng(seed)
    start = np.rad2deg(0.6 * rng.uniform(JUDGE.lower, JUDGE.upper))
    target = turned(kinematics.forward_kinematics(start), rng.normal(0.0, 0.3, 3))
    found = kinematics.inverse_kinematics(start, target)
    assert position_error(found, target) < EXACT
    best = JUDGE.best(lambda _, turn: turn @ turn, np.deg2rad(found), target, exact=True)
    assert orientation_error(found, target) <= 1.01 * np.sqrt(best) + 1e-5


def test_a_step_of_100_mm_leaves_nothing_of_the_position(kinematics):
    start = kinematics.forward_kinematics(BENT)
    for moved in 0.1 * np.array([[0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [-0.7, 0, 0.7]]):
        target = turned(start, (0.0, 0.0, 0.0), moved)
        assert position_error(kinematics.inverse_kinematics(BENT, target), target) < EXACT


def test_an_orientation_weight_of_zero_leaves_the_orientation_out(kinematics):
    target = turned(kinematics.forward_kinematics(BENT), (2.0, 0.0, 1.0), (0.01, 0.0, 0.0))
    found = kinematics.inverse_kinematics(BENT, target, orientation_weight=0.0)
    assert position_error(found, target) < EXACT and np.abs(found - BENT).max() < 10.0


@pytest.mark.parametrize(('position', 'orientation'), [(1.0, 1.0), (1.0, 20.0), (0.0, 1.0)])
def test_with_a_smaller_or_equal_weight_of_the_position_the_weighted_squares_are_least(
    kinematics, position, orientation
):
    def cost(move: np.ndarray, turn: np.ndarray) -> float:
        return position * move @ move + orientation * turn @ turn

    target = turned(kinematics.forward_kinematics(BENT), (0.3, 0.0, 0.4), (0.03, 0.02, 0.0))
    found = np.deg2rad(kinematics.inverse_kinematics(BENT, target, position, orientation))
    assert cost(*JUDGE.errors(found, target)) <= 1.001 * JUDGE.best(cost, found, target, exact=False) + 1e-10


def test_out_of_reach_the_arm_stretches_towards_the_target_within_its_limits(kinematics):
    target = turned(kinematics.forward_kinematics(BENT), (0.0, 0.0, 0.0), (0.5, 0.0, 0.2))
    found = kinematics.inverse_kinematics(BENT, target)
    radians = np.deg2rad(found)
    assert (radians >= JUDGE.lower - 1e-9).all() and (radians <= JUDGE.upper + 1e-9).all()
    nearest = np.sqrt(JUDGE.best(lambda move, _: move @ move, radians, target, exact=False))
    assert position_error(found, target) <= 1.01 * nearest


@pytest.mark.parametrize('weights', [(0.0, 0.0), (-1.0, 1.0), (np.nan, 1.0), (1.0, np.inf)])
def test_weights_that_make_no_sense_are_refused(kinematics, weights):
    with pytest.raises(ArgumentError, match='weights'):
        kinematics.inverse_kinematics(BENT, np.eye(4), *weights)


def test_what_is_no_pose_or_no_position_is_refused(kinematics):
    with pytest.raises(ArgumentError, match='target'):
        kinematics.inverse_kinematics(BENT, np.full((4, 4), np.nan))
    with pytest.raises(ArgumentError, match='seed'):
        kinematics.inverse_kinematics(BENT * np.nan, np.eye(4))
    with pytest.raises(ArgumentError, match='6 positions expected'):
        kinematics.forward_kinematics(BENT[:4])


def test_a_motor_that_is_missing_is_named():
    with pytest.raises(ModelError, match='lacks elbow_flex'):
        RobotKinematics(SO101, TIP, [name for name in MOTORS if name != 'elbow_flex'])


def test_an_arm_with_a_slide_is_refused():
    with pytest.raises(ModelError, match='slides'):
        RobotKinematics('stanford', 'tool0')


def test_neither_ros_nor_torch_nor_placo_nor_lerobot_is_imported():
    code = 'import sys, ros_ik_pkg.adapters.lerobot; print(*sys.modules)'
    modules = subprocess.check_output([sys.executable, '-c', code], text=True).split()
    assert not {'rclpy', 'torch', 'placo', 'lerobot'} & set(modules)
