"""Each column of the trace against Pinocchio and LAPACK."""

from __future__ import annotations

import numpy as np
import pytest
from numerics import get_arm, numeric_jacobian, pinocchio_tip, pose_errors, reachable_poses, twist

from ros_ik_pkg.ik import METHODS, TRACE_COLUMNS, SolveOptions, solve, solver

OPTIONS = {'max_attempts': 2, 'max_iterations': 12, 'deadline': 0.0}
ROBOTS = ('panda', 'puma560', 'planar3r', 'stanford')


def traced(robot, target=None, **options):
    """Solve for a pose that takes some steps; return arm, target, solution."""
    arm = get_arm(robot)
    if target is None:
        target = reachable_poses(arm, np.random.default_rng(4), 1)[0]
    return arm, target, solve(arm, target, options=SolveOptions(**(OPTIONS | options)), trace=True)


@pytest.mark.parametrize('robot', ROBOTS)
@pytest.mark.parametrize('method', METHODS)
def test_errors_and_positions_are_those_of_the_configuration_in_the_row(method, robot):
    arm, target, solution = traced(robot, method=method)
    trace = solution.trace
    assert len(trace) > 4
    for q, tip, row in zip(trace.joint_positions, trace.tip_positions, trace.rows):
        np.testing.assert_allclose(tip, pinocchio_tip(arm, q)[:3, 3], rtol=0, atol=1e-12)
        figures = dict(zip(TRACE_COLUMNS, row))
        found = figures['position_error'], figures['orientation_error']
        np.testing.assert_allclose(found, pose_errors(arm, q, target), rtol=0, atol=1e-9)
        assert figures['error_norm'] == pytest.approx(np.linalg.norm(twist(arm, q, target)), abs=1e-9)
        assert figures['joints_at_limits'] == np.count_nonzero((q <= arm.lower) | (q >= arm.upper))


@pytest.mark.parametrize('robot', ROBOTS)
def test_singular_figures_are_lapacks(robot):
    arm, _, solution = traced(robot, secondary='none')
    for q, row in zip(solution.trace.joint_positions, solution.trace.rows):
        figures = dict(zip(TRACE_COLUMNS, row))
        J = numeric_jacobian(arm, q)
        sigma = np.linalg.svd(J, compute_uv=False)[: min(6, arm.n)]
        assert figures['sigma_min'] == pytest.approx(sigma[-1], rel=1e-5, abs=1e-8)
        assert figures['manipulability'] == pytest.approx(np.prod(sigma), rel=1e-5, abs=1e-8)
        if sigma[-1] > 1e-3:
            assert figures['condition_number'] == pytest.approx(sigma[0] / sigma[-1], rel=1e-4)


def test_singular_figures_are_those_of_the_task():
    weights = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 3.0])
    arm, target, solution = traced('panda', task_weights=tuple(weights))
    for q, row in zip(solution.trace.joint_positions, solution.trace.rows):
        # Rows of the orientation that are weighed apart are those of its logarithm.
        J = -np.array([(twist(arm, q + d, target) - twist(arm, q - d, target)) / 2e-6 for d in 1e-6 * np.eye(arm.n)]).T
        sigma = np.linalg.svd(weights[:, None] * J, compute_uv=False)[:3]
        assert row[TRACE_COLUMNS.index('sigma_min')] == pytest.approx(sigma[-1], rel=1e-5)
        assert row[TRACE_COLUMNS.index('manipulability')] == pytest.approx(np.prod(sigma), rel=1e-5)


@pytest.mark.parametrize('weights', [(1, 1, 1, 1, 1, 1), (1, 1, 0, 0, 0, 0), (1, 1, 0, 0, 0, 1)])
def test_a_singularity_shows_even_where_a_whole_row_of_the_jacobian_vanishes(weights):
    arm = get_arm('planar3r')
    options = SolveOptions(max_attempts=1, max_iterations=0, task_weights=weights)
    solution = solve(arm, np.eye(4), np.zeros(3), options, trace=True)  # stretched along x: nothing moves it there
    figures = dict(zip(TRACE_COLUMNS, solution.trace.rows[0]))
    assert figures['sigma_min'] < 1e-12 and solution.sigma_min < 1e-12
    assert figures['condition_number'] > 1e10
    assert figures['manipulability'] < 1e-12


@pytest.mark.parametrize('robot', ROBOTS)
@pytest.mark.parametrize('method', METHODS)
def test_the_step_of_a_row_leads_to_the_next(method, robot):
    _, _, solution = traced(robot, method=method)
    trace = solution.trace
    steps = np.linalg.norm(np.diff(trace.joint_positions, axis=0), axis=1)
    last = np.append(np.diff(trace.column('iteration')) < 1.0, True)  # of its attempt
    np.testing.assert_allclose(trace.column('step_norm')[:-1][~last[:-1]], steps[~last[:-1]], rtol=0, atol=1e-14)
    assert not trace.column('step_norm')[last].any()
    assert not trace.column('damping')[last].any()


def test_the_damping_of_a_row_is_what_the_method_used():
    damping = {}
    for method in METHODS:
        _, _, solution = traced('puma560', method=method, max_attempts=1, dls_damping=0.07)
        damping[method] = solution.trace.column('damping')[:-1], solution.trace.column('error_norm')[:-1]
    assert set(damping['dls'][0]) == {0.07}
    used, norm = damping['adaptive_dls']
    np.testing.assert_allclose(used, np.maximum(1e-3, 0.2 * norm), rtol=1e-15)
    assert not np.any([damping[method][0] for method in ('transpose', 'pinv', 'sdls')])


def test_a_trace_that_is_too_long_keeps_its_beginning_and_says_so(monkeypatch):
    _, target, whole = traced('puma560')
    monkeypatch.setattr(solver, 'TRACE_CAPACITY', 4)
    _, _, cut = traced('puma560', target)
    assert cut.trace.truncated and not whole.trace.truncated
    assert len(cut.trace) == len(cut.trace.joint_positions) == len(cut.trace.tip_positions) == 4
    np.testing.assert_array_equal(cut.trace.rows, whole.trace.rows[:4])
    np.testing.assert_array_equal(cut.q, whole.q)


def test_a_trace_that_just_fits_is_whole(monkeypatch):
    _, target, whole = traced('puma560')
    monkeypatch.setattr(solver, 'TRACE_CAPACITY', len(whole.trace))
    _, _, again = traced('puma560', target)
    assert not again.trace.truncated
    np.testing.assert_array_equal(again.trace.rows, whole.trace.rows)


def test_there_is_no_trace_unless_it_is_asked_for():
    arm = get_arm('puma560')
    assert solve(arm, pinocchio_tip(arm, arm.home)).trace is None
