"""Batches side by side: the answers of `solve`, each judged by Pinocchio, whatever the neighbours are."""

from __future__ import annotations

import numpy as np
import pytest
from chains import random_urdf
from numerics import count_answers, get_arm, pinocchio_tip, random_configurations, reachable_poses

from ros_ik_pkg.ik import ArgumentError, SolveOptions, Status, batch_solver, load_arm, solve, solve_batch
from ros_ik_pkg.ik.batch_solver import FEWEST, fits_lanes
from ros_ik_pkg.ik.kernel.numba_insides import WHY_PLAIN
from ros_ik_pkg.ik.search.search import ASK_AFTER

if WHY_PLAIN:
    pytest.skip('plain Numba has no numbers of several lanes', allow_module_level=True)

CALM = SolveOptions(deadline=0.0)
ROBOTS = ('panda', 'ur5', 'iiwa14', 'stanford', 'puma560', 'xarm7')
FIGURES = ('status', 'iterations', 'attempts')
COUNT = 2 * FEWEST


@pytest.fixture
def handed_over(monkeypatch):
    """How many targets lanes leave to the usual search, one number for each call of it."""
    counts, usual = [], batch_solver.search_targets

    def count(*arguments):
        counts.append(len(arguments[6]))  # rows of `out`
        return usual(*arguments)

    monkeypatch.setattr(batch_solver, 'search_targets', count)
    return counts


def problems(arm, seed, count=COUNT):
    rng = np.random.default_rng(seed)
    return reachable_poses(arm, rng, count), random_configurations(arm, rng, count)


def alone(arm, targets, seeds, options=CALM):
    return [solve(arm, target, seed, options) for target, seed in zip(targets, seeds)]


def searched_alike(expected):
    """Whether `solve` asked no closed form, which lanes do not have, for each solution."""
    alike = np.array([solution.attempts <= ASK_AFTER for solution in expected])
    assert np.mean(alike) > 0.8
    return alike


@pytest.mark.parametrize('name', ROBOTS)
def test_the_answers_are_those_of_solve_but_for_rounding(name, handed_over):
    arm = get_arm(name)
    targets, seeds = problems(arm, 1)
    batch, expected = solve_batch(arm, targets, seeds, CALM), alone(arm, targets, seeds)
    assert count_answers(arm, batch, targets) == 1.0
    assert sum(handed_over) <= 0.02 * COUNT
    same = np.abs(batch.q - [solution.q for solution in expected]).max(axis=1) < 1e-6
    alike = searched_alike(expected)
    assert np.mean(same[alike]) >= 0.99
    for name in FIGURES:
        equal = getattr(batch, name) == np.array([getattr(solution, name) for solution in expected])
        assert np.mean(equal[alike]) >= 0.99
    for name in ('position_error', 'orientation_error'):
        ours, its = getattr(batch, name), np.array([getattr(solution, name) for solution in expected])
        np.testing.assert_allclose(ours[same & alike], its[same & alike], rtol=0, atol=1e-9)
    np.testing.assert_allclose(batch.joint_distance, np.abs(batch.q - seeds).max(axis=1), rtol=1e-15)
    assert np.all((batch.solve_time > 0.0) & (batch.solve_time < 10.0))


@pytest.mark.parametrize('seed', range(6))
def test_chains_of_all_kinds_of_joints_are_solved_as_by_solve(seed):
    rng = np.random.default_rng(seed)
    arm = load_arm(random_urdf(rng, joints=4 + seed, mimics=seed % 3), 'base', 'tip')
    targets, seeds = problems(arm, seed)
    options = SolveOptions(deadline=0.0, max_attempts=60)
    batch, expected = solve_batch(arm, targets, seeds, options), alone(arm, targets, seeds, options)
    assert count_answers(arm, batch, targets, options) == np.mean([solution.converged for solution in expected])
    np.testing.assert_array_equal(batch.converged, [solution.converged for solution in expected])


def test_an_answer_depends_on_no_other_target_and_on_no_number_of_workers():
    arm = get_arm('panda')
    targets, seeds = problems(arm, 2)
    order = np.random.default_rng(3).permutation(COUNT)
    first = solve_batch(arm, targets, seeds, CALM, workers=1)
    again = solve_batch(arm, targets[order], seeds[order], CALM, workers=3)
    np.testing.assert_array_equal(first.q[order], again.q)
    for name in (*FIGURES, 'position_error', 'orientation_error', 'joint_distance'):
        np.testing.assert_array_equal(getattr(first, name)[order], getattr(again, name))


def test_targets_that_need_more_are_left_to_the_usual_search(handed_over):
    arm = get_arm('ur5')
    targets, seeds = problems(arm, 4)
    targets[10:13, 0, 3] += 5.0  # out of reach
    seeds[20] = seeds[21] = 0.1
    targets[20] = pinocchio_tip(arm, seeds[20])  # the seed is the answer
    targets[21] = pinocchio_tip(arm, seeds[21] + 1e-6)  # and is to be refined
    targets[30, :3, 3] = 0.0  # within the shoulder
    batch = solve_batch(arm, targets, seeds, CALM)
    assert handed_over[0] == 3
    for k in (10, 11, 12, 20, 21, 30):
        expected = solve(arm, targets[k], seeds[k], CALM)
        np.testing.assert_array_equal(batch.q[k], expected.q)
        assert [getattr(batch, name)[k] for name in FIGURES] == [getattr(expected, name) for name in FIGURES]
    assert batch.status[10] == Status.UNREACHABLE
    assert batch.position_error[21] < 1e-9


def test_angles_come_to_the_whole_turns_nearest_the_reference():
    arm = get_arm('ur5')
    targets, seeds = problems(arm, 5)
    references = seeds + 2.0 * np.pi * np.random.default_rng(1).integers(-1, 2, seeds.shape)
    batch = solve_batch(arm, targets, seeds, CALM, references)
    expected = [solve(arm, *row) for row in zip(targets, seeds, [CALM] * COUNT, references)]
    same = np.abs(batch.q - [solution.q for solution in expected]).max(axis=1) < 1e-6
    assert np.mean(same[searched_alike(expected)]) >= 0.99
    assert count_answers(arm, batch, targets) == 1.0
    np.testing.assert_allclose(batch.joint_distance, np.abs(batch.q - references).max(axis=1), rtol=1e-15)


def test_seeds_far_outside_the_limits_are_brought_inside():
    arm = get_arm('panda')
    targets, seeds = problems(arm, 6)
    batch = solve_batch(arm, targets, 1e7 * seeds, CALM)
    assert count_answers(arm, batch, targets) == 1.0


def test_targets_half_a_turn_away_are_solved():
    arm = get_arm('panda')
    targets = reachable_poses(arm, np.random.default_rng(7), COUNT)
    start = pinocchio_tip(arm, arm.home)
    targets[::2, :3, :3] = start[:3, :3] @ np.diag([1.0, -1.0, -1.0])
    expected = [solve(arm, target, options=CALM).converged for target in targets]
    batch = solve_batch(arm, targets, options=CALM)
    np.testing.assert_array_equal(batch.converged, expected)
    count_answers(arm, batch, targets)


@pytest.mark.parametrize('name', ['targets', 'seeds', 'references'])
def test_the_first_bad_row_is_named(name):
    arm = get_arm('panda')
    targets, seeds = problems(arm, 8)
    arguments = {'targets': targets.copy(), 'seeds': seeds.copy(), 'references': seeds.copy()}
    arguments[name][[7, 20], 0] = np.nan
    with pytest.raises(ArgumentError, match=rf'^row 7: {name[:-1]} = '):
        solve_batch(arm, options=CALM, **arguments)


@pytest.mark.parametrize(
    'change',
    [
        {'method': 'dls'}, {'respect_limits': False}, {'choice': 'nearest'}, {'max_joint_jump': 9.0},
        {'task_weights': (1, 1, 1, 1, 1, 0.5)}, {'task_tolerances': (0, 0, 0, 0, 0, 0.1)}, {'null_space': 'limits'},
        {'posture': (0.0,) * 7}, {'joint_weights': (1, 2, 1, 1, 1, 1, 1)}, {'adaptive_dls_damping': 0.0},
        {'max_attempts': 10}, {'deadline': 5e-4},
    ],
)  # fmt: skip
def test_other_options_are_for_the_usual_search(change):
    assert fits_lanes(CALM, FEWEST)
    assert not fits_lanes(SolveOptions(**{'deadline': 0.0, **change}), FEWEST)


@pytest.mark.parametrize('change', [{'max_joint_step': 0.1}, {'step_size': 0.8}, {'position_tolerance': 1e-9},
                                    {'adaptive_dls_gain': 0.5}, {'max_iterations': 12}])  # fmt: skip
def test_options_of_the_descent_count_in_lanes_too(change, handed_over):
    arm, options = get_arm('ur5'), SolveOptions(deadline=0.0, **change)
    targets, seeds = problems(arm, 9)
    batch, expected = solve_batch(arm, targets, seeds, options), alone(arm, targets, seeds, options)
    assert sum(handed_over) < 0.5 * COUNT
    assert count_answers(arm, batch, targets, options) == 1.0
    equal = batch.iterations == np.array([solution.iterations for solution in expected])
    assert np.mean(equal[searched_alike(expected)]) >= 0.98


def test_few_targets_and_arms_with_shapes_are_for_the_usual_search(monkeypatch):
    monkeypatch.setattr(batch_solver, 'solve_lanes', None)  # calling it is an error
    arm = get_arm('panda')
    targets, seeds = problems(arm, 10, FEWEST - 1)
    assert count_answers(arm, solve_batch(arm, targets, seeds, CALM), targets) == 1.0
    box = '<collision><geometry><sphere radius="0.05"/></geometry></collision>'
    shaped = load_arm(
        f'<robot name="two"><link name="a">{box}</link><link name="b">{box}</link><joint name="j" type="continuous">'
        '<parent link="a"/><child link="b"/><origin xyz="1 0 0"/></joint></robot>'
    )
    poses = np.array([shaped.forward(q) for q in np.linspace(-1.0, 1.0, FEWEST)[:, None]])
    assert solve_batch(shaped, poses, options=CALM).converged.all()
