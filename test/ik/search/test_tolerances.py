"""The two tolerances are freedom: a target is solved if any configuration is within both; judged by Pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from chains import joint_xml, random_urdf, urdf
from hypothesis import given
from hypothesis import strategies as st
from numerics import SEEDS, assert_answer, few, get_arm, random_configurations, random_rotation, reachable_poses

from ros_ik_pkg.ik import METHODS, SolveOptions, load_arm, solve

CALM = {'deadline': 0.0}  # what a busy machine must not change
SEARCHING = [method for method in METHODS if method != 'transpose']
# A hobby arm: five joints, all of which move in one plane but for the first and the last.
FIVE_JOINTS = [
    joint_xml('pan', 'revolute', 'base', 'a', (0, 0, 0.06), lower=-1.9, upper=1.9),
    joint_xml('lift', 'revolute', 'a', 'b', (0.03, 0, 0.05), axis=(0, 1, 0), lower=-1.7, upper=1.7),
    joint_xml('elbow', 'revolute', 'b', 'c', (0.03, 0, 0.11), axis=(0, 1, 0), lower=-1.7, upper=1.7),
    joint_xml('flex', 'revolute', 'c', 'd', (0.13, 0, 0), axis=(0, 1, 0), lower=-1.6, upper=1.6),
    joint_xml('roll', 'revolute', 'd', 'e', (0.06, 0, 0), axis=(1, 0, 0), lower=-2.7, upper=2.7),
    joint_xml('tool', 'fixed', 'e', 'tip', (0.1, 0, 0)),
]


def displaced(pose, rng, distance, angle):
    """Move a pose by a distance [m] and turn it by an angle [rad], both in a random direction."""
    moved = pose.copy()
    moved[:3, :3] = pin.exp3(angle * random_rotation(rng)[0]) @ pose[:3, :3]
    moved[:3, 3] += distance * random_rotation(rng)[0]
    return moved


@pytest.mark.parametrize('method', SEARCHING)
@pytest.mark.parametrize(('metres', 'radians'), [(1e-5, 0.5), (0.03, 1e-5), (1e-4, 0.1), (1e-5, 1e-3), (0.05, 0.3)])
def test_five_joints_use_the_tolerances_for_poses_beyond_them(metres, radians, method):
    arm, rng = load_arm(urdf(['base', *'abcde', 'tip'], FIVE_JOINTS)), np.random.default_rng(1)
    options = SolveOptions(method=method, position_tolerance=metres, orientation_tolerance=radians, **CALM)
    for pose in reachable_poses(arm, rng, 25):
        target = displaced(pose, rng, 0.98 * metres, 0.98 * radians)
        assert_answer(arm, solve(arm, target, options=options), target, options)


@few
@given(SEEDS, st.integers(3, 8), st.floats(-5.0, -1.0), st.floats(-5.0, 0.0))
def test_a_random_arm_solves_a_target_whose_tolerances_a_configuration_meets(seed, joints, metres, radians):
    rng = np.random.default_rng(seed)
    arm = load_arm(random_urdf(rng, joints=joints, kinds=('revolute', 'continuous', 'fixed')), 'base', 'tip')
    metres, radians = 10.0**metres, 10.0**radians
    options = SolveOptions(position_tolerance=metres, orientation_tolerance=radians, **CALM)
    for pose in reachable_poses(arm, rng, 5):
        target = displaced(pose, rng, 0.95 * metres, 0.95 * radians)
        assert_answer(arm, solve(arm, target, options=options), target, options)


def test_a_target_beyond_the_arm_by_less_than_what_the_tolerances_allow_is_not_called_out_of_reach():
    arm = get_arm('planar3r')  # 0.9 m long, its wrist 0.2 m before the tip
    options = SolveOptions(position_tolerance=0.05, orientation_tolerance=0.5, **CALM)
    target = np.eye(4)
    target[0, 3] = 0.94
    target[:3, :3] = pin.utils.rotate('z', 0.45)
    assert_answer(arm, solve(arm, target, options=options), target, options)


@pytest.mark.parametrize('method', METHODS)
@pytest.mark.parametrize('step', [1e-5, 1e-6, 1e-9])
def test_targets_that_move_by_less_than_the_tolerance_are_followed(step, method):
    arm, q = get_arm('ur5'), np.array([0.0, -1.2, 1.5, -1.8, -1.57, 0.3])
    first = arm.forward(q)
    for k in range(1, 51):
        target = first.copy()
        target[0, 3] += k * step
        solution = solve(arm, target, q, SolveOptions(method=method, position_tolerance=1e-5, **CALM))
        before = np.linalg.norm(target[:3, 3] - arm.forward(q)[:3, 3])
        assert_answer(arm, solution, target)
        assert np.linalg.norm(target[:3, 3] - arm.forward(solution.q)[:3, 3]) < before
        q = solution.q
    if method != 'transpose':  # which lags behind
        assert arm.forward(q)[0, 3] - first[0, 3] == pytest.approx(50 * step, rel=0.05)


@pytest.mark.parametrize('method', METHODS)
def test_a_seed_within_tolerance_is_never_left_for_a_worse_answer(method):
    arm, rng = get_arm('puma560'), np.random.default_rng(4)
    for q in random_configurations(arm, rng, 100):
        q[4] = 1e-4 * rng.normal()  # singular: a step may lead anywhere
        target = displaced(arm.forward(q), rng, 0.9e-5, 0.9e-5)
        solution = solve(arm, target, q, SolveOptions(method=method, **CALM), trace=True)
        assert_answer(arm, solution, target)
        norms = solution.trace.column('error_norm')
        assert norms[-1] <= norms[0] and solution.attempts == 1
        np.testing.assert_array_equal(solution.trace.joint_positions[-1], solution.q)
        assert len(solution.trace) == solution.iterations + 1


@pytest.mark.parametrize('options', [{'choice': 'nearest'}, {'max_joint_jump': 1.0}])
@pytest.mark.parametrize('method', SEARCHING)
@pytest.mark.parametrize('robot', ['ur5', 'puma560', 'panda', 'iiwa14'])
def test_a_target_near_the_seed_is_answered_near_it_also_at_a_singular_wrist(robot, method, options):
    arm, rng = get_arm(robot), np.random.default_rng(5)
    options = SolveOptions(method=method, **options, **CALM)
    for q in random_configurations(arm, rng, 100):
        q[-2] = 0.02 * rng.normal() + (np.pi / 2 if robot == 'panda' else 0.0)
        q = np.clip(q, arm.lower, arm.upper)
        gap = rng.uniform(-1.0, 1.0, arm.n) * rng.choice([0.02, 0.05, 0.1])
        target = arm.forward(np.clip(q + gap, arm.lower, arm.upper))
        solution = solve(arm, target, q, options)
        assert_answer(arm, solution, target)
        assert solution.joint_distance <= 1.0
