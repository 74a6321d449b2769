"""Self-motion: joints that the task leaves over go where they are wanted, and the tip does not notice."""

from __future__ import annotations

import numpy as np
import pytest
from numerics import (
    count_answers,
    get_arm,
    make_workspace,
    numeric_jacobian,
    pinocchio_tip,
    pose_errors,
    random_configurations,
    reachable_poses,
)

from ros_ik_pkg.ik import METHODS, SolveOptions, load_arm, solve, solve_batch
from ros_ik_pkg.ik.descent.self_motion import orthonormal_rows, project
from ros_ik_pkg.ik.options import NULL_SPACES

OBJECTIVES = NULL_SPACES[1:4]  # clearance: see test_clearance.py
SEVEN_JOINTS = ['panda', 'iiwa14']
DAMPED = [method for method in METHODS if method != 'transpose']
HELD = 1e-9  # m and rad, what a small step in the null space may move the tip
SMALL_STEP = 1e-5  # rad
CALM = {'deadline': 0.0, 'max_iterations': 20000}  # time for transpose too


def cost(kind, arm, q, posture):
    """What an objective makes small, written anew."""
    if kind == 'posture':
        return 0.5 * np.sum((q - posture) ** 2)
    if kind == 'limits':
        return 0.5 * np.sum(((q - (arm.upper + arm.lower) / 2) / ((arm.upper - arm.lower) / 2)) ** 2)
    return -np.sum(np.log(np.linalg.svd(numeric_jacobian(arm, q), compute_uv=False)))


def null_direction(arm, q):
    """Unit vector (7,) in the null space, by NumPy's SVD of differences of Pinocchio's kinematics."""
    return np.linalg.svd(numeric_jacobian(arm, q))[2][6]


def projected(J, direction):
    """What the compiled projector leaves of a direction (n,), given the Jacobian (6, n)."""
    work = make_workspace(1, J.shape[1])
    work.columns[:], work.e[:], work.null[:] = J.T, 0.0, direction
    project(work.W, orthonormal_rows(work), work.null)
    return work.null.copy()


def circle(arm, middle, count, radius=0.1):
    """Poses (count, 4, 4) on a circle in the y-z plane that begins and ends at `middle`."""
    poses = np.tile(middle, (count, 1, 1))
    angle = np.arange(1, count + 1) * 2.0 * np.pi / count
    poses[:, 1, 3] += radius * np.sin(angle)
    poses[:, 2, 3] += radius * (np.cos(angle) - 1.0)
    return poses


def go_round(arm, options, rounds=10, count=60):
    """Track a circle; return how far the joints are from where they began after each round (rounds,)."""
    q, gaps = arm.home, []
    for _ in range(rounds):
        for target in circle(arm, arm.forward(arm.home), count):
            solution = solve(arm, target, q, options)
            assert solution.converged
            q = solution.q
        gaps.append(np.abs(q - arm.home).max())
    return np.array(gaps)


@pytest.mark.parametrize('method', METHODS)
def test_after_ten_rounds_of_a_circle_posture_has_brought_the_joints_back(method):
    arm = get_arm('panda')
    options = SolveOptions(method=method, null_space='posture', posture=tuple(arm.home), **CALM)
    assert go_round(arm, options).max() < 1e-3


@pytest.mark.parametrize('method', METHODS)
def test_without_an_objective_the_joints_drift_on_a_circle(method):
    arm = get_arm('panda')
    assert go_round(arm, SolveOptions(method=method, **CALM))[-1] > 0.05


@pytest.mark.parametrize('sigma', [1.0, 1e-3, 1e-6, 0.0])
def test_a_small_step_in_the_null_space_leaves_the_tip_where_it_is_next_to_a_singularity_too(sigma):
    arm, random = get_arm('panda'), np.random.default_rng(1)
    for q in random_configurations(arm, random, 20):
        # joint 4 stretched and joint 6 turned: the wrist is singular where sigma is 0
        q = np.where([0, 0, 0, 0, 0, 1, 0], sigma * q, q) if sigma < 1.0 else q
        step = projected(arm.jacobian(q), random.normal(size=7))
        step *= SMALL_STEP / np.abs(step).max()
        assert max(pose_errors(arm, q + step, pinocchio_tip(arm, q))) < HELD


def test_the_damped_projector_would_leak():
    # What the exact one is for: I - J^T (J J^T + lambda^2 I)^-1 J moves the tip.
    arm, random = get_arm('panda'), np.random.default_rng(1)
    q = random_configurations(arm, random, 1)[0]
    J, damping = arm.jacobian(q), 0.1
    leaky = np.eye(7) - J.T @ np.linalg.solve(J @ J.T + damping**2 * np.eye(6), J)
    step = leaky @ random.normal(size=7)
    step *= SMALL_STEP / np.abs(step).max()
    assert max(pose_errors(arm, q + step, pinocchio_tip(arm, q))) > 100.0 * HELD


@pytest.mark.parametrize('rank', range(7))
def test_the_projector_is_that_of_numpy_for_every_rank(rank):
    random = np.random.default_rng(rank)
    J = random.normal(size=(6, rank)) @ random.normal(size=(rank, 8))
    direction = random.normal(size=8)
    expected = direction - np.linalg.pinv(J, rcond=1e-9) @ J @ direction
    np.testing.assert_allclose(projected(J, direction), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize('robot', SEVEN_JOINTS)
@pytest.mark.parametrize('kind', OBJECTIVES)
def test_an_objective_only_gets_better_and_ends_where_it_can_get_no_better(kind, robot):
    arm, random = get_arm(robot), np.random.default_rng(5)
    targets, seeds = reachable_poses(arm, random, 60), random_configurations(arm, random, 60)
    slopes = []
    for target, seed in zip(targets, seeds):
        plain = solve(arm, target, seed, SolveOptions(deadline=0.0))
        better = solve(arm, target, seed, SolveOptions(null_space=kind, deadline=0.0))
        assert better.converged and np.all((arm.lower <= better.q) & (better.q <= arm.upper))
        assert max(pose_errors(arm, better.q, target)) <= 1e-5 + 1e-12
        assert cost(kind, arm, better.q, seed) <= cost(kind, arm, plain.q, seed) + 1e-9
        if not better.joints_at_limits:
            step = 1e-5 * null_direction(arm, better.q)
            ahead, behind = (cost(kind, arm, better.q + s * step, seed) for s in (1.0, -1.0))
            slopes.append(abs(ahead - behind) / 2e-5)
    assert np.median(slopes) < 1e-4 and np.mean(np.array(slopes) < 1e-2) > 0.9


@pytest.mark.parametrize('kind', OBJECTIVES)
@pytest.mark.parametrize('method', DAMPED)
def test_every_method_solves_as_many_poses_with_an_objective(method, kind):
    arm, random = get_arm('panda'), np.random.default_rng(7)
    targets, seeds = reachable_poses(arm, random, 100), random_configurations(arm, random, 100)
    options = SolveOptions(method=method, null_space=kind, deadline=0.0)
    assert count_answers(arm, solve_batch(arm, targets, seeds, options), targets) == 1.0


@pytest.mark.parametrize('kind', OBJECTIVES)
def test_an_arm_without_joints_to_spare_is_left_alone(kind):
    arm, random = get_arm('ur5'), np.random.default_rng(2)
    targets, seeds = reachable_poses(arm, random, 20), random_configurations(arm, random, 20)
    for target, seed in zip(targets, seeds):
        plain = solve(arm, target, seed, SolveOptions(deadline=0.0))
        with_objective = solve(arm, target, seed, SolveOptions(null_space=kind, deadline=0.0))
        assert np.abs(plain.q - with_objective.q).max() < 1e-3


def test_posture_without_numbers_is_nearness_to_the_reference():
    arm, random = get_arm('panda'), np.random.default_rng(3)
    targets, seeds = reachable_poses(arm, random, 20), random_configurations(arm, random, 20)
    for target, seed in zip(targets, seeds):
        given = SolveOptions(null_space='posture', posture=tuple(arm.home), deadline=0.0)
        implied = SolveOptions(null_space='posture', deadline=0.0)
        assert solve(arm, target, seed, given).q.tolist() == solve(arm, target, seed, implied, arm.home).q.tolist()


def test_one_solve_moves_no_joint_further_in_the_null_space_than_it_may():
    arm = get_arm('panda')
    target, posture = arm.forward(arm.home), arm.home + 0.5 * null_direction(arm, arm.home)
    q, steps = arm.home, []
    options = SolveOptions(null_space='posture', posture=tuple(posture), null_space_step=0.02, deadline=0.0)
    for _ in range(60):
        solution = solve(arm, target, q, options)
        assert solution.converged
        steps.append(np.abs(solution.q - q).max())
        q = solution.q
    far = solve(arm, target, arm.home, SolveOptions(null_space='posture', posture=tuple(posture), deadline=0.0))
    assert max(steps) < 0.021 and steps[0] > 0.019 and steps[-1] < 1e-4
    np.testing.assert_allclose(q, far.q, rtol=0, atol=1e-3)


def test_a_task_with_rows_to_spare_leaves_more_joints_to_the_posture():
    arm, random = get_arm('panda'), np.random.default_rng(4)
    for target, seed in zip(reachable_poses(arm, random, 20), random_configurations(arm, random, 20)):
        options = [
            SolveOptions(null_space='posture', task_weights=rows, deadline=0.0)
            for rows in ((1, 1, 1, 1, 1, 1), (1, 1, 1, 0, 0, 0))
        ]
        gaps = [np.linalg.norm(solve(arm, target, seed, option).q - seed) for option in options]
        assert gaps[1] < gaps[0]


def test_the_steps_of_the_self_motion_are_in_the_trace():
    arm = get_arm('panda')
    target, seed = arm.forward(arm.home + 0.3), arm.home
    plain = solve(arm, target, seed, SolveOptions(max_attempts=1, deadline=0.0), trace=True)
    options = SolveOptions(max_attempts=1, null_space='limits', deadline=0.0)
    solution = solve(arm, target, seed, options, trace=True)
    assert plain.converged and len(solution.trace) > len(plain.trace) + 1
    assert len(solution.trace) == solution.iterations + 1
    steps = np.linalg.norm(np.diff(solution.trace.joint_positions, axis=0), axis=1)
    np.testing.assert_allclose(solution.trace.column('step_norm')[:-1], steps, rtol=0, atol=1e-12)


def test_a_posture_for_another_arm_is_refused():
    with pytest.raises(ValueError, match='posture has 6 numbers; expected 7'):
        solve(load_arm('panda'), np.eye(4), options=SolveOptions(posture=(0.0,) * 6))


def test_self_motion_does_not_leave_max_joint_jump():
    arm, random = get_arm('panda'), np.random.default_rng(8)
    for q in random_configurations(arm, random, 30):
        seed = np.clip(q + random.uniform(-0.05, 0.05, 7), arm.lower, arm.upper)
        plain = solve(arm, arm.forward(q), seed, SolveOptions(max_joint_jump=0.3, deadline=0.0))
        moved = solve(arm, arm.forward(q), seed, SolveOptions(max_joint_jump=0.3, null_space='limits', deadline=0.0))
        assert moved.converged == plain.converged
        assert not moved.converged or moved.joint_distance <= 0.3


def test_joints_at_limits_do_not_spoil_the_way_of_the_others():
    arm, random = get_arm('panda'), np.random.default_rng(9)
    upper = arm.upper - 1e-3
    for q in random_configurations(arm, random, 30):
        posture = np.where(random.random(7) < 0.3, upper, q)  # towards the limits of some
        place = {'task_weights': (1, 1, 1, 0, 0, 0), 'deadline': 0.0}
        options = SolveOptions(null_space='posture', posture=tuple(posture), **place)
        solution = solve(arm, arm.forward(q), q, options)
        assert solution.converged and solution.iterations < 60
        assert cost('posture', arm, solution.q, posture) <= cost('posture', arm, q, posture) + 1e-9


@pytest.mark.parametrize('nearly', [1e-3, 1e-6, 1e-8])
def test_rows_that_nearly_depend_on_others_come_out_orthonormal_to_rounding(nearly):
    rng, work = np.random.default_rng(0), make_workspace(1, 9)
    work.columns[:], work.e[:] = rng.normal(size=(9, 6)), 0.0
    work.columns[:, 3:] = work.columns[:, :3] + nearly * work.columns[:, 3:]
    rank = orthonormal_rows(work)
    assert rank == 6
    np.testing.assert_allclose(work.W @ work.W.T, np.eye(6), rtol=0, atol=1e-14)
