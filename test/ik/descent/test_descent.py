"""One descent: its stop reasons, its caps, and limits that the others walk around."""

from __future__ import annotations

import numpy as np
import pytest
from numerics import (
    assert_answer,
    get_arm,
    pinocchio_tip,
    pose_errors,
    random_configurations,
    reachable_poses,
    twist,
)

from ros_ik_pkg.ik import METHODS, SolveOptions, Status, solve

DAMPED = ('dls', 'adaptive_dls', 'sdls')
LONE = {'max_attempts': 1, 'deadline': 0.0}


def descend(arm, target, seed, **options):
    return solve(arm, target, seed, SolveOptions(**{**LONE, **options}), trace=True)


def steps_of(solution):
    """Joint steps (k, n) between the rows of a trace."""
    return np.diff(solution.trace.joint_positions, axis=0)


# Stop reasons


@pytest.mark.parametrize('method', ['pinv', *DAMPED])
def test_a_descent_that_arrives_says_converged(method):
    arm = get_arm('iiwa14')
    target = pinocchio_tip(arm, arm.home + 0.2)
    solution = descend(arm, target, arm.home, method=method)
    assert solution.status is Status.CONVERGED
    assert_answer(arm, solution, target)


def test_a_descent_that_runs_out_of_steps_while_it_gets_better_says_max_iterations():
    arm = get_arm('puma560')
    target = pinocchio_tip(arm, arm.home + 0.2)
    solution = descend(arm, target, arm.home, method='transpose', max_iterations=30)
    assert (solution.status, solution.iterations) == (Status.MAX_ITERATIONS, 30)
    errors = solution.trace.column('error_norm')
    assert errors[-1] < errors[-2]


@pytest.mark.parametrize('method', DAMPED)
def test_a_descent_that_gets_no_nearer_says_stalled(method):
    arm = get_arm('puma560')
    target = np.eye(4)
    target[:3, 3] = 0.6, 0.0, 0.8  # a corner of the reach, where the wrist must let the orientation be
    solution = descend(arm, target, arm.home, method=method, max_iterations=10000)
    assert solution.status in (Status.STALLED, Status.OSCILLATING)
    assert solution.iterations < 2000


def test_steps_of_twice_the_length_go_up_and_down_and_say_oscillating():
    # with twice the Newton step the error of one joint changes its sign and keeps its size
    arm = get_arm('planar3r')
    target = pinocchio_tip(arm, arm.home + 0.05)
    solution = descend(arm, target, arm.home, method='pinv', step_size=2.0, max_iterations=1000)
    assert solution.status is Status.OSCILLATING


def test_a_step_that_is_not_finite_says_so_and_leaves_the_last_configuration():
    arm = get_arm('planar3r')
    straight = np.zeros(3)
    target = pinocchio_tip(arm, straight + 0.3)
    options = {'method': 'pinv', 'task_weights': (1, 1, 0, 0, 0, 1)}
    solution = descend(arm, target, straight, **options)
    assert (solution.status, solution.iterations) == (Status.NOT_FINITE, 0)
    np.testing.assert_array_equal(solution.q, straight)


def test_a_step_of_many_turns_says_diverged_unless_it_is_capped():
    arm = get_arm('planar3r')
    nearly_straight = np.array([0.0, 1e-4, 0.0])
    target = pinocchio_tip(arm, [0.4, 0.8, -0.5])
    options = {'method': 'pinv', 'task_weights': (1, 1, 0, 0, 0, 1)}
    assert descend(arm, target, nearly_straight, **options).status is Status.DIVERGED
    capped = descend(arm, target, nearly_straight, max_joint_step=0.3, **options)
    assert_answer(arm, capped, target)


# What a step may be


@pytest.mark.parametrize('method', METHODS)
def test_no_joint_steps_further_than_max_joint_step(method):
    arm = get_arm('panda')
    target = pinocchio_tip(arm, arm.home + 0.5)
    solution = descend(arm, target, arm.home, method=method, max_joint_step=0.05)
    assert np.max(np.abs(steps_of(solution))) <= 0.05 + 1e-15
    assert np.max(np.abs(steps_of(solution))) > 0.04


def test_adaptive_dls_has_a_cap_of_its_own():
    arm = get_arm('puma560')
    solution = descend(arm, pinocchio_tip(arm, arm.home + 1.5), arm.home, method='adaptive_dls')
    assert np.max(np.abs(steps_of(solution))) == pytest.approx(0.3)


@pytest.mark.parametrize('method', METHODS)
def test_the_step_size_scales_the_step(method):
    arm = get_arm('puma560')
    target = pinocchio_tip(arm, arm.home + 0.1)
    whole, half = (
        steps_of(descend(arm, target, arm.home, method=method, step_size=size, max_iterations=1))[0]
        for size in (1.0, 0.5)
    )
    np.testing.assert_allclose(half, 0.5 * whole, rtol=0, atol=1e-15)


@pytest.mark.parametrize('method', METHODS)
def test_weights_scale_the_rows_of_the_task(method):
    # a weight of 2 on all rows leaves every undamped rule as it is, and halves what damping does
    arm = get_arm('puma560')
    target = pinocchio_tip(arm, arm.home + 0.1)
    once = {
        'method': method,
        'max_iterations': 1,
        'dls_damping': 0.1,
        'adaptive_dls_gain': 0.0,
        'adaptive_dls_damping': 0.1,
    }
    twice = {**once, 'task_weights': (2.0,) * 6, 'dls_damping': 0.2, 'adaptive_dls_damping': 0.2}
    expected = steps_of(descend(arm, target, arm.home, **once))[0]
    np.testing.assert_allclose(steps_of(descend(arm, target, arm.home, **twice))[0], expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize('method', DAMPED)
def test_a_dropped_row_is_free(method):
    arm, rng = get_arm('puma560'), np.random.default_rng(2)
    for target in reachable_poses(arm, rng, 5):
        spun = target.copy()
        spun[:3, :3] = spun[:3, :3] @ pinocchio_tip(arm, np.full(6, 0.3))[:3, :3]  # any other orientation
        options = SolveOptions(method=method, task_weights=(1, 1, 1, 0, 0, 0), deadline=0.0)
        solution = solve(arm, spun, options=options)
        assert solution.converged
        assert pose_errors(arm, solution.q, spun)[0] <= 1e-5
        assert solution.orientation_error == 0.0


@pytest.mark.parametrize('method', DAMPED)
def test_one_dropped_axis_leaves_the_other_five_right(method):
    arm, rng = get_arm('puma560'), np.random.default_rng(4)
    options = SolveOptions(method=method, task_weights=(1, 1, 1, 1, 1, 0), deadline=0.0)
    for target in reachable_poses(arm, rng, 10):
        solution = solve(arm, target, options=options)
        assert solution.converged
        error = twist(arm, solution.q, target)
        assert np.linalg.norm(error[:3]) <= 1e-5 + 1e-12
        assert np.linalg.norm(error[3:5]) <= 1e-5 + 1e-12


# Limits


@pytest.mark.parametrize('robot', ['panda', 'iiwa14', 'puma560', 'stanford', 'planar3r'])
@pytest.mark.parametrize('method', METHODS)
def test_every_iterate_is_within_the_limits(method, robot):
    arm, rng = get_arm(robot), np.random.default_rng(9)
    options = SolveOptions(method=method, max_attempts=5, deadline=0.0, max_joint_step=0.5)
    at_limits = 0
    for target, seed in zip(reachable_poses(arm, rng, 10), random_configurations(arm, rng, 10)):
        target[:3, 3] *= 1.2  # drives joints into their limits
        trace = solve(arm, target, seed, options, trace=True).trace
        assert np.all((arm.lower <= trace.joint_positions) & (trace.joint_positions <= arm.upper))
        at_limits += np.count_nonzero(trace.column('joints_at_limits'))
    assert at_limits > 0


def wall_problem(robot, joint, seed):
    """Make up a seed with a joint at its upper limit and a target 0.15 rad behind it for this joint."""
    arm, rng = get_arm(robot), np.random.default_rng(seed)
    start = arm.home + rng.uniform(-0.3, 0.3, arm.n)
    start[joint] = arm.upper[joint]
    behind = start + rng.uniform(-0.1, 0.1, arm.n)
    behind[joint] = arm.upper[joint] + 0.15
    return arm, start, pinocchio_tip(arm, behind)


@pytest.mark.parametrize(('robot', 'joint'), [('iiwa14', 0), ('iiwa14', 4), ('panda', 0), ('panda', 2), ('panda', 4)])
@pytest.mark.parametrize('method', ['pinv', *DAMPED])
def test_the_null_space_walks_around_a_wall(method, robot, joint):
    for seed in range(5):
        arm, start, target = wall_problem(robot, joint, seed)
        solution = descend(arm, target, start, method=method)
        assert_answer(arm, solution, target)


@pytest.mark.parametrize('method', ['transpose', 'pinv', *DAMPED])
def test_a_joint_that_is_pushed_against_its_limit_stays_while_the_others_move(method):
    arm, start, target = wall_problem('iiwa14', 2, 0)
    J, e = arm.jacobian(start), twist(arm, start, target)
    assert J[:, 2] @ e > 0.0  # outwards
    step = steps_of(descend(arm, target, start, method=method, max_iterations=1))[0]
    assert step[2] == 0.0
    assert np.all(np.abs(np.delete(step, 2)) > 1e-6)


def test_the_others_step_as_if_the_joint_at_its_limit_were_not_there():
    arm, start, target = wall_problem('iiwa14', 2, 0)
    J, e = np.delete(arm.jacobian(start), 2, axis=1), twist(arm, start, target)
    step = steps_of(descend(arm, target, start, method='dls', dls_damping=0.1, max_iterations=1))[0]
    expected = J.T @ np.linalg.solve(J @ J.T + 0.01 * np.eye(6), e)
    np.testing.assert_allclose(np.delete(step, 2), expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize('method', METHODS)
def test_a_joint_at_its_limit_may_leave_it_inwards(method):
    arm = get_arm('panda')
    start = arm.home.copy()
    start[3] = arm.upper[3]
    target = pinocchio_tip(arm, start - 0.1 * np.eye(7)[3])
    step = steps_of(descend(arm, target, start, method=method, max_iterations=1))[0]
    assert step[3] < -0.001


@pytest.mark.parametrize('method', METHODS)
def test_joints_that_are_all_at_their_limits_do_no_harm(method):
    arm = get_arm('panda')
    target = pinocchio_tip(arm, arm.home)
    for corner in (arm.lower, arm.upper):
        solution = solve(arm, target, corner, SolveOptions(method=method, **LONE))
        assert np.all(np.isfinite(solution.q))
        assert np.all((arm.lower <= solution.q) & (solution.q <= arm.upper))


def test_without_limits_joints_pass_them():
    arm, start, target = wall_problem('puma560', 1, 0)
    free = descend(arm, target, start, method='dls', respect_limits=False)
    assert free.converged
    assert free.q[1] > arm.upper[1]
    assert not descend(arm, target, start, method='dls').q[1] > arm.upper[1]
