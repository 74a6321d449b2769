"""Each lesson shows its phenomenon, with the numbers that it sets."""

from __future__ import annotations

import re

import numpy as np
import pytest

from ros_ik_pkg.compare import compare_methods
from ros_ik_pkg.compare.iterate import directions_of, make_iterate
from ros_ik_pkg.compare.lessons import LESSONS, lesson
from ros_ik_pkg.compare.problem import NOTES_SEED, joints_from_degrees
from ros_ik_pkg.compare.words import LANGUAGES
from ros_ik_pkg.ik import METHODS, Status
from ros_ik_pkg.ros.interface.parameters import PARAMETERS


def runs_of(name: str):
    """Return problem and runs, by method, of a lesson."""
    item, problem = lesson(name), lesson(name).problem()
    runs = compare_methods(problem.arm, problem.target, problem.seed, item.methods, item.options())
    return problem, {run.method: run for run in runs}


def test_quadratic_convergence_the_exponent_of_the_error_doubles():
    _, runs = runs_of('quadratic')
    errors = runs['pinv'].trace.column('error_norm')
    near = (errors[:-1] < 0.05) & (errors[1:] > 1e-13)
    assert near.sum() >= 2
    assert np.all(np.log10(errors[1:][near]) <= 1.7 * np.log10(errors[:-1][near]) + 0.7)
    assert runs['pinv'].iterations <= 8 and runs['transpose'].iterations >= 1000


def test_divergence_at_the_wrist_pinv_leaps_and_damping_arrives():
    _, runs = runs_of('wrist')
    assert runs['pinv'].status is Status.DIVERGED and runs['pinv'].sigma_min < 1e-3
    assert all(runs[method].status is Status.CONVERGED for method in ('dls', 'adaptive_dls', 'sdls'))


def test_oscillation_the_error_goes_up_and_down_and_a_step_size_of_1_mends_it():
    problem, runs = runs_of('oscillation')
    changes = np.diff(runs['transpose'].trace.column('error_norm'))
    assert runs['transpose'].status is Status.OSCILLATING and (changes > 0.0).sum() >= 5
    options = lesson('quadratic').options()
    calm = compare_methods(problem.arm, problem.target, problem.seed, ['transpose'], options)[0]
    assert np.all(np.diff(calm.trace.column('error_norm')) <= 0.0)


def test_stagnation_the_gradient_vanishes_and_the_error_does_not():
    problem, runs = runs_of('stagnation')
    options = lesson('stagnation').options()
    iterate = make_iterate(problem.arm, problem.target, 'transpose', options, problem.seed[None], 0)
    assert np.linalg.norm(iterate.jacobian.T @ iterate.error) < 1e-4 and iterate.position_error > 0.09
    for method in ('transpose', 'sdls'):
        assert runs[method].status is Status.STALLED and runs[method].position_error > 0.09
    assert runs['pinv'].status in (Status.NOT_FINITE, Status.DIVERGED)
    bent = problem.seed - np.radians([0.0, 0.0, 10.0, 0.0, 0.0, 0.0])
    for run in compare_methods(problem.arm, problem.target, bent, ['transpose', 'pinv', 'sdls'], options):
        assert run.status is Status.CONVERGED


def test_another_branch_every_method_ends_far_from_the_configuration_of_the_notes():
    problem, runs = runs_of('branch')
    notes = joints_from_degrees(problem.arm, NOTES_SEED)
    np.testing.assert_allclose(problem.arm.forward(notes), problem.target, atol=1e-9)
    for run in runs.values():
        assert run.status is Status.CONVERGED
        assert np.abs(run.trace.joint_positions[-1] - notes).max() > 1.0


def test_residual_error_the_share_that_a_step_leaves_is_what_the_text_says():
    problem, runs = runs_of('residual')
    assert runs['dls'].status is Status.MAX_ITERATIONS and runs['dls'].position_error > 1e-3
    assert runs['adaptive_dls'].status is Status.CONVERGED and runs['adaptive_dls'].iterations <= 12
    trace = runs['dls'].trace
    last = make_iterate(problem.arm, problem.target, 'dls', lesson('residual').options(), trace.joint_positions, 39)
    directions = last.directions
    left = directions.component * 0.25 / (directions.sigma**2 + 0.25)
    after = make_iterate(problem.arm, problem.target, 'dls', lesson('residual').options(), trace.joint_positions, 40)
    np.testing.assert_allclose(directions.u.T @ after.error, left, atol=1e-3)


def test_redundancy_the_joints_move_and_the_tip_stays():
    _, runs = runs_of('redundancy')
    for run in runs.values():
        trace = run.trace
        assert run.status is Status.CONVERGED
        assert np.abs(trace.joint_positions[-1] - trace.joint_positions[0]).max() > 0.2
        assert np.linalg.norm(trace.tip_positions - trace.tip_positions[0], axis=1).max() < 0.02
        np.testing.assert_allclose(trace.tip_positions[-1], trace.tip_positions[0], atol=1e-4)


@pytest.mark.parametrize('item', LESSONS, ids=lambda item: item.name)
def test_a_lesson_says_in_three_sentences_what_to_watch_in_both_languages(item):
    for language in LANGUAGES:
        assert item.title[language]
        assert len(re.findall(r'[.!?](?:\s|$)', item.text[language])) == 3, item.text[language]
    assert item.watch in item.methods and set(item.methods) <= set(METHODS)


@pytest.mark.parametrize('item', LESSONS, ids=lambda item: item.name)
def test_a_lesson_sets_parameters_that_the_node_takes(item):
    for name, value in item.values().items():
        assert PARAMETERS[name].check(value) is not None


def test_the_directions_of_a_lesson_rebuild_its_jacobian():
    problem, _ = runs_of('wrist')
    jacobian = problem.arm.jacobian(problem.seed)
    directions = directions_of(jacobian, np.ones(6))
    np.testing.assert_allclose(directions.u * directions.sigma @ directions.v.T, jacobian, atol=1e-12)
