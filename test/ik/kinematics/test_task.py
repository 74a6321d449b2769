"""The task: which rows count, in whose axes, how far off they may be; judged by Pinocchio and finite differences."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from chains import joint_xml, urdf
from hypothesis import given
from hypothesis import strategies as st
from numerics import get_arm, law, pinocchio_tip, random_configurations, reachable_poses

from ros_ik_pkg.ik import METHODS, SolveOptions, load_arm, solve
from ros_ik_pkg.ik.kinematics.task import log_curvature

TOLERANCE = 1e-5  # m and rad, the default
POINTING = (1, 1, 1, 1, 1, 0)  # in tip axes: the tip's position and axis, free roll about it
# A hobby arm: waist, shoulder, elbow, wrist, roll; the tip is 12 cm before the wrist.
FIVE_JOINTS = [
    joint_xml('waist', 'revolute', 'base', 'a', (0, 0, 0.1), lower=-2.6, upper=2.6),
    joint_xml('shoulder', 'revolute', 'a', 'b', (0, 0, 0.05), axis=(0, 1, 0), lower=-1.8, upper=1.8),
    joint_xml('elbow', 'revolute', 'b', 'c', (0.05, 0, 0.2), axis=(0, 1, 0), lower=-1.8, upper=1.8),
    joint_xml('wrist', 'revolute', 'c', 'd', (0.2, 0, 0), axis=(0, 1, 0), lower=-1.8, upper=1.8),
    joint_xml('roll', 'revolute', 'd', 'tip', (0.12, 0, 0), axis=(1, 0, 0), lower=-3.0, upper=3.0),
]
DAMPED = [method for method in METHODS if method not in ('transpose', 'pinv')]


def task_error(target, pose, in_tip_axes):
    """Error (6,) of a pose (4, 4), in base axes or those of the tip frame at the target, with Pinocchio."""
    error = np.hstack([(target - pose)[:3, 3], pin.log3(target[:3, :3] @ pose[:3, :3].T)])
    axes = target[:3, :3] if in_tip_axes else np.eye(3)
    return np.hstack([axes.T @ error[:3], axes.T @ error[3:]])


def problems(robot, count, seed=0):
    """Make up arm, targets (count, 4, 4) and seeds (count, n)."""
    arm, random = get_arm(robot), np.random.default_rng(seed)
    return arm, reachable_poses(arm, random, count), random_configurations(arm, random, count)


@pytest.mark.parametrize('robot', ['puma560', 'panda'])
@pytest.mark.parametrize('method', DAMPED)
def test_a_tip_with_free_roll_points_where_it_shall(method, robot):
    arm, targets, seeds = problems(robot, 40)
    options = SolveOptions(method=method, task_weights=POINTING, task_frame='tip', deadline=0.0)
    rolls = []
    for target, seed in zip(targets, seeds):
        solution = solve(arm, target, seed, options)
        assert solution.converged
        pose = pinocchio_tip(arm, solution.q)
        assert np.linalg.norm(pose[:3, 3] - target[:3, 3]) <= TOLERANCE
        # The axis, without any logarithm: for it is what the task is about.
        assert np.linalg.norm(np.cross(pose[:3, 2], target[:3, 2])) <= TOLERANCE and pose[:3, 2] @ target[:3, 2] > 0
        rolls.append(pose[:3, 0] @ target[:3, 0])
    assert min(rolls) < 0.5  # it did roll


def test_rows_in_tip_axes_are_those_of_the_target():
    arm, targets, seeds = problems('panda', 30)
    options = SolveOptions(task_weights=(0, 0, 1, 0, 0, 0), task_frame='tip', deadline=0.0)
    for target, seed in zip(targets, seeds):
        solution = solve(arm, target, seed, options)
        offset = target[:3, :3].T @ (pinocchio_tip(arm, solution.q) - target)[:3, 3]
        assert solution.converged and abs(offset[2]) <= TOLERANCE
        assert solution.position_error == pytest.approx(abs(offset[2]), abs=1e-12)


@pytest.mark.parametrize('frame', ['base', 'tip'])
@pytest.mark.parametrize('robot', ['ur5', 'panda'])
def test_a_row_may_be_off_by_its_tolerance_and_no_more(robot, frame):
    arm, targets, seeds = problems(robot, 40)
    bounds = np.array([0.02, 0.0, 0.01, 0.0, 0.3, 0.1])
    options = SolveOptions(task_tolerances=tuple(bounds), task_frame=frame, deadline=0.0)
    used = []
    for target, seed in zip(targets, seeds):
        solution = solve(arm, target, seed, options)
        error = task_error(target, pinocchio_tip(arm, solution.q), frame == 'tip')
        beyond = np.maximum(np.abs(error) - bounds, 0.0)
        assert solution.converged
        assert np.linalg.norm(beyond[:3]) <= TOLERANCE and np.linalg.norm(beyond[3:]) <= TOLERANCE
        assert solution.position_error == pytest.approx(np.linalg.norm(beyond[:3]), abs=1e-12)
        assert solution.orientation_error == pytest.approx(np.linalg.norm(beyond[3:]), abs=1e-12)
        used.append(np.abs(error))
    assert np.max(used, axis=0)[4] > 0.1  # the freedom was taken


def test_a_tolerance_brings_a_target_just_beyond_the_workspace_within_reach():
    arm = get_arm('planar3r')
    target = arm.forward(np.zeros(3))  # stretched out along x
    target[0, 3] += 0.05
    assert not solve(arm, target).converged
    solution = solve(arm, target, options=SolveOptions(task_tolerances=(0.06, 0, 0, 0, 0, 0)))
    assert solution.converged and solution.position_error <= TOLERANCE


@pytest.mark.parametrize('frame', ['base', 'tip'])
@pytest.mark.parametrize('method', METHODS)
def test_axes_make_no_difference_to_a_task_whose_rows_count_alike(method, frame):
    arm, targets, seeds = problems('puma560', 5)
    for target, seed in zip(targets, seeds):
        plain = solve(arm, target, seed, SolveOptions(method=method, deadline=0.0))
        same = solve(arm, target, seed, SolveOptions(method=method, deadline=0.0, task_frame=frame))
        assert same.status == plain.status and same.q.tolist() == plain.q.tolist()


@pytest.mark.parametrize('weights', [POINTING, (1, 1, 0, 0, 0, 1), (1, 2, 3, 4, 5, 6), (2, 2, 2, 1, 1, 1)])
@pytest.mark.parametrize('frame', ['base', 'tip'])
def test_a_step_follows_the_derivative_of_the_error(frame, weights):
    # One step of pinv, short enough to be linear, takes the part step_size of the error away in every row.
    arm, targets, seeds = problems('panda', 20)
    part = 1e-6
    options = SolveOptions(
        method='pinv', step_size=part, max_iterations=1, max_attempts=1, task_frame=frame, respect_limits=False,
        task_weights=weights,
    )  # fmt: skip
    rows = np.array(weights) > 0
    compared = 0
    for target, seed in zip(targets, seeds):
        solution = solve(arm, target, seed, options)
        before, after = (task_error(target, pinocchio_tip(arm, q), frame == 'tip') for q in (seed, solution.q))
        # Beyond 3 rad the logarithm may change its branch, and some seeds are so singular that pinv gives up.
        if np.linalg.norm(before[3:]) < 3.0 and solution.iterations == 1:
            compared += 1
            np.testing.assert_allclose((before - after)[rows] / part, before[rows], rtol=0, atol=1e-3)
    assert compared > 10


@law
@given(angle=st.floats(0.0, np.pi))
def test_the_derivative_of_the_logarithm_is_that_of_pinocchio(angle):
    phi = angle * np.array([0.48, -0.6, 0.64])
    K = pin.skew(phi)
    actual = np.eye(3) + 0.5 * K + log_curvature(angle**2) * K @ K
    if angle < 3.1:  # Pinocchio's own loses digits near half a turn
        np.testing.assert_allclose(actual, pin.Jlog3(pin.exp3(phi)), rtol=0, atol=1e-7)
    assert np.isfinite(actual).all()


@pytest.mark.parametrize('method', DAMPED)
def test_five_joints_solve_the_tasks_that_five_joints_can_do(method):
    arm = load_arm(urdf(['base', *'abcd', 'tip'], FIVE_JOINTS))
    random = np.random.default_rng(3)
    targets, seeds = reachable_poses(arm, random, 100), random_configurations(arm, random, 100)
    # Its tip's x axis is what it points with.
    options = SolveOptions(method=method, task_weights=(1, 1, 1, 0, 1, 1), task_frame='tip', deadline=0.0)
    solved = [solve(arm, target, seed, options).converged for target, seed in zip(targets, seeds)]
    assert np.mean(solved) >= 0.99
