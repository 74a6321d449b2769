"""Restarts, the choice among answers, whole turns, jumps, the deadline; branches against a closed form."""

from __future__ import annotations

import time

import numpy as np
import pytest
from chains import chain, random_urdf
from numerics import (
    assert_answer,
    count_answers,
    get_arm,
    pinocchio_tip,
    pose_errors,
    random_configurations,
    reachable_poses,
)

from ros_ik_pkg.ik import METHODS, SolveOptions, Status, load_arm, solve, solve_batch

TURN = 2.0 * np.pi
CALM = {'deadline': 0.0}  # what a busy machine must not change
SEARCHING = ('pinv', 'dls', 'adaptive_dls', 'sdls')


def whole_turns_aside(gap):
    return gap - TURN * np.round(gap / TURN)


def apart(a, b):
    """Largest difference of two configurations of revolute joints, whole turns aside [rad]."""
    return np.max(np.abs(whole_turns_aside(np.asarray(a) - b)))


# Restarts


@pytest.mark.parametrize('robot', ['puma560', 'panda', 'iiwa14', 'ur5', 'stanford', 'planar3r'])
def test_restarts_find_what_one_descent_does_not(robot):
    arm, rng = get_arm(robot), np.random.default_rng(1)
    lone = found = 0
    for target, seed in zip(reachable_poses(arm, rng, 40), random_configurations(arm, rng, 40)):
        lone += solve(arm, target, seed, SolveOptions(max_attempts=1, **CALM)).converged
        solution = solve(arm, target, seed, SolveOptions(**CALM))
        assert_answer(arm, solution, target)
        found += 1
    assert lone < found


def test_the_seed_comes_first_and_attempts_count_it():
    arm = get_arm('puma560')
    target = pinocchio_tip(arm, arm.home + 0.1)
    solution = solve(arm, target, arm.home, SolveOptions(**CALM), trace=True)
    assert (solution.converged, solution.attempts) == (True, 1)
    np.testing.assert_array_equal(solution.trace.joint_positions[0], arm.home)


@pytest.mark.parametrize('max_attempts', [1, 2, 7])
def test_there_are_no_more_attempts_than_allowed(max_attempts):
    solution = solve(get_arm('puma560'), np.eye(4), options=SolveOptions(max_attempts=max_attempts, **CALM))
    assert not solution.converged
    assert solution.attempts == max_attempts


def test_the_closest_of_all_approaches_is_returned():
    arm = get_arm('puma560')
    few, many = (
        solve(arm, np.eye(4), options=SolveOptions(method='sdls', max_attempts=count, **CALM)) for count in (2, 60)
    )
    assert np.linalg.norm(pose_errors(arm, many.q, np.eye(4))) <= np.linalg.norm(pose_errors(arm, few.q, np.eye(4)))


@pytest.mark.parametrize('method', METHODS)
def test_without_attempts_the_joints_come_as_near_as_they_can_from_the_seed(method):
    arm = get_arm('ur5')
    target = arm.forward(arm.home + 0.1)
    options = SolveOptions(method=method, max_attempts=0, deadline=0.0)
    reached = solve(arm, target, arm.home, options)
    assert_answer(arm, reached, target)
    assert reached.attempts == 0 and np.abs(reached.q - arm.home).max() < 0.3
    target[:3, 3] *= 3.0
    short = solve(arm, target, arm.home, options, trace=True)
    assert short.status is Status.UNREACHABLE and short.attempts == 0
    assert len(short.trace) == short.iterations + 1
    anywhere = solve(arm, target, arm.home, SolveOptions(method='sdls', deadline=0.0))
    here, there = (np.linalg.norm(pose_errors(arm, solution.q, target)) for solution in (short, anywhere))
    assert here > 0.99 * there


# Deadline


@pytest.mark.parametrize('method', ['transpose', *SEARCHING])
def test_the_deadline_is_kept_within_a_millisecond(method):
    arm = get_arm('iiwa14')
    target = np.eye(4)  # within the sphere, but the arm cannot fold that far; of seven joints no closed form says so
    options = SolveOptions(method=method, deadline=5e-5, max_attempts=1000000, max_iterations=100000)
    over = []
    for _ in range(5):
        before = time.thread_time()  # of this thread: a busy machine does not count
        solution = solve(arm, target, options=options)
        over.append(time.thread_time() - before - options.deadline)
        assert solution.status is Status.DEADLINE
        assert solution.solve_time >= options.deadline
    assert min(over) < 1e-3


def test_an_answer_found_in_time_is_an_answer():
    arm = get_arm('puma560')
    target = pinocchio_tip(arm, arm.home + 0.1)
    options = SolveOptions(choice='all', deadline=1e-6)
    solution = solve(arm, target, arm.home + 0.1, options)
    assert_answer(arm, solution, target)


# Nearest


@pytest.mark.parametrize('robot', ['puma560', 'ur5', 'panda', 'iiwa14', 'stanford'])
def test_nearest_is_no_further_than_first_and_often_nearer(robot):
    arm, rng = get_arm(robot), np.random.default_rng(2)
    fine = {'position_tolerance': 1e-9, 'orientation_tolerance': 1e-9, **CALM}  # tolerance is room near singularities
    nearer = 0
    for target, seed in zip(reachable_poses(arm, rng, 40), random_configurations(arm, rng, 40)):
        first, nearest = (
            solve(arm, target, seed, SolveOptions(choice=choice, **fine)) for choice in ('first', 'nearest')
        )
        assert_answer(arm, nearest, target)
        gap = np.linalg.norm(first.q - seed) - np.linalg.norm(nearest.q - seed)
        assert gap >= -1e-5  # both are within tolerance of the same answer
        nearer += gap > 0.01
    assert nearer >= 10


@pytest.mark.parametrize('robot', ['panda', 'iiwa14'])
def test_the_search_for_the_nearest_goes_on_until_forty_attempts_bring_nothing_nearer(robot):
    arm, rng, late = get_arm(robot), np.random.default_rng(3), 0
    for target, seed in zip(reachable_poses(arm, rng, 12), random_configurations(arm, rng, 12)):

        def nearest(attempts, target=target, seed=seed):
            return solve(arm, target, seed, SolveOptions(choice='nearest', max_attempts=attempts, **CALM))

        found = nearest(1000)
        if found.attempts > 42:
            late += 1
            assert np.array_equal(nearest(found.attempts - 40).q, found.q)
            assert not np.array_equal(nearest(found.attempts - 41).q, found.q)
    assert late >= 6


def test_nearest_is_measured_from_the_reference_where_there_is_one():
    arm, rng = get_arm('ur5'), np.random.default_rng(3)
    target = reachable_poses(arm, rng, 1)[0]
    everywhere = solve(arm, target, options=SolveOptions(choice='all', respect_limits=True, **CALM)).solutions
    for reference in everywhere:
        solution = solve(arm, target, arm.home, SolveOptions(choice='nearest', **CALM), reference)
        assert solution.joint_distance < 1e-2


@pytest.mark.parametrize('choice', ['first', 'nearest'])
@pytest.mark.parametrize('method', SEARCHING[1:])
def test_a_target_beside_the_seed_is_solved_beside_it_next_to_a_singular_wrist_too(method, choice):
    # sdls creeps there: of these descents from the seed, six end a few micrometres short after all of their steps
    arm, rng = get_arm('ur5'), np.random.default_rng(5)
    for trial in range(600):
        seed = rng.uniform(-3.0, 3.0, 6)
        if trial % 2:
            seed[4] = 0.02 * rng.normal()
        step = rng.normal(size=6)
        step *= rng.choice([0.02, 0.05, 0.1]) / np.abs(step).max()
        target = arm.forward(seed + step)
        solution = solve(arm, target, seed, SolveOptions(method=method, choice=choice, **CALM))
        assert_answer(arm, solution, target)
        assert np.abs(solution.q - seed).max() < 1.0


def test_joint_weights_say_whose_distance_counts():
    arm, rng = get_arm('puma560'), np.random.default_rng(5)
    target = reachable_poses(arm, rng, 1)[0]
    every = solve(arm, target, options=SolveOptions(choice='all', **CALM)).solutions
    assert len(every) >= 4
    for joint in range(3):
        weights = tuple(float(i == joint) for i in range(6))
        solution = solve(arm, target, arm.home, SolveOptions(choice='nearest', joint_weights=weights, **CALM))
        nearest = np.min(np.abs(every - arm.home)[:, joint])
        assert abs(solution.q - arm.home)[joint] <= nearest + 1e-3


# All


def puma_branches(arm, target):
    """Every configuration (k, 6) for a pose of the Puma 560, in closed form (Craig, section 4.7), in its limits."""
    a2, a3, d3, d4 = 0.432, 0.0203, 0.1254, 0.4318
    x, y, z = target[:3, 3]
    flat, far = x * x + y * y - d3 * d3, x * x + y * y + z * z - a2 * a2 - a3 * a3 - d3 * d3 - d4 * d4
    lean = a3 * a3 + d4 * d4 - (far / (2.0 * a2)) ** 2
    found = []
    for shoulder in (1.0, -1.0):
        q1 = np.arctan2(y, x) - np.arctan2(d3, shoulder * np.sqrt(flat))
        along = np.cos(q1) * x + np.sin(q1) * y
        for elbow in (1.0, -1.0):
            q3 = np.arctan2(a3, d4) - np.arctan2(far / (2.0 * a2), elbow * np.sqrt(lean))
            s3, c3 = np.sin(q3), np.cos(q3)
            q23 = np.arctan2((-a3 - a2 * c3) * z - along * (d4 - a2 * s3), (a2 * s3 - d4) * z + (a3 + a2 * c3) * along)
            R = pinocchio_tip(arm, [q1, q23 - q3, q3, 0.0, 0.0, 0.0])[:3, :3].T @ target[:3, :3]
            for wrist in (1.0, -1.0):  # what is left is Rz(q4) Ry(-q5) Rz(q6)
                q5 = wrist * np.arctan2(np.hypot(R[0, 2], R[1, 2]), R[2, 2])
                q4 = np.arctan2(-wrist * R[1, 2], -wrist * R[0, 2])
                q6 = np.arctan2(-wrist * R[2, 1], wrist * R[2, 0])
                found.append([q1, q23 - q3, q3, q4, q5, q6])
    turned = (np.array(found)[:, None] + TURN * np.arange(-2, 3)[:, None]).transpose(0, 2, 1)  # (k, 6, 5)
    inside = (arm.lower[:, None] <= turned) & (turned <= arm.upper[:, None])
    first = np.argmax(inside, axis=2)
    kept = np.take_along_axis(turned, first[:, :, None], axis=2)[:, :, 0]
    return kept[np.all(np.any(inside, axis=2), axis=1)]


def test_all_finds_the_branches_of_the_closed_form_and_no_others():
    arm, rng = get_arm('puma560'), np.random.default_rng(6)
    expected = found = 0
    for q, target in ((q, pinocchio_tip(arm, q)) for q in random_configurations(arm, rng, 40)):
        if np.linalg.svd(arm.jacobian(q), compute_uv=False)[-1] < 0.02:
            continue  # near a singularity, answers within tolerance are more than one for each branch
        branches = puma_branches(arm, target)
        for branch in branches:
            assert np.max(pose_errors(arm, branch, target)) < 1e-7
        solution = solve(arm, target, options=SolveOptions(choice='all', **CALM))
        expected += len(branches)
        found += sum(min(apart(branch, answer) for answer in solution.solutions) < 0.01 for branch in branches)
        for answer in solution.solutions:
            assert min(apart(branch, answer) for branch in branches) < 0.01
        assert len(solution.solutions) <= len(branches)
    assert found >= 0.98 * expected


@pytest.mark.parametrize(
    ('robot', 'q'), [('puma560', [0.3, -1.2, -1.3, 0.9, 0.8, 0.5]), ('ur5', [0.5, -1.2, 1.4, -0.9, 1.1, 0.3])]
)
def test_all_finds_eight_branches_of_a_six_axis_arm(robot, q):
    arm = get_arm(robot)
    target = pinocchio_tip(arm, q)
    solution = solve(arm, target, options=SolveOptions(choice='all', **CALM))
    answers = solution.solutions
    assert len(answers) == 8
    for k, answer in enumerate(answers):
        assert np.max(pose_errors(arm, answer, target)) <= 2e-5
        assert np.all((arm.lower <= answer) & (answer <= arm.upper))
        assert all(apart(answer, other) > 0.1 for other in answers[:k])
    np.testing.assert_array_equal(solution.q, answers[0])
    distances = np.linalg.norm(answers - arm.home, axis=1)
    assert np.all(np.diff(distances) >= 0.0)


def test_there_is_no_list_unless_it_is_asked_for():
    arm = get_arm('ur5')
    assert solve(arm, pinocchio_tip(arm, arm.home)).solutions is None


def test_all_of_nothing_is_an_empty_list():
    solution = solve(get_arm('puma560'), np.eye(4), options=SolveOptions(choice='all', max_attempts=20, **CALM))
    assert not solution.converged
    assert solution.solutions.shape == (0, 6)


# Whole turns


@pytest.mark.parametrize('turns', [-3, -1, 0, 1, 2, 7])
def test_a_continuous_joint_is_answered_with_the_angle_nearest_the_reference(turns):
    text = chain(
        ('j1', 'continuous', {}), ('j2', 'revolute', {'axis': (0, 1, 0)}), ('j3', 'continuous', {'axis': (1, 0, 0)})
    )
    arm = load_arm(text)
    q = np.array([0.4, 0.5, -1.0])
    target = pinocchio_tip(arm, q)
    reference = np.add(q, [TURN * turns + 0.3, 0.0, -TURN * turns - 0.5])
    for choice in ('first', 'nearest'):
        solution = solve(arm, target, q + 0.1, SolveOptions(choice=choice, **CALM), reference)
        assert_answer(arm, solution, target)
        assert np.all(np.abs(solution.q - reference)[[0, 2]] <= np.pi + 1e-9)


def test_a_joint_of_several_turns_is_answered_with_the_nearest_angle_within_its_limits():
    arm, rng = get_arm('ur5'), np.random.default_rng(8)
    turns = TURN * np.arange(-3, 4)
    for target in reachable_poses(arm, rng, 20):
        reference = rng.uniform(arm.lower, arm.upper)
        solution = solve(arm, target, options=SolveOptions(**CALM), reference=reference)
        assert_answer(arm, solution, target)
        for i in range(arm.n):
            equivalents = solution.q[i] + turns
            inside = equivalents[(arm.lower[i] <= equivalents) & (equivalents <= arm.upper[i])]
            assert abs(solution.q[i] - reference[i]) <= np.min(np.abs(inside - reference[i])) + 1e-9


def test_a_reference_far_outside_the_limits_leaves_answers_within_them():
    arm, rng = get_arm('ur5'), np.random.default_rng(9)
    for target in reachable_poses(arm, rng, 10):
        solution = solve(arm, target, options=SolveOptions(**CALM), reference=np.full(6, 100.0))
        assert_answer(arm, solution, target)
        assert np.all(solution.q > arm.upper - TURN - 1e-9)  # as near as the limits let it


def test_ordinary_revolute_joints_are_never_turned():
    arm, rng = get_arm('panda'), np.random.default_rng(10)
    for target in reachable_poses(arm, rng, 10):
        solution = solve(arm, target, options=SolveOptions(**CALM), reference=np.full(7, 20.0), trace=True)
        np.testing.assert_array_equal(solution.q, solution.trace.joint_positions[-1])


def test_a_seed_turned_beyond_the_limits_is_turned_back_before_it_is_clipped():
    arm = get_arm('puma560')
    q = arm.home + 0.1
    seed = q + TURN * np.array([0, 0, 0, 2, 0, -1])
    solution = solve(arm, pinocchio_tip(arm, q), seed, SolveOptions(**CALM))
    assert (solution.seed_clipped, solution.iterations) == (True, 0)
    np.testing.assert_allclose(solution.q, q, rtol=0, atol=1e-12)


# Jumps


@pytest.mark.parametrize('choice', ['first', 'nearest', 'all'])
@pytest.mark.parametrize('method', SEARCHING)
def test_answers_too_far_from_the_reference_are_refused_and_that_is_said(method, choice):
    arm = get_arm('puma560')
    target = pinocchio_tip(arm, arm.home + 0.5)
    options = SolveOptions(method=method, choice=choice, max_joint_jump=0.1, max_attempts=60, **CALM)
    solution = solve(arm, target, arm.home, options)
    assert solution.status is Status.JOINT_JUMP
    assert not solution.converged
    assert solution.joint_distance > 0.1
    assert np.max(pose_errors(arm, solution.q, target)) <= 1e-5 + 1e-12  # the pose is right, the way too long
    assert solution.joint_distance == pytest.approx(np.max(np.abs(solution.q - arm.home)))
    if choice == 'all':
        assert len(solution.solutions) == 0


@pytest.mark.parametrize('robot', ['puma560', 'ur5', 'panda'])
def test_an_answer_is_never_further_than_max_joint_jump(robot):
    arm, rng = get_arm(robot), np.random.default_rng(11)
    refused = 0
    for seed in random_configurations(arm, rng, 30):
        target = pinocchio_tip(arm, np.clip(seed + rng.uniform(-0.6, 0.6, arm.n), arm.lower, arm.upper))
        solution = solve(arm, target, seed, SolveOptions(max_joint_jump=0.6, **CALM))
        refused += solution.status is Status.JOINT_JUMP
        if solution.converged:
            assert np.max(np.abs(solution.q - seed)) <= 0.6
    assert refused <= 6  # there always is an answer


def test_a_jump_that_one_branch_needs_is_avoided_by_another():
    arm = get_arm('puma560')
    near = arm.home + 0.05
    target = pinocchio_tip(arm, near)
    far_seed = np.add(near, [0.0, 0.0, 0.0, 2.6, -1.7, -2.6])  # the wrist turned over
    solution = solve(arm, target, far_seed, SolveOptions(max_joint_jump=0.2, **CALM), reference=arm.home)
    assert_answer(arm, solution, target)
    assert solution.joint_distance <= 0.2


def test_random_chains_are_searched_as_well():
    for seed in range(6):
        rng = np.random.default_rng(seed)
        arm = load_arm(
            random_urdf(rng, joints=6 + seed % 2, kinds=('revolute', 'prismatic', 'continuous')), 'base', 'tip'
        )
        for target in reachable_poses(arm, rng, 10):
            assert_answer(arm, solve(arm, target, options=SolveOptions(**CALM)), target)


@pytest.mark.parametrize('method', ['dls', 'adaptive_dls', 'sdls'])
def test_a_target_a_centimetre_too_far_is_said_to_be_out_of_reach_or_stalled(method):
    # That some descent on the way diverged is not why there is no answer.
    arm = get_arm('ur5')
    for q in random_configurations(arm, np.random.default_rng(8), 40):
        q[2] = 0.0  # the elbow stretched
        target = pinocchio_tip(arm, q)
        outwards = target[:3, 3] - [0.0, 0.0, 0.0892]  # from the shoulder
        target[:3, 3] += 0.01 * outwards / np.linalg.norm(outwards)
        solution = solve(arm, target, q, SolveOptions(method=method, deadline=0.0))
        assert solution.status in (Status.CONVERGED, Status.UNREACHABLE, Status.STALLED, Status.MAX_ITERATIONS)


@pytest.mark.parametrize('method', SEARCHING)
@pytest.mark.parametrize('null_space', ['none', 'manipulability'])
def test_a_chain_of_seventeen_joints_is_solved(method, null_space):
    arm = load_arm(random_urdf(np.random.default_rng(4), joints=17, branches=0, kinds=('revolute',)))
    rng = np.random.default_rng(5)
    targets, seeds = reachable_poses(arm, rng, 20), random_configurations(arm, rng, 20)
    options = SolveOptions(method=method, null_space=null_space, deadline=0.0)
    assert count_answers(arm, solve_batch(arm, targets, seeds, options), targets) == 1.0


def last_rows(trace):
    """Iteration and error norm at which each attempt of a trace ends."""
    attempts = trace.column('attempt')
    ends = np.append(np.flatnonzero(np.diff(attempts)), len(trace) - 1)
    return trace.column('iteration')[ends], trace.column('error_norm')[ends]


@pytest.mark.parametrize(('options', 'left'), [({}, True), ({'task_weights': (1, 1, 1, 1, 1, 0)}, False),
                                               ({'choice': 'nearest'}, False), ({'max_joint_jump': 9.0}, False)])
def test_a_seed_is_left_after_two_steps_only_for_the_first_solution_of_a_whole_pose(options, left):
    arm, rng = get_arm('ur5'), np.random.default_rng(12)
    given_up = 0
    for target, seed in zip(reachable_poses(arm, rng, 40), random_configurations(arm, rng, 40)):
        trace = solve(arm, target, seed, SolveOptions(**options, **CALM), trace=True).trace
        iterations, norms = last_rows(trace)
        given_up += iterations[0] == 2 and norms[0] > 0.2
    assert (given_up > 0) == left


def test_the_closest_approach_starts_from_the_nearest_iterate_of_all_attempts():
    arm, rng = get_arm('puma560'), np.random.default_rng(13)
    for target in reachable_poses(arm, rng, 20):
        target[:3, 3] *= 0.02  # beside the first axis, where the wrist cannot come
        solution = solve(arm, target, options=SolveOptions(max_attempts=20, **CALM), trace=True)
        nearest = solution.trace.column('error_norm').min()
        assert np.linalg.norm(pose_errors(arm, solution.q, target)) <= 1.0011 * nearest


def test_starts_that_single_precision_puts_outside_narrow_limits_are_brought_inside():
    narrow = {'lower': 1.1, 'upper': 1.1 + 1e-9}  # less than single precision tells apart
    arm = load_arm(chain(('j1', 'revolute', {}), ('j2', 'revolute', {'axis': (0, 1, 0), **narrow}),
                         ('j3', 'revolute', {'axis': (1, 0, 0)})))
    trace = solve(arm, np.eye(4), options=SolveOptions(max_attempts=30, **CALM), trace=True).trace
    assert np.all((arm.lower <= trace.joint_positions) & (trace.joint_positions <= arm.upper))


def test_the_deadline_ends_a_descent_that_still_makes_progress():
    arm = get_arm('ur5')
    target = pinocchio_tip(arm, arm.home + 0.3)
    creeping = SolveOptions(method='dls', step_size=1e-4, max_iterations=100000, max_attempts=1, deadline=1e-3)
    solution = solve(arm, target, arm.home, creeping)
    assert solution.status is Status.DEADLINE
    assert solution.iterations < 50000  # a millisecond is some three thousand
