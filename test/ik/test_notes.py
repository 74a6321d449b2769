"""What the lecture notes claim of the methods, shown on their own arm, the Puma 560."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from numerics import assert_answer, get_arm, pinocchio_tip

from ros_ik_pkg.ik import METHODS, SolveOptions, Status, solve

NOTES_SEED = np.radians([2.8, -77.7, 6.8, 8.5, -19.3, 172.0])
DAMPED = ('dls', 'adaptive_dls', 'sdls')
# One descent that may take as long as it likes
DESCENT = {'max_attempts': 1, 'max_iterations': 100000, 'deadline': 0.0}
PRECISE = {'position_tolerance': 1e-12, 'orientation_tolerance': 1e-12}
WRIST_ALIGNED = np.radians([0.0, -60.0, -30.0, 0.0, 0.0, 0.0])  # q5 = 0: axes 4 and 6 are one
STRETCHED = np.array([0.2, -0.7, np.arctan2(0.0203, 0.4318) - np.pi / 2, 0.3, 0.6, 0.1])  # the elbow is straight


def nearby_targets(count=21, spread=0.3):
    """Make up poses that the arm has at most `spread` radians of each joint away from the notes' configuration."""
    arm, rng = get_arm('puma560'), np.random.default_rng(3)
    return [pinocchio_tip(arm, NOTES_SEED + rng.uniform(-spread, spread, 6)) for _ in range(count)]


def descend(target, seed=NOTES_SEED, trace=False, **options):
    return solve(get_arm('puma560'), target, seed, SolveOptions(**{**DESCENT, **options}), trace=trace)


def median_iterations(**options):
    """Median over nearby targets, all of which must be solved."""
    solutions = [descend(target, **options) for target in nearby_targets()]
    assert all(solution.converged for solution in solutions)
    return np.median([solution.iterations for solution in solutions])


def test_the_notes_configuration_has_the_notes_pose():
    pose = pinocchio_tip(get_arm('puma560'), NOTES_SEED)
    np.testing.assert_allclose(pose[:3, 3], [0.5, 0.15, 0.3], rtol=0, atol=1e-3)
    notes = pin.rpy.rpyToMatrix(0.0, np.pi / 2, 0.0)
    assert np.linalg.norm(pin.log3(notes @ pose[:3, :3].T)) < np.radians(0.15)


def test_the_transpose_needs_hundreds_to_thousands_of_iterations():
    assert 300 <= median_iterations(method='transpose') <= 10000


def test_the_pseudoinverse_needs_about_ten():
    assert median_iterations(method='pinv') <= 10


def test_damped_least_squares_needs_tens_with_the_damping_of_textbooks():
    assert 10 <= median_iterations(method='dls', dls_damping=0.2) < 100


def test_a_large_damping_converges_slowly():
    counts = [median_iterations(method='dls', dls_damping=damping) for damping in (0.01, 0.1, 0.3, 1.0)]
    assert np.all(np.diff(counts) > 0)
    assert counts[-1] > 30 * counts[0]


def test_near_the_target_the_error_of_the_pseudoinverse_falls_quadratically():
    for target in nearby_targets(5):
        errors = descend(target, method='pinv', trace=True, **PRECISE).trace.column('error_norm')
        assert len(errors) >= 4
        near = errors[:-1] < 0.1
        assert np.all(errors[1:][near] <= np.maximum(10.0 * errors[:-1][near] ** 2, 1e-13))


def test_near_the_target_the_error_of_damped_least_squares_falls_linearly():
    for target in nearby_targets(5):
        solution = descend(target, method='dls', dls_damping=0.3, trace=True, **PRECISE)
        errors = solution.trace.column('error_norm')
        late = errors[1:][errors[1:] < 1e-6] / errors[:-1][errors[1:] < 1e-6]
        sigma = solution.trace.column('sigma_min')[-1]
        # the slowest direction shrinks by lambda^2 / (sigma^2 + lambda^2) with every step
        np.testing.assert_allclose(late[-5:], 0.09 / (sigma**2 + 0.09), rtol=0.02)


@pytest.mark.parametrize('seed', [WRIST_ALIGNED, STRETCHED, [0.2, -1.0, -0.5, 0.3, 0.0, 0.7]])
@pytest.mark.parametrize('change', [(0.2, -0.1, 0.2, 0.3, 0.4, -0.3), (-0.3, 0.2, 0.1, -0.1, 0.5, 0.3)])
def test_at_a_singularity_the_pseudoinverse_fails_and_says_so(seed, change):
    target = pinocchio_tip(get_arm('puma560'), np.add(seed, change))
    solution = descend(target, seed, method='pinv')
    assert solution.status in (Status.DIVERGED, Status.NOT_FINITE)
    assert np.all(np.isfinite(solution.q))


@pytest.mark.parametrize('method', DAMPED)
@pytest.mark.parametrize('seed', [WRIST_ALIGNED, STRETCHED])
def test_at_a_singularity_damped_methods_take_bounded_steps_and_arrive(method, seed):
    arm = get_arm('puma560')
    target = pinocchio_tip(arm, np.add(seed, [0.2, -0.1, 0.2, 0.3, 0.4, -0.3]))
    solution = descend(target, seed, method=method, trace=True)
    assert_answer(arm, solution, target)
    assert np.max(solution.trace.column('step_norm')) < 1.0


@pytest.mark.parametrize('seed', [WRIST_ALIGNED, STRETCHED])
def test_at_a_singularity_the_transpose_takes_bounded_steps(seed):
    target = pinocchio_tip(get_arm('puma560'), np.add(seed, [0.2, -0.1, 0.2, 0.3, 0.4, -0.3]))
    solution = descend(target, seed, method='transpose', trace=True)
    assert np.max(solution.trace.column('step_norm')) < 1.0


def test_adaptive_damping_is_as_sure_as_damping_and_nearly_as_quick_as_none():
    assert median_iterations(method='adaptive_dls', **PRECISE) <= median_iterations(method='pinv', **PRECISE) + 3
    constant = median_iterations(method='dls', dls_damping=0.2, **PRECISE)
    assert median_iterations(method='adaptive_dls', **PRECISE) < constant / 3


@pytest.mark.parametrize('method', METHODS)
def test_another_seed_leads_to_another_branch(method):
    arm = get_arm('puma560')
    elbow_up = np.radians([10.0, -60.0, 10.0, 20.0, 50.0, 30.0])
    flipped = elbow_up + np.radians([0.0, 0.0, 0.0, -180.0, -100.0, 180.0])  # the wrist turned over
    target = pinocchio_tip(arm, elbow_up)
    loose = {'position_tolerance': 1e-4, 'orientation_tolerance': 1e-4}
    answers = [descend(target, seed, method=method, **loose) for seed in (elbow_up + 0.05, flipped + 0.05)]
    for solution in answers:
        assert_answer(arm, solution, target, SolveOptions(**loose))
    assert answers[0].q[4] > 0.5 and answers[1].q[4] < -0.5
