"""The public calls: what they take, what they refuse, batches."""

from __future__ import annotations

import pickle

import numpy as np
import pinocchio as pin
import pytest
from numerics import get_arm, pinocchio_tip, random_configurations, reachable_poses

from ros_ik_pkg.ik import METHODS, ArgumentError, SolveOptions, Status, load_arm, solve, solve_batch, warm_up

CALM = {'deadline': 0.0, 'max_attempts': 20}
FIGURES = ('status', 'position_error', 'orientation_error', 'iterations', 'attempts', 'joint_distance')


@pytest.fixture(scope='module')
def arm():
    return get_arm('puma560')


@pytest.fixture(scope='module')
def targets(arm):
    return reachable_poses(arm, np.random.default_rng(1), 30)


@pytest.fixture(scope='module')
def seeds(arm):
    return random_configurations(arm, np.random.default_rng(2), 30)


# One target


def as_forms(target):
    """A pose in every form that a caller may have it in."""
    fixed = target.copy()
    fixed.flags.writeable = False
    return {
        'array': target,
        'SE3': pin.SE3(target),
        'lists': target.tolist(),
        'Fortran order': np.asfortranarray(target),
        'strided': np.repeat(target, 2, axis=0)[::2],
        'read-only': fixed,
    }


@pytest.mark.parametrize('form', ['array', 'SE3', 'lists', 'Fortran order', 'strided', 'read-only'])
def test_a_target_may_come_in_any_form(arm, targets, form):
    expected = solve(arm, targets[0], options=SolveOptions(**CALM))
    found = solve(arm, as_forms(targets[0])[form], options=SolveOptions(**CALM))
    assert found.converged
    np.testing.assert_array_equal(found.q, expected.q)


@pytest.mark.parametrize('form', [list, tuple, np.array, lambda q: np.repeat(q, 2)[::2]])
def test_a_seed_and_a_reference_may_be_any_row_of_numbers(arm, targets, seeds, form):
    seed, reference = seeds[:2]
    expected = solve(arm, targets[0], seed, SolveOptions(**CALM), reference)
    found = solve(arm, targets[0], form(seed), SolveOptions(**CALM), form(reference))
    np.testing.assert_array_equal(found.q, expected.q)


def test_whole_numbers_and_single_precision_are_taken(arm):
    target = pinocchio_tip(arm, arm.home)
    assert solve(arm, target, [0, -1, 0, 0, 1, 0]).converged
    assert solve(arm, target.astype(np.float32), arm.home.astype(np.float32)).converged


def test_the_seed_is_home_and_the_reference_the_seed_unless_they_are_given(arm, targets):
    options = SolveOptions(max_attempts=1, max_iterations=0)
    by_default = solve(arm, targets[0], options=options)
    np.testing.assert_array_equal(by_default.q, arm.home)
    assert by_default.joint_distance == 0.0
    moved = solve(arm, targets[0], options=options, reference=arm.home + 0.25)
    assert moved.joint_distance == pytest.approx(0.25)


def test_the_options_are_the_defaults_unless_they_are_given(arm, targets):
    np.testing.assert_array_equal(solve(arm, targets[0]).q, solve(arm, targets[0], options=SolveOptions()).q)


def test_weights_of_joints_must_be_as_many_as_joints(arm, targets):
    with pytest.raises(ArgumentError, match='joint_weights has 2 numbers; expected 6'):
        solve(arm, targets[0], options=SolveOptions(joint_weights=(1, 2)))
    with pytest.raises(ArgumentError, match='joint_weights has 7 numbers; expected 6'):
        solve_batch(arm, targets, options=SolveOptions(joint_weights=(1,) * 7))


def test_a_solution_owns_its_arrays(arm, targets):
    options = SolveOptions(choice='all', **CALM)
    first = solve(arm, targets[0], options=options, trace=True)
    kept = first.q.copy(), first.solutions.copy(), first.trace.rows.copy()
    solve(arm, targets[1], options=options, trace=True)
    for array, copy in zip((first.q, first.solutions, first.trace.rows), kept):
        np.testing.assert_array_equal(array, copy)


def test_distances_that_are_huge_are_no_jump(arm, targets):
    options = SolveOptions(joint_weights=(1e6,) * 6, **CALM)
    assert solve(arm, targets[0], reference=[5e3] * 6, options=options).status is Status.CONVERGED


@pytest.mark.parametrize('load', [get_arm, load_arm], ids=['bare', 'shaped'])
def test_an_arm_that_was_pickled_solves_the_same(load):
    arm = load('panda')  # Pinocchio 2.7 cannot unpickle a model with an infinite limit
    target = pinocchio_tip(arm, arm.home + 0.3)
    solution = solve(arm, target)
    again = pickle.loads(pickle.dumps(arm))
    assert again.shaped == arm.shaped
    np.testing.assert_array_equal(solve(again, target).q, solution.q)


# Many targets


@pytest.mark.parametrize('workers', [1, 2, None])
@pytest.mark.parametrize('method', METHODS)
def test_each_row_of_a_batch_is_what_solve_returns(arm, targets, seeds, method, workers):
    options = SolveOptions(method=method, **CALM)
    references = seeds[::-1]
    batch = solve_batch(arm, targets, seeds, options, references, workers=workers)
    for k, arguments in enumerate(zip(targets, seeds, references)):
        target, seed, reference = arguments
        alone = solve(arm, target, seed, options, reference)
        np.testing.assert_array_equal(batch.q[k], alone.q)
        assert [getattr(batch, name)[k] for name in FIGURES] == [getattr(alone, name) for name in FIGURES]
        assert batch.converged[k] == alone.converged


@pytest.mark.parametrize('choice', ['nearest', 'all'])
def test_a_batch_chooses_as_solve_does(arm, targets, seeds, choice):
    options = SolveOptions(choice=choice, deadline=0.0, joint_weights=(3, 2, 1, 1, 0.5, 0.1))
    batch = solve_batch(arm, targets, seeds, options)
    for k, (target, seed) in enumerate(zip(targets[:10], seeds)):
        np.testing.assert_array_equal(batch.q[k], solve(arm, target, seed, options).q)


def test_the_shapes_of_a_batch(arm, targets):
    batch = solve_batch(arm, targets, options=SolveOptions(**CALM))
    assert batch.q.shape == (30, 6)
    assert {getattr(batch, name).shape for name in (*FIGURES, 'solve_time', 'converged')} == {(30,)}
    assert {getattr(batch, name).dtype for name in ('status', 'iterations', 'attempts')} == {np.dtype(np.int64)}


def test_one_seed_serves_all_targets(arm, targets, seeds):
    options = SolveOptions(**CALM)
    one = solve_batch(arm, targets, seeds[0], options, references=seeds[1])
    many = solve_batch(arm, targets, np.tile(seeds[0], (30, 1)), options, references=seeds[1][None])
    np.testing.assert_array_equal(one.q, many.q)


def test_a_batch_of_nothing_is_empty(arm):
    batch = solve_batch(arm, np.empty((0, 4, 4)))
    assert batch.q.shape == (0, 6)
    assert batch.converged.shape == (0,)


def test_progress_counts_every_target_once(arm, targets):
    done = []
    solve_batch(arm, targets, options=SolveOptions(**CALM), workers=2, progress=done.append)
    assert sum(done) == len(targets)
    assert len(done) > 1 and min(done) > 0


def test_a_batch_writes_to_nothing_of_the_callers(arm, targets, seeds):
    given = targets.copy(), seeds.copy()
    solve_batch(arm, targets, seeds, SolveOptions(**CALM))
    np.testing.assert_array_equal(targets, given[0])
    np.testing.assert_array_equal(seeds, given[1])


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'targets': np.eye(4)}, 'targets'),
        ({'targets': np.zeros((3, 3, 3))}, 'targets'),
        ({'targets': None}, 'targets'),
        ({'seeds': np.zeros((29, 6))}, 'seeds has 29 rows; expected 30'),
        ({'seeds': np.zeros((30, 5))}, 'seeds'),
        ({'seeds': 'home'}, 'seeds'),
        ({'references': np.zeros((2, 6))}, 'references has 2 rows; expected 30'),
        ({'workers': -1}, 'workers'),
    ],
)
def test_a_batch_refuses_nonsense_by_name(arm, targets, change, words):
    with pytest.raises(ArgumentError, match=words):
        solve_batch(arm, **({'targets': targets} | change))


@pytest.mark.parametrize('name', ['targets', 'seeds', 'references'])
def test_a_batch_names_the_first_bad_row(arm, targets, seeds, name):
    arguments = {'targets': targets.copy(), 'seeds': seeds.copy(), 'references': seeds.copy()}
    arguments[name][[7, 20], 0] = np.nan
    with pytest.raises(ArgumentError, match=rf'^row 7: {name[:-1]} = '):
        solve_batch(arm, options=SolveOptions(**CALM), **arguments)


@pytest.mark.parametrize('number', [np.nan, np.inf, -np.inf])
def test_a_pose_with_any_number_that_is_not_finite_is_refused(arm, number):
    for place in np.ndindex(4, 4):
        target = arm.forward(arm.home)
        target[place] = number
        with pytest.raises(ArgumentError, match='expected a finite homogeneous matrix'):
            solve(arm, target)


@pytest.mark.parametrize(
    ('place', 'number'), [((3, 0), 1e-3), ((3, 1), 1e-3), ((3, 2), 1e-3), ((3, 3), 0.999), ((0, 0), 1.1)]
)
def test_a_matrix_that_is_no_pose_is_refused(arm, place, number):
    target = np.eye(4)
    target[place] = number
    with pytest.raises(ArgumentError, match='expected a finite homogeneous matrix'):
        solve(arm, target)


def test_a_reflection_is_no_pose(arm):
    with pytest.raises(ArgumentError, match='right-handed'):
        solve(arm, np.diag([1.0, 1.0, -1.0, 1.0]))


def test_warming_up_says_nothing_where_nothing_has_to_be_compiled():
    warm_up()
    said = []
    assert warm_up(said.append) < 2.0
    assert not said
