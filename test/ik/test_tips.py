"""Two tips solved together: every answer is judged by Pinocchio's own reading of the URDF."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from numerics import ROUNDING
from two_arms import TIPS, get_arms, off, poses, robot_text

from ros_ik_pkg.ik import (
    METHODS,
    ArgumentError,
    ModelError,
    Obstacle,
    OptionError,
    SolveOptions,
    Status,
    World,
    load_tree,
    solve_tips,
)
from ros_ik_pkg.ik.kinematics.forward import forward_kinematics

CALM = {'deadline': 0.0}


def assert_held(arms, solution, targets, relative=False, torso=True):
    """Assert that a solution is one, by Pinocchio and the limits; None for a target that nobody asks for."""
    assert solution.converged, f'{solution}'
    first, second = poses(arms, solution.q, torso)
    first = np.linalg.inv(second) @ first if relative else first
    for target, pose in zip(targets, (first, second)):
        if target is not None:
            position_error, orientation_error = off(target, pose)
            assert position_error <= SolveOptions().position_tolerance + ROUNDING
            assert orientation_error <= SolveOptions().orientation_tolerance + ROUNDING
    assert np.all((arms.lower <= solution.q) & (solution.q <= arms.upper))


def random_joints(arms, rng, count):
    return rng.uniform(arms.lower, arms.upper, (count, arms.n))


# The robot


@pytest.mark.parametrize('torso', [True, False])
def test_forward_kinematics_of_both_tips_are_those_of_pinocchio(torso):
    arms, rng = get_arms(torso), np.random.default_rng(1)
    assert arms.joint_names[: 2 * torso] == ('lift', 'turn')[: 2 * torso]
    assert arms.n == 14 + 2 * torso
    for q in random_joints(arms, rng, 10):
        for pose, expected in zip(arms.forward(q), poses(arms, q, torso)):
            np.testing.assert_allclose(pose, expected, atol=1e-12)


@pytest.mark.parametrize('torso', [True, False])
def test_the_chain_from_one_tip_to_the_other_is_the_quotient_of_their_poses(torso):
    arms, rng, pose = get_arms(torso), np.random.default_rng(2), np.eye(4)
    for q in random_joints(arms, rng, 10):
        first, second = poses(arms, q, torso)
        forward_kinematics(arms.packed_relative, q, pose)
        np.testing.assert_allclose(pose, np.linalg.inv(second) @ first, atol=1e-12)


def test_a_shared_joint_has_the_limits_of_both_arms():
    text = robot_text(True).replace(
        '<joint name="left_j3" type="revolute">', '<joint name="left_j3" type="revolute"><mimic joint="turn"/>'
    ).replace('<origin xyz="0.02 0 0.17"/><axis xyz="0 1 0"/><limit lower="-2.6"',
              '<origin xyz="0.02 0 0.17"/><axis xyz="0 1 0"/><limit lower="-0.1"')  # fmt: skip
    arms = load_tree(text, TIPS)
    assert arms.lower[arms.joint_names.index('turn')] == -0.1
    assert arms.upper[arms.joint_names.index('turn')] == 0.5


@pytest.mark.parametrize(
    ('tips', 'reason'),
    [
        (('left_tip', 'left_tip'), 'two different links'),
        (('left_tip',), 'two different links'),
        (('left_tip', 'rigth_tip'), 'did you mean right_tip'),
        (('left_tip', 'left_6'), 'the same joints move'),
        (('left_tip', 'floor'), 'no movable joint'),
    ],
)
def test_tips_that_make_no_two_arms_are_refused_with_the_reason(tips, reason):
    with pytest.raises(ModelError, match=reason):
        load_tree(robot_text(True), tips)


# Solving


@pytest.mark.parametrize('torso', [True, False])
@pytest.mark.parametrize('relative', [False, True])
def test_reachable_pairs_are_solved_from_anywhere(torso, relative):
    arms, rng = get_arms(torso), np.random.default_rng(3)
    for q, seed in zip(random_joints(arms, rng, 100), random_joints(arms, rng, 100)):
        first, second = poses(arms, q, torso)
        targets = np.linalg.inv(second) @ first if relative else first, second
        solution = solve_tips(arms, targets, seed, SolveOptions(**CALM), relative=relative)
        assert_held(arms, solution, targets, relative, torso)


@pytest.mark.parametrize('method', METHODS)
@pytest.mark.parametrize('relative', [False, True])
def test_every_method_follows_a_pair_of_targets(method, relative):
    arms, rng = get_arms(), np.random.default_rng(4)
    options = SolveOptions(method=method, max_iterations=20000, **CALM)
    for q in 0.6 * random_joints(arms, rng, 3):
        for _ in range(3):
            seed, q = q, q + rng.uniform(-0.01, 0.01, arms.n)
            first, second = poses(arms, q)
            targets = np.linalg.inv(second) @ first if relative else first, second
            solution = solve_tips(arms, targets, seed, options, relative=relative)
            assert_held(arms, solution, targets, relative)
            assert solution.attempts == 1
            assert solution.joint_distance < 0.2


@pytest.mark.parametrize(('first', 'relative'), [(True, False), (False, False), (True, True)])
def test_a_tip_without_a_target_is_free(first, relative):
    arms, rng = get_arms(), np.random.default_rng(5)
    for q, seed in zip(random_joints(arms, rng, 30), random_joints(arms, rng, 30)):
        left, right = poses(arms, q)
        left = np.linalg.inv(right) @ left if relative else left
        targets = (left, None) if first else (None, right)
        assert_held(arms, solve_tips(arms, targets, seed, SolveOptions(**CALM), relative=relative), targets, relative)


def test_one_target_out_of_reach_is_the_status_of_both_and_the_other_is_not_given_up():
    arms = get_arms()
    left, right = poses(arms, 0.3 * np.ones(arms.n))
    far = left.copy()
    far[0, 3] += 9.0
    solution = solve_tips(arms, (far, right), options=SolveOptions(**CALM))
    assert solution.status == Status.UNREACHABLE
    assert solution.position_error > 7.0
    assert solution_is_no_further_than(arms, solution, far, right)


def solution_is_no_further_than(arms, solution, far, right):
    """Whether the closest approach is closer than where the search began, by both errors together."""
    norms = [sum(np.square(np.concatenate([off(far, one), off(right, other)]))) for one, other in
             (poses(arms, solution.q), poses(arms, arms.home))]  # fmt: skip
    return norms[0] < norms[1]


def test_the_errors_are_those_of_the_tip_that_is_further_off():
    arms, rng = get_arms(), np.random.default_rng(6)
    for q, seed in zip(random_joints(arms, rng, 20), random_joints(arms, rng, 20)):
        targets = poses(arms, q)
        solution = solve_tips(arms, targets, seed, SolveOptions(max_attempts=1, max_iterations=3, **CALM))
        errors = [off(target, pose) for target, pose in zip(targets, poses(arms, solution.q))]
        assert (solution.position_error, solution.orientation_error) == pytest.approx(np.max(errors, axis=0), abs=1e-9)


def test_all_gives_distinct_solutions_the_nearest_first():
    arms = get_arms(False)
    targets, seed = poses(arms, 0.4 * np.ones(arms.n), False), 0.3 * np.ones(arms.n)
    options = SolveOptions(choice='all', max_attempts=60, **CALM)
    solution = solve_tips(arms, targets, seed, options)
    assert len(solution.solutions) > 3
    distances = np.linalg.norm(solution.solutions - seed, axis=1)
    assert np.all(np.diff(distances) >= 0.0)
    for q in solution.solutions:
        for target, pose in zip(targets, poses(arms, q, False)):
            assert max(off(target, pose)) < 1e-5 + ROUNDING
    nearest = solve_tips(arms, targets, seed, SolveOptions(choice='nearest', **CALM))
    assert nearest.joint_distance < 0.3


def test_a_jump_beyond_what_is_allowed_is_said():
    arms = get_arms()
    targets = poses(arms, 0.4 * np.ones(arms.n))
    solution = solve_tips(arms, targets, -0.4 * np.ones(arms.n), SolveOptions(max_joint_jump=0.01, **CALM))
    assert solution.status == Status.JOINT_JUMP


@pytest.mark.parametrize('method', [method for method in METHODS if method != 'transpose'])
def test_a_heavy_torso_stays_if_the_arms_can_do_without(method):
    arms = get_arms()
    seed = np.array([0.0, 0.0, *(2 * [0.2, 0.5, 0.2, 1.2, 0.2, -0.6, 0.2])])  # elbows bent
    targets = poses(arms, seed)
    for target in targets:
        target[2, 3] += 0.1
    heavy = (20.0,) * 2 + (1.0,) * 14
    moved = [
        np.abs(solve_tips(arms, targets, seed, SolveOptions(method=method, joint_weights=weights, **CALM)).q - seed)[:2]
        for weights in ((), heavy)
    ]
    assert moved[1].max() < 0.1 * moved[0].max()


def test_dropped_rows_and_tolerances_hold_for_each_tip():
    arms, rng = get_arms(), np.random.default_rng(7)
    options = SolveOptions(task_weights=(1, 1, 1, 0, 0, 0), task_tolerances=(0.05, 0, 0, 0, 0, 0), **CALM)
    for q, seed in zip(random_joints(arms, rng, 20), random_joints(arms, rng, 20)):
        targets = poses(arms, q)
        solution = solve_tips(arms, targets, seed, options)
        assert solution.converged
        for target, pose in zip(targets, poses(arms, solution.q)):
            x, y, z = np.abs(target - pose)[:3, 3]
            assert x < 0.05 + 1e-5
            assert max(y, z) < 1e-5


# Contact

BALL = '<collision><geometry><sphere radius="0.08"/></geometry></collision>'


def test_answers_keep_the_arms_clear_of_each_other():
    arms, rng = get_arms(True, BALL), np.random.default_rng(8)
    found = []
    for q, seed in zip(random_joints(arms, rng, 150), random_joints(arms, rng, 150)):
        if not arms.contacts.is_clear(q, 1e-3):
            continue
        targets = poses(arms, q)
        solution = solve_tips(arms, targets, seed, SolveOptions(**CALM))
        assert_held(arms, solution, targets)
        assert arms.contacts.is_clear(solution.q)
        found.append(solution)
    assert len(found) > 50
    heedless = SolveOptions(avoid_collisions=False, **CALM)
    touching = [k for k, solution in enumerate(found) if solution.clearance < 0.0]
    assert not touching
    assert any(not arms.contacts.is_clear(solve_tips(arms, poses(arms, one.q), seed, heedless).q)
               for one in found for seed in random_joints(arms, rng, 3))  # fmt: skip


def test_targets_that_are_reached_in_contact_alone_are_said_to_be():
    arms = get_arms(True, BALL)
    left, right = poses(arms, 0.3 * np.ones(arms.n))
    wall = Obstacle('wall', 'sphere', (0.3,), left)
    solution = solve_tips(arms, (left, right), options=SolveOptions(**CALM), world=World(obstacles=(wall,)))
    assert solution.status == Status.COLLISION
    assert 'wall' in solution.nearest_links


# Arguments


@pytest.mark.parametrize(
    ('targets', 'others', 'reason'),
    [
        ((np.eye(4),), {}, 'two poses'),
        ((None, None), {}, 'two poses'),
        ((np.eye(4), np.eye(3)), {}, r'second target has shape \(3, 3\)'),
        ((np.eye(4), 2.0 * np.eye(4)), {}, 'homogeneous'),
        ((np.diag([1.0, 1.0, -1.0, 1.0]), np.eye(4)), {}, 'homogeneous'),
        ((np.eye(4), np.full((4, 4), np.nan)), {}, 'homogeneous'),
        ((np.eye(4), np.eye(4)), {'seed': np.zeros(3)}, 'seed has shape'),
        ((np.eye(4), np.eye(4)), {'seed': np.full(16, np.nan)}, 'seed = '),
        ((np.eye(4), np.eye(4)), {'reference': np.full(16, np.inf)}, 'reference = '),
        ((np.eye(4), np.eye(4)), {'options': SolveOptions(joint_weights=(1, 2))}, 'joint_weights has 2 numbers'),
    ],
)
def test_arguments_that_make_no_sense_are_refused_with_the_reason(targets, others, reason):
    with pytest.raises(ArgumentError, match=reason):
        solve_tips(get_arms(), targets, **others)


def test_null_space_objectives_are_refused():
    with pytest.raises(OptionError, match='null_space'):
        solve_tips(get_arms(), (np.eye(4), np.eye(4)), options=SolveOptions(null_space='limits'))


def test_the_arguments_are_not_written_to():
    arms = get_arms()
    given = [*poses(arms, 0.3 * np.ones(arms.n)), np.full(arms.n, 9.0)]
    copies = [array.copy() for array in given]
    solution = solve_tips(arms, given[:2], given[2], SolveOptions(**CALM))
    assert solution.seed_clipped
    for array, copy in zip(given, copies):
        np.testing.assert_array_equal(array, copy)


# Single chains


def test_one_chain_is_solved_without_any_code_for_two():
    program = (
        'from ros_ik_pkg.ik import load_arm, solve\n'
        'from ros_ik_pkg.ik.search.pair_entry import solve_pair\n'
        "arm = load_arm('panda')\n"
        'assert solve(arm, arm.forward(arm.home + 0.1)).converged\n'
        'assert not solve_pair.compiled.signatures'
    )
    result = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True, timeout=600)
    assert result.returncode == 0, result.stderr
