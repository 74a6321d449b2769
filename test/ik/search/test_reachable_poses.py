"""Every reachable pose is solved, by Pinocchio's judgement, on arms that are shipped and on arms made up here."""

from __future__ import annotations

import numpy as np
import pytest
from chains import random_urdf
from numerics import assert_answer, count_answers, get_arm, random_configurations, reachable_poses

from ros_ik_pkg.ik import SolveOptions, load_arm, solve, solve_batch

COUNT = 500
CALM = {'deadline': 0.0}  # what a busy machine must not change


def problems(arm, seed, count):
    rng = np.random.default_rng(seed)
    return reachable_poses(arm, rng, count), random_configurations(arm, rng, count)


@pytest.mark.parametrize('robot', ['panda', 'ur5', 'iiwa14', 'puma560'])
def test_the_default_method_solves_every_pose(robot):
    arm = get_arm(robot)
    targets, seeds = problems(arm, 2024, COUNT)
    assert count_answers(arm, solve_batch(arm, targets, seeds, SolveOptions(**CALM)), targets) == 1.0


@pytest.mark.parametrize('method', ['pinv', 'dls', 'sdls'])
@pytest.mark.parametrize('robot', ['panda', 'ur5', 'iiwa14', 'puma560'])
def test_the_other_methods_solve_nearly_every_pose(robot, method):
    arm = get_arm(robot)
    targets, seeds = problems(arm, 2025, COUNT)
    assert count_answers(arm, solve_batch(arm, targets, seeds, SolveOptions(method=method, **CALM)), targets) >= 0.99


@pytest.mark.parametrize('robot', ['panda', 'puma560'])
def test_the_transpose_solves_poses_if_it_is_given_the_steps(robot):
    arm = get_arm(robot)
    targets, seeds = problems(arm, 2026, 20)
    loose = SolveOptions(
        method='transpose', max_iterations=3000, position_tolerance=1e-3, orientation_tolerance=1e-3, **CALM
    )
    assert count_answers(arm, solve_batch(arm, targets, seeds, loose), targets, loose) >= 0.9


@pytest.mark.parametrize('method', ['pinv', 'dls', 'adaptive_dls', 'sdls'])
@pytest.mark.parametrize('joints', [6, 7])
def test_arms_made_up_here_are_solved_too(joints, method):
    solved = []
    for seed in range(4):
        kinds = ('revolute', 'revolute', 'continuous', 'prismatic', 'fixed')
        arm = load_arm(random_urdf(np.random.default_rng(seed), joints=joints, kinds=kinds), 'base', 'tip')
        targets, seeds = problems(arm, seed, 60)
        solved.append(
            count_answers(arm, solve_batch(arm, targets, seeds, SolveOptions(method=method, **CALM)), targets)
        )
    assert np.mean(solved) >= (1.0 if method == 'adaptive_dls' else 0.99)


@pytest.mark.parametrize('joints', [1, 2, 3, 4, 5, 8, 10, 12])
def test_arms_of_every_number_of_joints_are_solved(joints):
    arm = load_arm(random_urdf(np.random.default_rng(joints), joints=joints, mimics=joints % 2), 'base', 'tip')
    targets, seeds = problems(arm, joints, 40)
    assert count_answers(arm, solve_batch(arm, targets, seeds, SolveOptions(**CALM)), targets) == 1.0


@pytest.mark.parametrize('robot', ['panda', 'ur5', 'iiwa14', 'puma560', 'stanford'])
def test_a_pose_with_joints_at_their_limits_is_solved(robot):
    arm, rng = get_arm(robot), np.random.default_rng(3)
    for q in random_configurations(arm, rng, 20):
        joint = rng.integers(arm.n)
        q[joint] = (arm.lower, arm.upper)[rng.integers(2)][joint]
        target = arm.forward(q)
        assert_answer(arm, solve(arm, target, options=SolveOptions(**CALM)), target)


@pytest.mark.parametrize(
    ('robot', 'q'),
    [
        ('puma560', [0.0, -1.0, -0.5, 0.3, 0.0, 0.7]),
        ('ur5', [0.3, -1.0, 1.0, 0.2, 0.0, 0.5]),
        ('ur5', [0.3, -1.0, 0.0, 0.2, 1.0, 0.5]),
        ('panda', [0.0, 0.5, 0.0, -1.5, 0.0, 1.5, 0.3]),
        ('iiwa14', [0.2, 0.4, 0.1, 0.0, 0.3, 0.4, 0.0]),
        ('planar3r', [0.4, 0.0, 0.0]),
    ],
)
def test_a_singular_pose_is_solved(robot, q):
    arm = get_arm(robot)
    target = arm.forward(q)
    for seed in random_configurations(arm, np.random.default_rng(5), 5):
        assert_answer(arm, solve(arm, target, seed, SolveOptions(**CALM)), target)
