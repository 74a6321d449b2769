"""The sphere that an arm cannot leave: never too small, tight where a closed form tells, used to stop early."""

from __future__ import annotations

import numpy as np
import pytest
from chains import chain, random_urdf
from hypothesis import given
from hypothesis import strategies as st
from numerics import SEEDS, few, get_arm, pinocchio_tip, pose_errors, random_configurations, random_rotation, tuning

from ros_ik_pkg.ik import METHODS, SolveOptions, Status, load_arm, solve
from ros_ik_pkg.ik.kernel.data_layout import Task
from ros_ik_pkg.ik.search.reach import make_reach, out_of_reach

ROBOTS = ('iiwa14', 'panda', 'planar3r', 'puma560', 'stanford', 'ur5')


def far_from_base(arm, q, reach):
    """How far the wrist point and the tip are from the point in the base, by Pinocchio [m]."""
    pose = pinocchio_tip(arm, q)
    wrist = pose[:3, 3] + pose[:3, :3] @ reach.in_tip
    return np.array([np.linalg.norm(point - reach.in_base) for point in (wrist, pose[:3, 3])])


def assert_bound_holds(arm, rng, count):
    reach = make_reach(arm.geometry)
    corners = np.where(rng.random((count, arm.n)) < 0.5, np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi))
    for q in (*random_configurations(arm, rng, count), *corners):
        assert np.all(far_from_base(arm, q, reach) <= reach.lengths + 1e-9)


@few
@given(SEEDS, st.integers(1, 9), st.integers(0, 2))
def test_no_configuration_of_a_random_chain_is_further_than_the_bound(seed, joints, mimics):
    rng = np.random.default_rng(seed)
    arm = load_arm(random_urdf(rng, joints=joints, mimics=mimics, branches=0), 'base', 'tip')
    assert_bound_holds(arm, rng, 40)


@pytest.mark.parametrize('robot', ROBOTS)
def test_no_configuration_of_a_shipped_robot_is_further_than_the_bound(robot):
    assert_bound_holds(get_arm(robot), np.random.default_rng(1), 300)


def test_the_bound_of_a_planar_arm_is_its_length():
    reach = make_reach(get_arm('planar3r').geometry)
    np.testing.assert_allclose(reach.lengths, [0.7, 0.9], rtol=0, atol=1e-12)
    np.testing.assert_allclose(reach.in_base, np.zeros(3), rtol=0, atol=1e-12)
    np.testing.assert_allclose(reach.in_tip, [-0.2, 0.0, 0.0], rtol=0, atol=1e-12)


def test_a_spherical_wrist_counts_as_one_point():
    # Puma 560: from the shoulder 0.432 m and the offset 0.1254 m to the elbow, then sqrt(d4^2 + a3^2) to the wrist
    lengths = make_reach(get_arm('puma560').geometry).lengths
    farthest = np.hypot(0.432 + np.hypot(0.4318, 0.0203), 0.1254)
    assert np.all(lengths >= farthest - 1e-9)
    assert np.all(lengths <= 1.02 * farthest)


def test_a_slide_adds_what_it_can():
    arm = load_arm(chain(('j1', 'revolute', {}), ('j2', 'prismatic', {'axis': (1, 0, 0), 'lower': -0.2, 'upper': 0.7})))
    reach = make_reach(arm.geometry)
    assert reach.lengths[1] == pytest.approx(np.hypot(0.1, 0.0) + 0.7, abs=0.25)
    assert_bound_holds(arm, np.random.default_rng(0), 50)


def test_a_slide_alone_is_bounded_too():
    arm = load_arm(chain(('j1', 'prismatic', {'lower': -0.2, 'upper': 0.7})))
    assert make_reach(arm.geometry).lengths.tolist() == [0.7, 0.7]
    assert_bound_holds(arm, np.random.default_rng(0), 20)


@pytest.mark.parametrize('robot', ROBOTS)
def test_a_target_beyond_the_sphere_is_unreachable_after_a_few_attempts(robot):
    arm, rng = get_arm(robot), np.random.default_rng(2)
    reach = make_reach(arm.geometry)
    for _ in range(5):
        target = np.eye(4)
        target[:3, :3] = random_rotation(rng)
        target[:3, 3] = reach.in_base + 1.05 * reach.lengths[1] * random_rotation(rng)[0]
        solution = solve(arm, target, options=SolveOptions(deadline=0.0))
        assert solution.status is Status.UNREACHABLE
        assert solution.attempts <= 8
        shortest = 0.05 * reach.lengths[1]  # what is missing to the sphere
        assert shortest <= pose_errors(arm, solution.q, target)[0] == pytest.approx(solution.position_error, abs=1e-9)


@pytest.mark.parametrize(('method', 'precision'), [('transpose', 0.02), *((m, 1e-6) for m in METHODS[1:])])
@pytest.mark.parametrize('place', [(1.5, 0.0), (0.0, -1.2), (0.8, 0.9)])
def test_the_closest_approach_to_a_place_beyond_a_planar_arm_is_its_closed_form(method, precision, place):
    arm, target = get_arm('planar3r'), np.eye(4)
    target[:2, 3] = place
    options = SolveOptions(method=method, deadline=0.0, task_weights=(1, 1, 1, 0, 0, 0))
    solution = solve(arm, target, options=options)
    assert solution.status is Status.UNREACHABLE
    assert solution.position_error == pytest.approx(np.hypot(*place) - 0.9, rel=precision)
    assert solution.sigma_min < 0.05  # stretched out


@pytest.mark.parametrize(('metres', 'beyond'), [(0.9 - 1e-9, False), (0.9, False), (0.9 + 1e-7, True)])
def test_the_edge_of_the_reach_is_sharp(metres, beyond):
    arm, options = get_arm('planar3r'), {'position_tolerance': 1e-12, 'orientation_tolerance': 1e-12}
    rows, exact = np.ones(6), np.zeros(6)
    task = Task(tuple(np.eye(3).ravel()), (metres, 0.0, 0.0), rows, exact, 0.0, 1.0, 0.0, 0.0)
    assert out_of_reach(arm.geometry, make_reach(arm.geometry), task, tuning(**options)) == beyond


@pytest.mark.parametrize('seed', range(3))
def test_the_distance_is_that_of_the_wrist_however_the_tip_is_turned(seed):
    rng = np.random.default_rng(seed)
    arm = load_arm(random_urdf(rng, 7, ('revolute',), branches=0), 'base', 'tip')
    reach, target = arm.reach_bound, np.eye(4)
    assert np.abs(reach.in_tip).min() > 1e-3  # else an axis would not count
    for _ in range(10):
        away = rng.normal(size=3)
        for share, beyond in ((1.0 - 1e-6, False), (1.0 + 1e-3, True)):
            target[:3, :3] = random_rotation(rng)
            wrist = reach.in_base + share * reach.lengths[0] * away / np.linalg.norm(away)
            target[:3, 3] = wrist - target[:3, :3] @ reach.in_tip
            status = solve(arm, target, options=SolveOptions(max_attempts=9, deadline=0.0)).status
            assert (status == Status.UNREACHABLE) == beyond


def test_a_target_just_outside_but_within_tolerance_counts_as_reachable():
    arm, target = get_arm('planar3r'), np.eye(4)
    target[0, 3] = 0.9 + 5e-4
    tolerances = {'position_tolerance': 1e-3, 'orientation_tolerance': 1e-2}
    assert solve(arm, target, options=SolveOptions(deadline=0.0, **tolerances)).converged


def test_how_far_off_depends_on_what_is_asked_for():
    # 0.8 m is within reach, but not with the tip turned back: then the wrist would be 1 m away
    arm, target = get_arm('planar3r'), np.diag([-1.0, -1.0, 1.0, 1.0])
    target[0, 3] = 0.8
    whole = SolveOptions(secondary='none', deadline=0.0)
    assert solve(arm, target, options=whole).status is Status.UNREACHABLE
    loose = SolveOptions(deadline=0.0, task_weights=(1, 1, 0, 0, 0, 0), max_joint_step=0.3)
    assert solve(arm, target, options=loose).converged


@pytest.mark.parametrize('robot', ['panda', 'ur5'])
def test_no_small_step_comes_nearer_than_the_closest_approach(robot):
    arm, rng = get_arm(robot), np.random.default_rng(9)
    for _ in range(5):
        target = np.eye(4)
        target[:3, :3], target[:3, 3] = random_rotation(rng), 2.0 * random_rotation(rng)[0]
        solution = solve(arm, target, options=SolveOptions(deadline=0.0))
        error = np.linalg.norm(pose_errors(arm, solution.q, target))
        for step in 1e-3 * np.vstack([np.eye(arm.n), -np.eye(arm.n)]):
            q = np.clip(solution.q + step, arm.lower, arm.upper)
            assert np.linalg.norm(pose_errors(arm, q, target)) > error - 1e-6


def test_a_slide_that_may_leave_its_limits_has_no_reach():
    slide = {'axis': (1, 0, 0), 'lower': 0.0, 'upper': 0.2}
    arm = load_arm(chain(('turn', 'revolute', {}), ('slide', 'prismatic', slide)))
    target = arm.forward(np.array([0.4, 1.5]))
    assert solve(arm, target, options=SolveOptions(deadline=0.0)).status is Status.UNREACHABLE
    assert solve(arm, target, options=SolveOptions(respect_limits=False, deadline=0.0)).converged


def test_a_slide_without_limits_reaches_without_bound():
    arm = load_arm(chain(('turn', 'revolute', {}), ('slide', 'prismatic', {'axis': (1, 0, 0)})))
    for lower, upper in ((-np.inf, 1.0), (0.0, np.inf), (-np.inf, np.inf)):
        endless = arm.geometry._replace(lower=np.array([-2.0, lower]), upper=np.array([2.0, upper]))
        assert np.all(np.isinf(make_reach(endless).lengths))
