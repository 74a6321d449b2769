"""Clearance in the node's messages: of a result, of each iterate, and the least of a second."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bench.published_robots import UR5, configurations
from ros_ik_pkg.ik import Obstacle, SolveOptions, Status, World, load_arm, solve
from ros_ik_pkg.ros.handling.result import FAILED, SOLVED, Result
from ros_ik_pkg.ros.input.target import Target
from ros_ik_pkg.ros.interface.health_limits import HealthLimits
from ros_ik_pkg.ros.output.health import Health
from ros_ik_pkg.ros.output.messages import CLEARANCE, trace_message
from ros_ik_pkg.ros.output.statuses import result_message

TARGET = Target(12, 34, '', (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
NEVER = HealthLimits(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope='module')
def arm():
    return load_arm(UR5[0], tip=UR5[2], srdf=UR5[1])


def result_of(arm, q, world=None, trace=True, **options):
    options = SolveOptions(deadline=10.0, **options)
    solution = solve(arm, arm.forward(q), options=options, trace=trace, world=world)
    outcome = SOLVED if solution.converged else FAILED
    return Result(TARGET, outcome, solution.status.label, 'because', 'dls', arm, solution)


def values_of(status):
    return {pair.key: pair.value for pair in status.values}


def figures_of(result):
    return values_of(result_message(result, 'ik_node').status[0])


def test_the_clearance_of_a_solution_is_a_bound_of_what_coal_finds(arm):
    for q in configurations(arm, 20, seed=5):
        result = result_of(arm, q, trace=False)
        if result.outcome == SOLVED:
            clearance = float(figures_of(result)['clearance'])
            assert 0.0 < clearance <= result.solution.clearance + 1e-6
            assert 'touching' not in figures_of(result)


def test_a_failure_by_contact_names_the_two_and_how_deep_they_are(arm):
    q = arm.home + 0.3
    pose = np.eye(4)
    pose[:3, 3] = arm.forward(q)[:3, 3]
    result = result_of(arm, q, World(obstacles=(Obstacle('ball', 'sphere', (0.1,), pose),)))
    assert result.solution.status == Status.COLLISION
    figures = figures_of(result)
    assert 'ball' in figures['touching'].split(', ') and float(figures['clearance']) == result.solution.clearance < 0.0
    assert figures['least_bad'] == ' '.join(map(str, result.solution.q.tolist()))


def test_the_trace_ends_with_the_clearance_of_each_iterate(arm):
    result = result_of(arm, configurations(arm, 1, seed=7)[0])
    message = trace_message(result, result.solution.trace, 'dls', 'solve')
    assert message.layout.dim[1].label.split(',')[-1] == CLEARANCE
    matrix = np.array(message.data).reshape(message.layout.dim[0].size, -1)
    for row, q in zip(matrix, result.solution.trace.joint_positions):
        contact = arm.contacts.look(q)
        assert row[-1] <= max(contact.clearance, 0.0) + 1e-6
        np.testing.assert_array_equal(row[-1 - arm.n : -1], q)


def test_nothing_is_said_of_clearance_where_contact_does_not_count(arm):
    result = result_of(arm, arm.home + 0.3, avoid_collisions=False)
    assert 'clearance' not in figures_of(result) and math.isnan(result.clearance)
    assert CLEARANCE not in trace_message(result, result.solution.trace, 'dls', 'solve').layout.dim[1].label


def test_diagnostics_have_the_least_clearance_of_the_period(arm):
    health = Health()
    results = [result_of(arm, q, trace=False) for q in configurations(arm, 20, seed=5)]
    for result in results:
        health.count(result, 0.001)
    least = min(result.clearance for result in results if result.outcome == SOLVED)
    assert float(values_of(health.report(NEVER, 1.0))['clearance_min']) == round(least, 6)
    assert values_of(health.report(NEVER, 1.0))['clearance_min'] == 'nan'
