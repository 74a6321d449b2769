"""Rows that are wished for: the demanded rows are exact, and no optimiser of SciPy comes nearer to the wished ones."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from numerics import random_configurations, random_rotation
from scipy.optimize import minimize

from ros_ik_pkg.ik import OptionError, SolveOptions, Status, load_arm, solve, solve_batch

CALM = {'deadline': 0.0}  # what a busy machine must not change
ARM = load_arm('so101')
AS_NEAR = 1.01  # of the error that SciPy leaves
PALLETISER = """<robot name="palletiser"><link name="base"/><link name="column"/><link name="upper"/><link name="fore"/>
<link name="wrist"/><link name="tip"/>
<joint name="pan" type="revolute"><parent link="base"/><child link="column"/><axis xyz="0 0 1"/>
 <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="lift" type="revolute"><parent link="column"/><child link="upper"/><origin xyz="0.1 0 0.4"/>
 <axis xyz="0 1 0"/><limit lower="-1.2" upper="1.5" effort="1" velocity="1"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0 0.6"/>
 <axis xyz="0 1 0"/><limit lower="0.1" upper="2.5" effort="1" velocity="1"/></joint>
<joint name="roll" type="revolute"><parent link="fore"/><child link="wrist"/><origin xyz="0.01 0 0.5"/>
 <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="end" type="fixed"><parent link="wrist"/><child link="tip"/><origin xyz="0.01 0 0.1"/></joint></robot>"""


def errors_of(arm, q, target):
    """Return the twist error (6,) of the tip in base axes, by Pinocchio."""
    data, whole = arm.model.createData(), np.zeros(arm.model.nq)
    whole[: len(q)] = q
    pin.framesForwardKinematics(arm.model, data, whole)
    tip = data.oMf[arm.model.getFrameId(arm.tip_frame)]
    return np.hstack([target[:3, 3] - tip.translation, pin.log3(target[:3, :3] @ tip.rotation.T)])


def full_poses(arm, rng, count):
    """Draw poses whose position the arm reaches, turned anyhow."""
    poses = np.array([arm.forward(q) for q in random_configurations(arm, rng, count)])
    for pose in poses:
        pose[:3, :3] = random_rotation(rng)
    return poses


def best_of_scipy(arm, target, rng, starts, demanded=slice(0, 3), wished=slice(3, 6)):
    """Return the least norm of the wished rows that SLSQP finds from many starts while the demanded ones are zero."""
    best = np.inf
    for q in random_configurations(arm, rng, starts):
        found = minimize(
            lambda q: np.sum(errors_of(arm, q, target)[wished] ** 2), q, method='SLSQP',
            bounds=list(zip(arm.lower, arm.upper)),
            constraints={'type': 'eq', 'fun': lambda q: errors_of(arm, q, target)[demanded]},
            options={'maxiter': 100, 'ftol': 1e-10},
        )  # fmt: skip
        if np.linalg.norm(errors_of(arm, found.x, target)[demanded]) < 1e-4:
            best = min(best, np.linalg.norm(errors_of(arm, found.x, target)[wished]))
    return best


def test_five_joints_reach_every_position_and_come_as_near_to_the_orientation_as_scipy():
    rng = np.random.default_rng(3)
    for target in full_poses(ARM, rng, 24):
        solution = solve(ARM, target, options=SolveOptions(**CALM))
        error = errors_of(ARM, solution.q, target)
        assert solution.converged and np.linalg.norm(error[:3]) <= 1e-5
        assert np.all((ARM.lower <= solution.q) & (solution.q <= ARM.upper))
        assert np.linalg.norm(error[3:]) <= AS_NEAR * best_of_scipy(ARM, target, rng, 8) + 1e-5


def test_four_joints_of_a_palletiser_turn_the_tool_as_near_as_they_can():
    arm, rng = load_arm(PALLETISER), np.random.default_rng(13)
    for target in full_poses(arm, rng, 20):
        solution = solve(arm, target, options=SolveOptions(**CALM))
        error = errors_of(arm, solution.q, target)
        assert solution.converged and np.linalg.norm(error[:3]) <= 1e-5
        assert np.linalg.norm(error[3:]) <= AS_NEAR * best_of_scipy(arm, target, rng, 8) + 1e-5


def test_three_joints_in_a_plane_bring_the_tip_to_its_place_and_as_near_to_the_angle_as_they_can():
    arm, rng = load_arm('planar3r'), np.random.default_rng(14)
    for q in random_configurations(arm, rng, 20):
        target = arm.forward(q)
        angle = rng.uniform(-np.pi, np.pi)
        target[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        solution = solve(arm, target, options=SolveOptions(**CALM))
        error = errors_of(arm, solution.q, target)
        assert solution.converged and np.linalg.norm(error[:3]) <= 1e-5
        assert np.linalg.norm(error[3:]) <= AS_NEAR * best_of_scipy(arm, target, rng, 12) + 1e-5


@pytest.mark.parametrize(('robot', 'there', 'turned', 'near'), [
    # 5 mm beside the first axis; there the last joint goes from one limit to the other
    ('so101', (-0.4923, 1.4126, 0.2115, 1.1833, -2.7438), (1.808, -0.1771, -1.0386), None),
    # two joints at limits, and a position that the others miss by less than the tolerance
    (
        'so100', (-0.9304, 0.6192, -2.4754, 1.2, 1.4167), (2.2575, 1.0669, 0.6333),
        (-0.9304, 1.4591, -3.14158, -2.5, -0.0367),
    ),
    # the first joint at one limit, beside the first axis, and the nearest solution close to the other
    (PALLETISER, (2.9255, -0.6782, 1.1255, 0.2605), (2.08, -0.7837, -2.1125), None),
])  # fmt: skip
def test_a_configuration_known_to_be_near_is_found_beside_the_first_axis_and_in_a_corner_of_limits(
    robot, there, turned, near
):
    arm = load_arm(robot)
    target = arm.forward(np.clip(there, arm.lower, arm.upper))
    target[:3, :3] = pin.exp3(np.array(turned))
    known = errors_of(arm, np.clip(there if near is None else near, arm.lower, arm.upper), target)
    assert np.linalg.norm(known[:3]) <= 1e-5
    solution = solve(arm, target, options=SolveOptions(**CALM), trace=True)
    error = errors_of(arm, solution.q, target)
    assert solution.converged and np.linalg.norm(error[:3]) <= 1e-5
    assert np.linalg.norm(error[3:]) <= AS_NEAR * np.linalg.norm(known[3:])
    assert np.all(np.isfinite(solution.trace.joint_positions))


def test_the_solution_says_what_was_demanded_and_what_was_wished_and_how_near_it_came():
    target = full_poses(ARM, np.random.default_rng(4), 1)[0]
    options = SolveOptions(**CALM)
    solution = solve(ARM, target, options=options)
    error = errors_of(ARM, solution.q, target)
    assert solution.wished == options.wished_rows(ARM.n) == ('rx', 'ry', 'rz')
    assert options.demanded_rows(ARM.n) == ('x', 'y', 'z')
    assert solution.position_error == pytest.approx(np.linalg.norm(error[:3]), abs=1e-9)
    assert solution.orientation_error == pytest.approx(np.linalg.norm(error[3:]), abs=1e-7)
    assert solution.wished_orientation_error == solution.orientation_error and solution.wished_position_error == 0.0


def test_a_pose_that_five_joints_reach_whole_is_reached_whole():
    rng = np.random.default_rng(5)
    for q in random_configurations(ARM, rng, 200):
        target = ARM.forward(q)
        solution = solve(ARM, target, options=SolveOptions(**CALM))
        assert solution.converged and solution.orientation_error <= 1e-5
        assert np.linalg.norm(errors_of(ARM, solution.q, target)[3:]) <= 1e-5 + 1e-12


def test_a_target_near_the_seed_is_reached_as_if_all_rows_were_demanded():
    rng = np.random.default_rng(15)
    for q in random_configurations(ARM, rng, 50):
        target, seed = ARM.forward(q), np.clip(q + 0.02, ARM.lower, ARM.upper)
        solution = solve(ARM, target, seed, SolveOptions(**CALM))
        np.testing.assert_array_equal(solution.q, solve(ARM, target, seed, SolveOptions(secondary='none', **CALM)).q)


@pytest.mark.parametrize('said', [
    {'orientation_tolerance': 0.5}, {'position_tolerance': 1e-3}, {'task_weights': (1, 1, 1, 0.5, 0.5, 0.5)},
    {'task_tolerances': (0, 0, 0, 0.1, 0.1, 0.1)}, {'max_attempts': 1}, {'secondary': 'none'},
])  # fmt: skip
def test_whoever_says_what_is_demanded_gets_that(said):
    options = SolveOptions(**said, **CALM)
    assert options.wished_rows(ARM.n) == ()
    target = full_poses(ARM, np.random.default_rng(6), 1)[0]
    solution, whole = solve(ARM, target, options=options), SolveOptions(**{**said, 'secondary': 'none'}, **CALM)
    assert solution.wished == () and not solution.converged
    np.testing.assert_array_equal(solution.q, solve(ARM, target, options=whole).q)


def test_the_wish_keeps_to_max_joint_jump():
    rng = np.random.default_rng(16)
    for q in random_configurations(ARM, rng, 20):
        target = ARM.forward(np.clip(q + rng.uniform(-0.2, 0.2, ARM.n), ARM.lower, ARM.upper))
        target[:3, :3] = random_rotation(rng)
        solution = solve(ARM, target, q, SolveOptions(max_joint_jump=0.4, **CALM))
        free = solve(ARM, target, q, SolveOptions(**CALM))
        assert solution.converged and solution.joint_distance <= 0.4 + 1e-12
        assert free.wished_orientation_error <= AS_NEAR * solution.wished_orientation_error


@pytest.mark.parametrize('batch', [False, True])
def test_the_errors_of_a_failure_beyond_the_jump_are_those_of_its_configuration(batch):
    rng = np.random.default_rng(17)
    targets, seeds = full_poses(ARM, rng, 20), random_configurations(ARM, rng, 20)
    options = SolveOptions(max_joint_jump=0.05, **CALM)
    references = random_configurations(ARM, rng, 20)
    solutions = solve_batch(ARM, targets, seeds, options, references)
    beyond = 0
    for k, (target, seed, reference) in enumerate(zip(targets, seeds, references)):
        one = solve(ARM, target, seed, options, reference)
        q = solutions.q[k] if batch else one.q
        said = (
            (solutions.position_error[k], solutions.wished_orientation_error[k]) if batch
            else (one.position_error, one.wished_orientation_error)
        )  # fmt: skip
        error = errors_of(ARM, q, target)
        np.testing.assert_allclose(said, (np.linalg.norm(error[:3]), np.linalg.norm(error[3:])), atol=1e-9)
        beyond += np.max(np.abs(q - reference)) > 0.05
    assert beyond > 5


def test_starts_over_four_joints_find_what_is_near_the_target():
    # The last joint moves the tip, so the starts cover it too, and are sparse.
    arm = load_arm(PALLETISER.replace('</joint></robot>', (
        '</joint><link name="tool"/><joint name="bend" type="revolute"><parent link="tip"/><child link="tool"/>'
        '<axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" effort="1" velocity="1"/></joint><link name="end"/>'
        '<joint name="last" type="fixed"><parent link="tool"/><child link="end"/><origin xyz="0 0 0.3"/></joint>'
        '</robot>'
    )))  # fmt: skip
    assert arm.n == 5 and arm.ordered_starts[1][:2].tolist() == [1.0, 0.0]
    near = 0
    for q in random_configurations(arm, np.random.default_rng(18), 100):
        target = arm.forward(q)
        target[:3, :3] = target[:3, :3] @ pin.exp3(np.array([0.3, 0.0, 0.0]))
        solution = solve(arm, target, options=SolveOptions(**CALM))
        near += solution.converged and solution.wished_orientation_error <= 0.3 * AS_NEAR
    assert near >= 99


def test_six_joints_and_tasks_of_few_rows_have_no_wish_of_their_own():
    ur5, options = load_arm('ur5'), SolveOptions(task_weights=(1, 1, 1, 0, 0, 0), **CALM)
    for arm, solution in (
        (ur5, solve(ur5, ur5.forward(ur5.home + 0.1))), (ARM, solve(ARM, ARM.forward(ARM.home + 0.1), options=options))
    ):  # fmt: skip
        assert solution.converged and solution.wished == () and np.isnan(solution.wished_orientation_error), arm.name


@pytest.mark.parametrize('frame', ['base', 'tip'])
def test_single_rows_may_be_wished_for(frame):
    ur5, rng = load_arm('ur5'), np.random.default_rng(7)
    options = SolveOptions(secondary='rx rz', task_frame=frame, **CALM)
    for pose in full_poses(ur5, rng, 10):
        solution = solve(ur5, pose, options=options)
        error = errors_of(ur5, solution.q, pose)
        axes = pose[:3, :3].T if frame == 'tip' else np.eye(3)
        turned = axes @ error[3:]
        assert solution.converged and solution.wished == ('rx', 'rz')
        assert np.linalg.norm(error[:3]) <= 1e-5 and abs(turned[1]) <= 1e-5
        assert solution.wished_orientation_error == pytest.approx(np.hypot(turned[0], turned[2]), abs=1e-6)


def test_the_position_may_be_wished_for_and_the_orientation_demanded():
    ur5, rng = load_arm('ur5'), np.random.default_rng(8)
    for pose in full_poses(ur5, rng, 4):
        pose[:3, 3] *= 1.6  # some of them out of reach
        solution = solve(ur5, pose, options=SolveOptions(secondary='position', **CALM))
        error = errors_of(ur5, solution.q, pose)
        assert solution.converged and solution.wished == ('x', 'y', 'z') and np.linalg.norm(error[3:]) <= 1e-5
        best = best_of_scipy(ur5, pose, rng, 8, slice(3, 6), slice(0, 3))
        assert np.linalg.norm(error[:3]) <= AS_NEAR * best + 1e-4


def test_a_position_out_of_reach_fails_as_ever():
    target = np.eye(4)
    target[0, 3] = 3.0
    solution = solve(ARM, target, options=SolveOptions(**CALM))
    assert solution.status == Status.UNREACHABLE and solution.position_error > 2.0
    assert solution.wished == ('rx', 'ry', 'rz')


def test_a_solution_stays_where_it_is_if_another_is_hardly_better():
    rng = np.random.default_rng(9)
    for target in full_poses(ARM, rng, 20):
        first = solve(ARM, target, options=SolveOptions(**CALM))
        again = solve(ARM, target, first.q, SolveOptions(**CALM))
        np.testing.assert_allclose(again.q, first.q, atol=1e-3)


def test_all_has_the_configurations_that_are_equally_near():
    target = full_poses(ARM, np.random.default_rng(10), 1)[0]
    solution = solve(ARM, target, options=SolveOptions(choice='all', **CALM))
    for q in solution.solutions:
        error = errors_of(ARM, q, target)
        assert np.linalg.norm(error[:3]) <= 1e-5
        assert np.linalg.norm(error[3:]) <= AS_NEAR * solution.wished_orientation_error


def test_a_batch_has_the_same_solutions():
    targets = full_poses(ARM, np.random.default_rng(11), 10)
    batch = solve_batch(ARM, targets, options=SolveOptions(**CALM))
    np.testing.assert_array_equal(batch.q, [solve(ARM, target, options=SolveOptions(**CALM)).q for target in targets])


def test_the_trace_holds_every_descent():
    target = full_poses(ARM, np.random.default_rng(12), 1)[0]
    solution = solve(ARM, target, options=SolveOptions(**CALM), trace=True)
    assert np.unique(solution.trace.column('attempt')).size == solution.attempts
    assert len(solution.trace) == solution.iterations + solution.attempts


@pytest.mark.parametrize('weights', [(1,) * 6, (1, 1, 1, 1, 1, 0), (1, 1, 0, 0, 0, 1), (0, 0, 0, 1, 1, 1)])
@pytest.mark.parametrize('secondary', ['none', 'auto', 'orientation', 'rz', 'x rz'])
def test_a_solution_names_the_rows_that_the_options_wish_for(weights, secondary):
    for arm in (ARM, load_arm('planar3r'), load_arm('ur5')):
        try:
            options = SolveOptions(task_weights=weights, secondary=secondary, **CALM)
        except OptionError:
            continue
        solution = solve(arm, arm.forward(arm.home), options=options)
        assert solution.wished == options.wished_rows(arm.n)


@pytest.mark.parametrize('secondary', ['rx rx', 'roll', '', 'orientation rx', 'x,y'])
def test_other_words_for_the_rows_are_refused(secondary):
    with pytest.raises(OptionError, match='is not allowed: expected one of auto, none, orientation, position, or some'):
        SolveOptions(secondary=secondary)


def test_a_task_without_demanded_rows_is_refused():
    with pytest.raises(OptionError, match="secondary = 'orientation' leaves no row of the task that is demanded"):
        SolveOptions(task_weights=(0, 0, 0, 1, 1, 1), secondary='orientation')
