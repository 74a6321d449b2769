"""The contract that a solve keeps by every method."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numerics import (
    ROUNDING,
    assert_answer,
    get_arm,
    pinocchio_tip,
    pose_errors,
    random_configurations,
    reachable_poses,
)

import ros_ik_pkg
from ros_ik_pkg.ik import METHODS, TRACE_COLUMNS, ArgumentError, SolveOptions, Status, solve

pytestmark = pytest.mark.parametrize('method', METHODS)

ROBOTS = ('iiwa14', 'panda', 'planar3r', 'puma560', 'stanford', 'ur5')
LOOSE = {'position_tolerance': 1e-3, 'orientation_tolerance': 1e-3}  # the transpose needs thousands of steps for more
ONE_DESCENT = {'max_attempts': 1, 'max_iterations': 20000, 'deadline': 0.0, **LOOSE}


def near_problem(robot='puma560', seed=0, spread=0.2):
    """Make up a seed and a target a short way from it, both within the limits."""
    arm, rng = get_arm(robot), np.random.default_rng(seed)
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    start = rng.uniform(0.8 * lower + 0.2 * upper, 0.2 * lower + 0.8 * upper)
    goal = np.clip(start + rng.uniform(-spread, spread, arm.n), arm.lower, arm.upper)
    return arm, start, pinocchio_tip(arm, goal)


@pytest.mark.parametrize('robot', ROBOTS)
def test_a_target_nearby_is_reached_by_one_descent(method, robot):
    options = SolveOptions(method=method, **ONE_DESCENT)
    for seed in range(5):
        arm, start, target = near_problem(robot, seed)
        assert_answer(arm, solve(arm, target, start, options), target, options)


@pytest.mark.parametrize(('robot', 'secondary'), [*((robot, 'auto') for robot in ROBOTS), ('planar3r', 'none')])
@pytest.mark.parametrize('max_iterations', [0, 1, 3, 50])
def test_every_figure_belongs_to_the_configuration_that_is_returned(method, robot, secondary, max_iterations):
    arm, rng = get_arm(robot), np.random.default_rng(1)
    options = SolveOptions(
        method=method, max_iterations=max_iterations, max_attempts=3, deadline=0.0, secondary=secondary
    )
    for target, start in zip(reachable_poses(arm, rng, 5), random_configurations(arm, rng, 5)):
        reference = random_configurations(arm, rng, 1)[0]
        solution = solve(arm, target, start, options, reference)
        found = solution.position_error, solution.orientation_error
        np.testing.assert_allclose(found, pose_errors(arm, solution.q, target), rtol=0, atol=ROUNDING * 1e3)
        assert solution.joint_distance == np.max(np.abs(solution.q - reference))
        limits = np.flatnonzero((solution.q <= arm.lower) | (solution.q >= arm.upper))
        assert solution.joints_at_limits == tuple(limits)
        wishes = arm.n < 6 and secondary == 'auto'
        if not solution.converged:
            jacobian = arm.jacobian(solution.q)[: 3 if wishes else 6]
            sigma = np.linalg.svd(jacobian, compute_uv=False)[-1]
            assert solution.sigma_min == pytest.approx(sigma, rel=1e-9, abs=1e-12)
        assert solution.wished == (('rx', 'ry', 'rz') if wishes else ())
        wished = (0.0, solution.orientation_error) if wishes else (np.nan, np.nan)
        np.testing.assert_array_equal((solution.wished_position_error, solution.wished_orientation_error), wished)
        demanded = found[:1] if wishes else found
        assert solution.converged == (max(demanded) <= options.position_tolerance)


@pytest.mark.parametrize('robot', ['panda', 'puma560', 'planar3r'])
def test_a_solve_that_needs_k_steps_converges_with_k_and_not_with_one_less(method, robot):
    for seed in range(3):
        arm, start, target = near_problem(robot, seed)
        needed = solve(arm, target, start, SolveOptions(method=method, **ONE_DESCENT)).iterations
        assert needed > 0
        enough, short = (
            solve(arm, target, start, SolveOptions(method=method, **{**ONE_DESCENT, 'max_iterations': limit}))
            for limit in (needed, needed - 1)
        )
        assert (enough.status, enough.iterations) == (Status.CONVERGED, needed)
        assert (short.status, short.iterations) == (Status.MAX_ITERATIONS, needed - 1)


def test_a_seed_that_is_an_answer_needs_no_step(method):
    arm, start, _ = near_problem()
    for options in (SolveOptions(method=method), SolveOptions(method=method, max_attempts=1, max_iterations=0)):
        solution = solve(arm, pinocchio_tip(arm, start), start, options)
        assert (solution.status, solution.iterations, solution.attempts) == (Status.CONVERGED, 0, 1)
        np.testing.assert_array_equal(solution.q, start)


def test_no_iterations_judge_the_seed_alone(method):
    arm, start, target = near_problem()
    solution = solve(arm, target, start, SolveOptions(method=method, max_attempts=1, max_iterations=0), trace=True)
    assert (solution.status, solution.iterations, len(solution.trace)) == (Status.MAX_ITERATIONS, 0, 1)
    np.testing.assert_array_equal(solution.q, start)


def test_what_the_caller_hands_over_is_not_written_to(method):
    arm, start, target = near_problem()
    reference = start + 0.1
    kept = [array.copy() for array in (start, target, reference, arm.packed, arm.starts, arm.home)]
    solve(arm, target, start, SolveOptions(method=method), reference, trace=True)
    solution = solve(arm, target, start + 100.0, SolveOptions(method=method, choice='all', max_attempts=5))
    solution.q[:] = np.nan
    for array, copy in zip((start, target, reference, arm.packed, arm.starts, arm.home), kept):
        np.testing.assert_array_equal(array, copy)


def test_the_same_call_gives_the_same_bits(method):
    arm, rng = get_arm('iiwa14'), np.random.default_rng(5)
    options = SolveOptions(method=method, deadline=0.0, max_attempts=20)
    for target in reachable_poses(arm, rng, 5):
        assert bits(solve(arm, target, options=options)) == bits(solve(arm, target, options=options))


def bits(solution):
    """Everything of a solution but the time."""
    return (
        solution.q.tobytes(), solution.status, solution.position_error, solution.orientation_error,
        solution.iterations, solution.attempts, solution.joint_distance, solution.limits_mask,
    )  # fmt: skip


IN_A_NEW_PROCESS = """
import sys
import numpy as np
from ros_ik_pkg.ik import SolveOptions, load_arm, solve
arm = load_arm('panda')
target = arm.forward(np.array([0.7, 0.5, -1.0, -1.6, 1.1, 2.0, -0.8]))
for method in sys.argv[1:]:
    solution = solve(arm, target, options=SolveOptions(method=method, deadline=0.0, max_attempts=20))
    print(solution.q.tobytes().hex(), solution.iterations)
"""


@pytest.fixture(scope='module')
def new_process():
    """Lines that a new process prints, one for each method."""
    home = str(Path(ros_ik_pkg.__file__).parents[1])
    command = [sys.executable, '-c', IN_A_NEW_PROCESS, *METHODS]
    environment = os.environ | {'PYTHONPATH': os.pathsep.join([home, os.environ.get('PYTHONPATH', '')])}
    result = subprocess.run(command, env=environment, cwd=home, capture_output=True, text=True, timeout=900)
    assert result.returncode == 0, result.stderr
    return result.stdout.splitlines()


def test_a_new_process_gives_the_same_bits(method, new_process):
    arm = get_arm('panda')
    target = arm.forward(np.array([0.7, 0.5, -1.0, -1.6, 1.1, 2.0, -0.8]))
    solution = solve(arm, target, options=SolveOptions(method=method, deadline=0.0, max_attempts=20))
    assert new_process[METHODS.index(method)] == f'{solution.q.tobytes().hex()} {solution.iterations}'


def test_a_trace_has_a_row_for_every_configuration_that_was_judged(method):
    arm, start, target = near_problem()
    solution = solve(arm, target, start, SolveOptions(method=method, **ONE_DESCENT), trace=True)
    trace = solution.trace
    assert len(trace) == solution.iterations + 1
    assert trace.column('iteration').tolist() == list(range(len(trace)))
    assert not trace.column('attempt').any()
    np.testing.assert_array_equal(trace.joint_positions[0], start)
    np.testing.assert_array_equal(trace.joint_positions[-1], solution.q)
    last = trace.rows[-1, [TRACE_COLUMNS.index('position_error'), TRACE_COLUMNS.index('orientation_error')]]
    np.testing.assert_allclose(last, [solution.position_error, solution.orientation_error], rtol=0, atol=1e-15)


def test_a_trace_of_many_attempts_has_the_rows_of_each(method):
    arm = get_arm('puma560')
    target = np.eye(4)  # the wrist cannot come to the axis of joint 1
    options = SolveOptions(method=method, max_attempts=4, max_iterations=15, deadline=0.0)
    solution = solve(arm, target, options=options, trace=True)
    attempts = solution.trace.column('attempt').astype(int)
    assert solution.attempts == 4 and not solution.converged
    assert len(solution.trace) == solution.iterations + len(set(attempts))
    for attempt in set(attempts):
        iterations = solution.trace.column('iteration')[attempts == attempt]
        assert iterations.tolist() == list(range(len(iterations)))


def test_a_trace_does_not_change_the_answer(method):
    arm, rng = get_arm('ur5'), np.random.default_rng(6)
    options = SolveOptions(method=method, deadline=0.0, max_attempts=10)
    for target in reachable_poses(arm, rng, 5):
        assert bits(solve(arm, target, options=options)) == bits(solve(arm, target, options=options, trace=True))


@pytest.mark.parametrize('robot', ['panda', 'puma560', 'stanford'])
def test_a_seed_outside_the_limits_is_brought_inside_and_that_is_said(method, robot):
    arm, start, target = near_problem(robot)
    bounded = ~arm.wraps.astype(bool)
    seed = start.copy()
    seed[bounded] = arm.upper[bounded] + 0.3
    solution = solve(arm, target, seed, SolveOptions(method=method, max_attempts=1, max_iterations=0))
    assert solution.seed_clipped
    np.testing.assert_array_equal(solution.q[bounded], arm.upper[bounded])
    np.testing.assert_array_equal(solution.q[~bounded], start[~bounded])
    assert not solve(arm, target, start, SolveOptions(method=method, max_attempts=1)).seed_clipped


def test_without_limits_a_seed_outside_them_stays(method):
    arm, start, target = near_problem()
    seed = np.add(start, [0.0, 3.0, 0.0, 0.0, 2.0, 0.0])
    options = SolveOptions(method=method, max_attempts=1, max_iterations=0, respect_limits=False)
    solution = solve(arm, target, seed, options)
    assert not solution.seed_clipped
    np.testing.assert_array_equal(solution.q, seed)


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('seed', [0.0, 0.0, np.nan, 0.0, 0.0, 0.0]),
        ('seed', [0.0, 0.0, 0.0, 0.0, 0.0, -np.inf]),
        ('seed', [0.0] * 5),
        ('seed', [0.0] * 7),
        ('seed', [[0.0] * 6]),
        ('seed', 0.0),
        ('seed', 'home'),
        ('reference', [np.nan] * 6),
        ('reference', [0.0]),
        ('target', np.full((4, 4), np.nan)),
        ('target', np.diag([1.0, 1.0, np.inf, 1.0])),
        ('target', np.zeros((4, 4))),
        ('target', np.eye(3)),
        ('target', [0.4, 0.0, 0.3]),
        ('target', None),
        ('target', 'here'),
        ('target', 1.01 * np.eye(4)),
        ('target', np.diag([1.0, 1.0, -1.0, 1.0])),
        ('target', np.diag([1.0, 1.0, 1.0, 2.0])),
    ],
)
def test_nonsense_is_refused_by_name(method, name, value):
    arm = get_arm('puma560')
    arguments = {'target': arm.forward(arm.home), 'options': SolveOptions(method=method), name: value}
    with pytest.raises(ArgumentError, match=rf'^{name} '):
        solve(arm, **arguments)


def test_a_target_that_is_far_off_ends_early_with_the_closest_approach(method):
    arm = get_arm('planar3r')
    target = np.eye(4)
    target[:3, 3] = 1.2, 0.9, 0.0  # 1.5 m away; the arm is 0.9 m long
    options = SolveOptions(method=method, deadline=0.0, max_iterations=2000)
    solution = solve(arm, target, options=options)
    assert solution.status is Status.UNREACHABLE
    assert solution.attempts <= 8
    assert solution.position_error >= 0.6 - 1e-12
    np.testing.assert_allclose(
        (solution.position_error, solution.orientation_error), pose_errors(arm, solution.q, target), rtol=0, atol=1e-9
    )


@pytest.mark.parametrize('robot', ['ur5', 'iiwa14'])
def test_a_solution_is_never_said_of_what_pinocchio_says_is_none(method, robot):
    arm, rng = get_arm(robot), np.random.default_rng(7)
    options = SolveOptions(method=method, max_attempts=10, deadline=0.0)
    for target in reachable_poses(arm, rng, 20):
        target[:3, 3] *= rng.uniform(0.5, 1.6)  # some within reach, some not
        solution = solve(arm, target, options=options)
        if solution.converged:
            assert_answer(arm, solution, target, options)
        else:
            assert max(pose_errors(arm, solution.q, target)) > 1e-5


@pytest.mark.parametrize('noise', [1e-6, 1e-4])
def test_a_target_whose_rotation_is_slightly_off_is_reached_as_far_as_it_goes(method, noise):
    arm, start, target = near_problem()
    rough = target.copy()
    rough[:3, :3] += noise * np.random.default_rng(2).uniform(-1.0, 1.0, (3, 3))
    solution = solve(arm, rough, start, SolveOptions(method=method, **ONE_DESCENT))
    assert solution.converged
    assert np.max(pose_errors(arm, solution.q, target)) <= 1e-3 + 4.0 * noise
