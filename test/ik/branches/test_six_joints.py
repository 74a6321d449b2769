"""All solutions of six-joint arms, beside those that a Newton iteration on Pinocchio's kinematics finds by chance."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from chains import joint_xml, urdf
from numerics import get_arm, pinocchio_tip, pose_errors, random_configurations, reachable_poses

from bench.published_robots import UR5
from ros_ik_pkg.ik import SolveOptions, Status, World, load_arm, solve
from ros_ik_pkg.ik.branches.axes import PARALLEL, WRIST, kind_of

TURN = 2.0 * np.pi
SAME = 1e-2
LIMIT = 3.0
KINDS = (
    'wrist', 'wrist, two parallel', 'wrist, two that meet', 'wrist first', 'parallel', 'parallel, two that meet',
    'parallel first', 'any', 'any, two parallel', 'any, two that meet', 'any, the last two meet',
)  # fmt: skip


def every(**options):
    return SolveOptions(choice='all', deadline=0.0, **options)


def apart(a, b):
    gap = np.asarray(a) - b
    return np.abs(gap - TURN * np.round(gap / TURN)).max(axis=-1)


def unit(v):
    return v / np.linalg.norm(v)


def made_up(kind, rng, off=0.0):
    """Return axes (6, 3) and points (6, 3) of an arm of a kind, missed by `off` [rad, m]."""
    h, p = [unit(rng.normal(size=3)) for _ in range(6)], list(rng.uniform(-0.4, 0.4, (6, 3)))
    if kind.startswith('wrist'):
        for k in (3, 4, 5):
            p[k] = p[3] + rng.uniform(-0.1, 0.1) * h[k]
        if 'two parallel' in kind:
            h[2] = h[1]
        if 'two that meet' in kind:
            p[1] = p[0]
        p[5] = p[5] + off * unit(np.cross(h[4], h[5]))
    elif kind.startswith('any'):
        if 'two parallel' in kind:
            h[2] = h[1]
        if 'two that meet' in kind:
            p[1] = p[0]
        if 'last two' in kind:
            h[2], p[5] = h[1], p[4]
    else:
        h[2], h[3] = h[1], unit(h[1] + off * rng.normal(size=3))
        if 'two that meet' in kind:
            p[5] = p[4]
    return (h[::-1], p[::-1]) if 'first' in kind else (h, p)


def arm_of(axes, points, limit=LIMIT):
    """Return the arm with these axes where all joints are zero."""
    frames = [np.eye(4)]
    for h, p in zip(axes, points):
        x = unit(np.cross(h, unit(np.array([0.3, -0.5, 0.8]))))
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = np.column_stack([x, np.cross(h, x), h]), p
        frames.append(frame)
    frames.append(frames[-1] @ pin.SE3(pin.exp3(np.array([0.3, 0.7, -0.2])), np.array([0.1, 0.05, 0.2])).homogeneous)
    links, joints = [f'l{k}' for k in range(len(frames))], []
    for k in range(1, len(frames)):
        step = np.linalg.solve(frames[k - 1], frames[k])
        kind = 'fixed' if k == len(frames) - 1 else 'revolute'
        rpy = pin.rpy.matrixToRpy(step[:3, :3])
        joints.append(joint_xml(f'j{k}', kind, links[k - 1], links[k], step[:3, 3], rpy, lower=-limit, upper=limit))
    return load_arm(urdf(links, joints))


def newton(arm, target, q, steps=60):
    """Return where a damped Newton iteration on Pinocchio's kinematics leads, None if it does not get there."""
    data, frame = arm.model.createData(), arm.model.getFrameId(arm.tip_frame, pin.BODY)
    goal = pin.SE3(target)
    for _ in range(steps):
        pin.framesForwardKinematics(arm.model, data, q)
        error = pin.log6(data.oMf[frame].actInv(goal)).vector
        if np.linalg.norm(error) < 1e-10:
            return q
        J = pin.computeFrameJacobian(arm.model, data, q, frame, pin.LOCAL)
        dq = np.linalg.solve(J.T @ J + 1e-4 * min(1.0, error @ error) * np.eye(6), J.T @ error)
        q = q + np.clip(dq, -0.4, 0.4)
    return None


def found_by_chance(arm, target, rng, tries=40):
    """Return the solutions within the limits that Newton iterations from random configurations lead to."""
    ends = [newton(arm, target, q) for q in random_configurations(arm, rng, tries)]
    turned = [q - TURN * np.round(q / TURN) for q in ends if q is not None]
    return [q for q in turned if (q >= arm.lower).all() and (q <= arm.upper).all()]


def assert_all_right(arm, target, solutions):
    """Assert that each solution is one by Pinocchio, within the limits, and that none is listed twice."""
    for k, q in enumerate(solutions):
        assert max(pose_errors(arm, q, target)) <= 1e-5 + 1e-9
        assert (arm.lower <= q).all() and (q <= arm.upper).all()
        assert (apart(solutions[:k], q) > SAME).all()


@pytest.mark.parametrize('kind', KINDS)
def test_no_solution_that_chance_finds_is_missing(kind):
    rng = np.random.default_rng(3)
    for _ in range(3):
        arm = arm_of(*made_up(kind, rng))
        for q in random_configurations(arm, rng, 4):
            target = pinocchio_tip(arm, q)
            solution = solve(arm, target, np.zeros(6), every())
            assert solution.completeness == 'proof'
            assert_all_right(arm, target, solution.solutions)
            for known in [q, *found_by_chance(arm, target, rng)]:
                assert apart(solution.solutions, known).min() < SAME


@pytest.mark.parametrize('kind', KINDS)
def test_a_pose_without_solution_is_proven_to_have_none(kind):
    rng, none = np.random.default_rng(4), 0
    arm = arm_of(*made_up(kind, rng), limit=1.5)
    for q, other in zip(random_configurations(arm, rng, 12), random_configurations(arm, rng, 12)):
        target = pinocchio_tip(arm, q)
        target[:3, :3] = pinocchio_tip(arm, other)[:3, :3]
        solution = solve(arm, target, q, SolveOptions(deadline=0.0))
        if not solution.converged:
            none += 1
            assert (solution.status, solution.completeness) == (Status.UNREACHABLE, 'proof')
            assert not found_by_chance(arm, target, rng)
    assert none > 2


@pytest.mark.parametrize('kind', KINDS[:7])
def test_axes_that_are_a_little_off_need_no_closed_form(kind):
    rng = np.random.default_rng(5)
    arm, proven = arm_of(*made_up(kind, rng, off=2e-3)), 0
    for q in random_configurations(arm, rng, 6):
        if np.linalg.svd(arm.jacobian(q))[1][-1] < 5e-3:
            continue  # a double root, almost
        target = pinocchio_tip(arm, q)
        solution = solve(arm, target, np.zeros(6), every())
        proven += solution.completeness == 'proof'
        assert_all_right(arm, target, solution.solutions)
        for known in [q, *found_by_chance(arm, target, rng, 20)]:
            assert apart(solution.solutions, known).min() < SAME
    assert proven > 0


def test_an_arm_with_sixteen_solutions_has_them_all_listed_even_if_some_share_an_angle_almost():
    """The axes of an xArm6, at a pose of which some solutions differ by 3e-4 rad in joint 2."""
    axes = [(0, 0, 1), (0, 1, 0), (0, 1, 0), (0, 0, 1), (0, 1, 0), (0, 0, 1)]
    points = [(0, 0, 0), (0, 0, 0.267), (0.28949, 0, 0.267), (0.36699, 0, 0.267), (0.36699, 0, -0.0755),
              (0.44299, 0, -0.0755)]  # fmt: skip
    arm = arm_of(*np.array([axes * np.array([[1], [1], [1], [-1], [1], [-1]]), points], float), limit=np.pi)
    q = np.array([-3.0790463, -0.8479400, -2.6475529, 0.9589076, -1.4209480, 1.2732965])
    target = pinocchio_tip(arm, q)
    solution = solve(arm, target, np.zeros(6), every())
    assert solution.completeness == 'proof'
    assert len(solution.solutions) == 16
    assert_all_right(arm, target, solution.solutions)
    assert np.diff(np.sort(solution.solutions[:, 1])).min() < 1e-3


def test_solutions_that_share_the_angle_of_the_resultant_are_told_apart():
    """With axes 2 and 3 parallel, counted from the tip, each angle of joint 5 belongs to both choices of the elbow."""
    rng = np.random.default_rng(15)
    points = [(0, 0, 0), (0, 0, 0), (0.71, 0, 0), (0.71, 0, 0), (1.25, 0, 0), (1.25, 0.15, 0)]
    arm = arm_of(np.array([(0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0)], float),
                 np.array(points, float))  # fmt: skip
    proven = 0
    for q in random_configurations(arm, rng, 20):
        target = pinocchio_tip(arm, q)
        solution = solve(arm, target, np.zeros(6), every())
        proven += solution.completeness == 'proof'
        assert_all_right(arm, target, solution.solutions)
        assert apart(solution.solutions, q).min() < SAME
        if solution.completeness == 'proof':
            for known in found_by_chance(arm, target, rng, 20):
                assert apart(solution.solutions, known).min() < SAME
    assert proven >= 17


def test_axes_that_are_off_by_the_digits_of_a_urdf_are_exact():
    rng = np.random.default_rng(6)
    arm = arm_of(*made_up('wrist', rng, off=4e-6))
    for q in random_configurations(arm, rng, 10):
        solution = solve(arm, pinocchio_tip(arm, q), np.zeros(6), every())
        assert solution.completeness == 'proof'
        assert apart(solution.solutions, q).min() < SAME


@pytest.mark.parametrize(
    ('kind', 'expected'),
    [('wrist', (WRIST, False)), ('wrist first', (WRIST, True)), ('parallel', (PARALLEL, False)),
     ('parallel first', (PARALLEL, True))],
)  # fmt: skip
def test_the_kind_of_an_arm_is_told_from_its_axes(kind, expected):
    rng = np.random.default_rng(7)
    for off in (0.0, 3e-3):
        lines = np.hstack([np.array(part) for part in made_up(kind, rng, off)])
        *found, miss = kind_of(lines)
        assert tuple(found) == expected
        assert miss <= 3.0 * off + 1e-12


@pytest.mark.parametrize('robot', ['ur5', 'puma560'])
def test_nearest_is_the_first_of_all_in_the_same_metric(robot):
    arm, rng = get_arm(robot), np.random.default_rng(8)
    weights = (3.0, 1.0, 1.0, 0.5, 1.0, 2.0)
    for target, seed in zip(reachable_poses(arm, rng, 20), random_configurations(arm, rng, 20)):
        all_of_them = solve(arm, target, seed, every(joint_weights=weights))
        ranks = np.linalg.norm(weights * (all_of_them.solutions - seed), axis=1)
        assert (np.diff(ranks) >= 0.0).all()
        nearest = solve(arm, target, seed, SolveOptions(choice='nearest', deadline=0.0, joint_weights=weights))
        assert nearest.completeness == 'proof'
        np.testing.assert_allclose(nearest.q, all_of_them.q, atol=1e-9)


@pytest.mark.parametrize('method', ['transpose', 'pinv', 'dls', 'adaptive_dls', 'sdls'])
def test_every_method_lists_the_same_branches(method):
    arm, rng = get_arm('ur5'), np.random.default_rng(9)
    for target in reachable_poses(arm, rng, 10):
        expected = solve(arm, target, options=every()).solutions
        found = solve(arm, target, options=every(method=method)).solutions
        assert len(found) == len(expected)
        assert all(apart(found, q).min() < SAME for q in expected)


@pytest.mark.parametrize('robot', ['ur5', 'puma560'])
def test_a_singular_wrist_is_said_to_have_a_family_of_solutions_and_the_seed_stays(robot):
    arm, rng = get_arm(robot), np.random.default_rng(10)
    for q in random_configurations(arm, rng, 10):
        q[4] = 0.0
        target = pinocchio_tip(arm, q)
        solution = solve(arm, target, q, SolveOptions(choice='nearest', deadline=0.0))
        assert solution.completeness == 'family'
        assert apart(solution.q, q) < 1e-6
        listed = solve(arm, target, q, every())
        assert listed.completeness == 'family'
        assert_all_right(arm, target, listed.solutions)


def test_two_branches_that_meet_are_one_solution():
    arm, rng = get_arm('ur5'), np.random.default_rng(11)
    for q in random_configurations(arm, rng, 10):
        q[2] = 0.0  # the elbow is stretched, where both choices of it meet
        target = pinocchio_tip(arm, q)
        solution = solve(arm, target, q, every())
        assert_all_right(arm, target, solution.solutions)
        assert (apart(solution.solutions, q) < SAME).sum() == 1


def test_a_solution_at_a_limit_is_listed():
    arm, rng = get_arm('puma560'), np.random.default_rng(12)
    for q in random_configurations(arm, rng, 20):
        k = rng.integers(3)
        q[k] = arm.upper[k] if rng.random() < 0.5 else arm.lower[k]
        solution = solve(arm, pinocchio_tip(arm, q), q, every())
        assert apart(solution.solutions, q).min() < SAME


def test_without_limits_branches_outside_of_them_are_listed_too():
    arm = get_arm('puma560')
    q = np.array([0.5, -2.0, 0.3, 0.4, 0.8, 0.2])
    target = pinocchio_tip(arm, q)
    inside, outside = (solve(arm, target, q, every(respect_limits=respect)) for respect in (True, False))
    assert len(inside.solutions) < len(outside.solutions) == 8
    assert {inside.completeness, outside.completeness} == {'proof'}


def test_what_the_closed_form_does_not_cover_is_complete_by_exhaustion_alone():
    arm = get_arm('ur5')
    target = pinocchio_tip(arm, [0.3, -1.2, 1.4, -0.5, 0.9, 0.2])
    assert solve(arm, target, options=every(task_weights=(1, 1, 1, 1, 1, 0))).completeness != 'proof'
    assert solve(arm, target, options=every(task_tolerances=(0, 0, 1e-3, 0, 0, 0))).completeness != 'proof'
    assert solve(arm, target, options=every(position_tolerance=0.1)).completeness != 'proof'
    seven = get_arm('panda')
    nearest = SolveOptions(choice='nearest', deadline=0.0)
    assert solve(seven, pinocchio_tip(seven, seven.home), options=nearest).completeness == 'exhaustion'


def test_nothing_is_known_of_other_solutions_if_the_first_one_will_do():
    arm = get_arm('ur5')
    target = pinocchio_tip(arm, [0.3, -1.2, 1.4, -0.5, 0.9, 0.2])
    assert solve(arm, target).completeness == ''
    assert solve(arm, target, options=every(max_attempts=5)).completeness == ''


def test_a_jump_that_no_branch_avoids_is_proven():
    arm = get_arm('ur5')
    q = np.array([0.3, -1.2, 1.4, -0.5, 0.9, 0.2])
    solution = solve(arm, pinocchio_tip(arm, q), q + 0.3, SolveOptions(max_joint_jump=0.2, deadline=0.0))
    assert (solution.status, solution.completeness) == (Status.JOINT_JUMP, 'proof')


def test_branches_that_touch_are_left_out_and_the_rest_is_complete():
    arm, rng = load_arm(UR5[0], tip=UR5[2], srdf=UR5[1]), np.random.default_rng(13)
    world, left_out, none_left = World(floor=-0.1), 0, 0
    for q in rng.uniform(-3.0, 3.0, (30, 6)):
        target = pinocchio_tip(arm, q)
        free = solve(arm, target, q, every(avoid_collisions=False)).solutions
        clear = [branch for branch in free if arm.contacts.is_clear(branch, 0.0, world)]
        solution = solve(arm, target, q, every(), world=world)
        left_out += len(free) - len(clear)
        none_left += not clear
        assert solution.completeness == 'proof'
        assert solution.converged == bool(clear)
        if clear:
            assert len(solution.solutions) == len(clear)
            assert all(apart(solution.solutions, branch).min() < SAME for branch in clear)
        else:
            assert solution.status is Status.COLLISION
    assert left_out > 10 and none_left > 0
