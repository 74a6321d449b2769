"""Whole paths: followed on their line within all limits, the best of all ways, and honest where they break."""

from __future__ import annotations

import itertools
import time
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from numerics import get_arm, pinocchio_tip
from scipy.interpolate import BPoly

from ros_ik_pkg.ik import (
    ArgumentError,
    BreakReason,
    OptionError,
    PathOptions,
    SolveOptions,
    solve,
    solve_path,
)

CALM = {'deadline': 0.0}
UR5_START = np.array([0.3, -1.2, 1.5, 0.2, 0.9, 0.1])
PANDA_START = np.array([0.0, -0.5, 0.0, -1.9, 0.0, 1.6, 0.7])


@pytest.fixture(scope='module')
def ur5():
    return get_arm('ur5')


@pytest.fixture(scope='module')
def panda():
    return get_arm('panda')


def moved(pose, x=0.0, y=0.0, z=0.0, turn=(0.0, 0.0, 0.0)):
    out = pose.copy()
    out[:3, 3] += (x, y, z)
    out[:3, :3] = pin.exp3(np.array(turn, dtype=float)) @ out[:3, :3]
    return out


def rectangle(arm, start):
    home = arm.forward(start)
    corners = [moved(home, y=0.2), moved(home, x=0.1, y=0.2, turn=(0.2, 0.1, 0.0)), moved(home, x=0.1, z=-0.1)]
    return [home, *corners, home]


def motion_of(solution):
    """The motion as joint trajectory controllers see it, by SciPy; and a grid ten times as fine as the rows."""
    rows = np.stack([solution.q, solution.velocities, solution.accelerations], axis=1)
    count = len(solution.q)
    grid = np.interp(np.arange(10 * count - 9) / 10.0, np.arange(count), solution.times)
    return BPoly.from_derivatives(solution.times, rows), grid


def distance_from_line(arm, solution, q, row):
    """Distances of the tip from the line between the poses of two rows, by Pinocchio's model [m, rad]."""
    a, b = solution.base_from_tip[row], solution.base_from_tip[row + 1]
    tip = pinocchio_tip(arm, q)
    along = b[:3, 3] - a[:3, 3]
    length = along @ along
    turn, turned = pin.log3(b[:3, :3] @ a[:3, :3].T), pin.log3(tip[:3, :3] @ a[:3, :3].T)
    fraction = along @ (tip[:3, 3] - a[:3, 3]) / length if length > 1e-12 else turn @ turned / (turn @ turn)
    fraction = np.clip(fraction, 0.0, 1.0)
    rotation = pin.exp3(fraction * turn) @ a[:3, :3]
    return np.linalg.norm(a[:3, 3] + fraction * along - tip[:3, 3]), np.linalg.norm(pin.log3(rotation @ tip[:3, :3].T))


def assert_fit_for_a_robot(arm, solution, path):
    """Judge what would be published: limits of position, velocity, acceleration, and the line of the tip."""
    motion, grid = motion_of(solution)
    q = motion(grid)
    assert (q >= arm.lower - 1e-9).all() and (q <= arm.upper + 1e-9).all()
    velocity = np.where(np.isfinite(arm.velocity_limits), arm.velocity_limits, 1.0)
    acceleration = np.array(path.acceleration_limits or 2.0 * velocity)
    assert (np.abs(motion(grid, 1)) <= velocity * (1.0 + 1e-6)).all()
    assert (np.abs(motion(grid, 2)) <= acceleration * (1.0 + 1e-6)).all()
    assert (np.diff(solution.times) > 0.0).all()
    for k in range(0, len(grid) - 1):
        if k // 10 in solution.reconfigurations:
            continue
        away, turned = distance_from_line(arm, solution, q[k], k // 10)
        assert away <= path.tolerance and turned <= path.angle_tolerance


@pytest.mark.parametrize(('name', 'start'), [('ur5', UR5_START), ('panda', PANDA_START)])
def test_the_tip_stays_on_its_line_and_every_limit_is_kept(name, start):
    arm, path = get_arm(name), PathOptions(**CALM)
    poses = rectangle(arm, start)
    solution = solve_path(arm, poses, start, path=path)
    assert solution.complete and not solution.breaks and not solution.reconfigurations
    assert solution.place[0] == 0.0 and solution.place[-1] == 4.0
    for k in range(5):
        row = int(np.argmin(np.abs(solution.place - k)))
        np.testing.assert_allclose(pinocchio_tip(arm, solution.q[row]), poses[k], atol=1e-8)
    assert_fit_for_a_robot(arm, solution, path)


def test_the_same_path_has_the_same_answer(panda):
    poses = rectangle(panda, PANDA_START)
    one, other = (solve_path(panda, poses, PANDA_START, path=PathOptions(**CALM)) for _ in range(2))
    np.testing.assert_array_equal(one.q, other.q)
    np.testing.assert_array_equal(one.times, other.times)


def test_the_path_begins_at_the_solution_nearest_the_seed(ur5):
    start = np.append(UR5_START[:5], 1.1)
    poses = rectangle(ur5, start)
    for turns in (0.0, -2.0 * np.pi):
        seed = np.append(start[:5], start[5] + turns)
        solution = solve_path(ur5, poses, seed, path=PathOptions(**CALM))
        np.testing.assert_allclose(solution.q[0], seed, atol=1e-6)


def brute_force(arm, poses, links):
    """Fewest reconfigurations through all solutions of all poses: NumPy, joint steps below `links` [rad] alone."""
    options = SolveOptions(choice='all', deadline=0.0)
    layers = [solve(arm, pose, options=options).solutions for pose in poses]
    fewest = np.zeros(len(layers[0]))
    for before, after in itertools.pairwise(layers):
        gaps = after[:, None, :] - before[None, :, :]
        gaps -= 2.0 * np.pi * np.round(gaps / (2.0 * np.pi)) * (arm.wraps != 0)
        linked = np.abs(gaps).max(axis=2) < links
        cost = np.where(linked, fewest[None, :], np.inf).min(axis=1)
        fewest = np.minimum(cost, cost.min() + 1.0)
    return fewest.min()


@pytest.mark.parametrize('seed', range(6))
def test_no_other_way_has_fewer_reconfigurations(seed):
    arm, random = get_arm('puma560'), np.random.default_rng(seed)
    for _ in range(100):  # lines between two poses that can be reached all the way
        a, b = (arm.forward(random.uniform(arm.lower, arm.upper)) for _ in range(2))
        b[:3, 3] = a[:3, 3] + 0.3 * (b[:3, 3] - a[:3, 3])
        solution = solve_path(arm, [a, b], path=PathOptions(max_reconfigurations=20, **CALM))
        if solution.complete and (solution.reconfigurations or seed % 2):
            break
    fine = solve_path(arm, [a, b], path=PathOptions(max_reconfigurations=20, step=0.002, angle_step=0.02, **CALM))
    rows = np.concatenate([[True], np.diff(fine.place) > 0.0])
    # Wrists of the Puma turn round: whole turns may cost a reconfiguration that the judge does not see.
    free = brute_force(arm, fine.base_from_tip[rows], 0.3)
    assert len(solution.reconfigurations) == len(fine.reconfigurations) >= free
    if not np.any(arm.wraps):
        assert len(fine.reconfigurations) == free


def test_a_reconfiguration_carries_on_only_if_it_is_allowed():
    arm = get_arm('puma560')
    random = np.random.default_rng(0)
    while True:
        a, b = (arm.forward(random.uniform(arm.lower, arm.upper)) for _ in range(2))
        b[:3, 3] = a[:3, 3] + 0.3 * (b[:3, 3] - a[:3, 3])
        path = PathOptions(max_reconfigurations=20, **CALM)
        whole = solve_path(arm, [a, b], path=path)
        if whole.complete and whole.reconfigurations:
            break
    partial = solve_path(arm, [a, b], path=PathOptions(**CALM))
    assert not partial.complete and 0.0 < partial.place[-1] < 1.0 and len(partial.breaks) == 1
    assert partial.breaks[0].reason in (BreakReason.LIMIT, BreakReason.SINGULARITY, BreakReason.BRANCH)
    assert 'from pose 0 to 1' in partial.breaks[0].text
    for row in whole.reconfigurations:
        np.testing.assert_allclose(whole.base_from_tip[row], whole.base_from_tip[row + 1])
        assert np.abs(whole.q[row + 1] - whole.q[row]).max() > 0.1
        assert row in whole.stops and row + 1 in whole.stops
    assert_fit_for_a_robot(arm, whole, path)


def test_a_pose_out_of_reach_breaks_the_path_before_it(ur5):
    home = ur5.forward(UR5_START)
    solution = solve_path(ur5, [home, moved(home, y=0.1), moved(home, z=5.0), home], UR5_START,
                          path=PathOptions(step=0.05, **CALM))
    assert not solution.complete
    found = solution.breaks[0]
    assert found.reason == BreakReason.REACH and 1.0 < found.place < 2.0 and 'from pose 1 to 2' in found.text
    assert solution.place[-1] < found.place
    assert_fit_for_a_robot(ur5, solution, PathOptions())


def test_a_path_whose_first_pose_is_out_of_reach_has_no_rows(ur5):
    far = moved(ur5.forward(UR5_START), z=5.0)
    solution = solve_path(ur5, [far, moved(far, z=0.1)], path=PathOptions(**CALM))
    assert not solution.complete and solution.q.shape == (0, 6) and len(solution.times) == 0
    assert solution.breaks[0].reason == BreakReason.REACH and solution.breaks[0].text.startswith('pose 0')


def turning(arm, start, angle):
    """Poses between which the tip turns about its own axis, which the last joint of the UR5 does alone."""
    home = arm.forward(start)
    return [moved(home, turn=home[:3, 2] * a) for a in np.arange(0.0, angle + 1.0, 2.0)]


def test_a_path_begins_a_turn_back_if_the_last_joint_would_come_to_its_limit(ur5):
    solution = solve_path(ur5, turning(ur5, UR5_START, 10.0), UR5_START, path=PathOptions(**CALM))
    assert solution.complete and not solution.reconfigurations
    assert (np.abs(solution.q) <= 2.0 * np.pi).all() and np.abs(np.diff(solution.q[:, 5]).sum()) == pytest.approx(10.0)


def test_a_joint_limit_is_named_and_turning_back_is_one_reconfiguration(ur5):
    poses = turning(ur5, UR5_START, 14.0)
    partial = solve_path(ur5, poses, UR5_START, path=PathOptions(**CALM))
    assert not partial.complete and partial.breaks[0].reason == BreakReason.LIMIT
    assert 'wrist_3_joint' in partial.breaks[0].text and 6.0 < partial.breaks[0].place < 7.0
    whole = solve_path(ur5, poses, UR5_START, path=PathOptions(max_reconfigurations=5, **CALM))
    assert whole.complete and len(whole.reconfigurations) == 1 and whole.times[-1] < 60.0
    assert_fit_for_a_robot(ur5, whole, PathOptions())


def test_between_reconfigurations_and_the_path_the_joints_rest_and_the_stamps_are_kept_from_then_on(ur5):
    poses = turning(ur5, UR5_START, 14.0)
    stamps = 4.0 * np.arange(len(poses))
    whole = solve_path(ur5, poses, UR5_START, path=PathOptions(max_reconfigurations=5, **CALM), stamps=stamps)
    (row,) = whole.reconfigurations
    for motion in (whole.velocities, whole.accelerations):
        assert not motion[[row, row + 1]].any()
    way = np.abs(whole.q[row + 1] - whole.q[row])
    velocity, acceleration = ur5.velocity_limits, ur5.velocity_limits / 0.5
    # From rest to rest along a polynomial of the fifth degree, as fast as the joint that takes longest allows.
    shortest = np.maximum(1.875 * way / velocity, np.sqrt(10.0 / np.sqrt(3.0) * way / acceleration)).max()
    took = np.diff(whole.times)[row]
    assert shortest <= took <= 1.02 * shortest
    at = np.array([whole.times[np.argmin(np.abs(whole.place - k))] for k in range(len(poses))])
    late = at - stamps
    after = np.arange(len(poses)) > whole.place[row]
    assert (late >= -1e-9).all() and (late[~after] < 1.0).all()
    assert (late[after] >= took).all() and (late[after] < took + 2.5).all()


def test_a_wrist_that_turns_half_round_between_two_poses_is_followed():
    arm, tilt = get_arm('puma560'), np.hypot(0.1, 0.002)
    angle = np.arctan2(0.002, 0.1)
    start, end = (np.array([0.3, -0.5, 0.4, turn, tilt, -turn]) for turn in (angle, np.pi - angle))
    path = PathOptions(step=10.0, angle_step=3.0, **CALM)
    solution = solve_path(arm, [arm.forward(start), arm.forward(end)], start, path=path)
    assert solution.complete and not solution.reconfigurations
    np.testing.assert_allclose(solution.q[-1], end, atol=1e-6)
    assert_fit_for_a_robot(arm, solution, path)


def test_the_tip_keeps_its_speed_but_for_its_ramps(ur5):
    home = ur5.forward(UR5_START)
    path = PathOptions(tool_speed=0.05, **CALM)
    solution = solve_path(ur5, [home, moved(home, y=0.2)], UR5_START, path=path)
    speeds = np.linalg.norm(np.diff(solution.base_from_tip[:, :3, 3], axis=0), axis=1) / np.diff(solution.times)
    assert speeds.max() <= 0.05 * (1.0 + 1e-6)
    assert (speeds[5:-5] > 0.98 * 0.05).all() and not solution.slowed.any()


def through_wrist_singularity(arm):
    """A line on which the wrist of the UR5 comes near its singularity."""
    q = np.array([0.3, -1.2, 1.5, 0.2, 0.02, 0.1])
    return q, arm.forward(q)


def test_near_a_singularity_the_tip_slows_down_and_the_result_says_where(ur5):
    q, pose = through_wrist_singularity(ur5)
    poses = [moved(pose, x=-0.1, y=-0.03), moved(pose, x=0.1, y=0.03)]
    path = PathOptions(tool_speed=1.0, **CALM)
    solution = solve_path(ur5, poses, q, path=path)
    assert solution.complete and solution.slowed.any()
    slow = np.flatnonzero(solution.slowed)
    assert np.abs(solution.place[slow] - solution.place[np.argmin(solution.sigma_min)]).min() < 0.05
    assert_fit_for_a_robot(ur5, solution, path)


def test_where_the_speed_is_to_be_kept_the_path_breaks_for_velocity(ur5):
    q, pose = through_wrist_singularity(ur5)
    poses = [moved(pose, x=-0.1, y=-0.03), moved(pose, x=0.1, y=0.03)]
    solution = solve_path(ur5, poses, q, path=PathOptions(tool_speed=20.0, keep_speed=True, **CALM))
    assert not solution.complete and solution.breaks[0].reason == BreakReason.VELOCITY
    assert any(name in solution.breaks[0].text for name in ur5.joint_names)


def test_the_tip_is_never_early_for_its_stamps(ur5):
    home = ur5.forward(UR5_START)
    poses = [home, moved(home, y=0.05), moved(home, y=0.2)]
    stamps = [10.0, 14.0, 17.0]
    solution = solve_path(ur5, poses, UR5_START, path=PathOptions(**CALM), stamps=stamps)
    at = np.interp([1.0, 2.0], solution.place, solution.times)
    assert (at >= [4.0, 7.0]).all() and (at <= [4.5, 7.8]).all()


def test_joints_to_spare_move_less_than_on_one_branch(panda):
    poses = rectangle(panda, PANDA_START)
    solution = solve_path(panda, poses, PANDA_START, path=PathOptions(**CALM))
    q, travel = PANDA_START, 0.0
    for pose in solution.base_from_tip:
        after = solve(panda, pose, q, SolveOptions(max_attempts=1, deadline=0.0)).q
        travel += np.linalg.norm(after - q)
        q = after
    assert solution.length < 1.001 * travel


def test_a_free_roll_is_used(ur5):
    poses = rectangle(ur5, UR5_START)
    free = SolveOptions(task_weights=(1, 1, 1, 1, 1, 0), task_frame='tip')
    loose = solve_path(ur5, poses, UR5_START, free, PathOptions(**CALM))
    tight = solve_path(ur5, poses, UR5_START, path=PathOptions(**CALM))
    assert loose.complete and loose.length < tight.length
    for q, wanted in zip(loose.q, loose.base_from_tip):
        tip = pinocchio_tip(ur5, q)
        np.testing.assert_allclose(tip[:3, 3], wanted[:3, 3], atol=1e-5)
        np.testing.assert_allclose(tip[:3, 2], wanted[:3, 2], atol=1e-4)


def test_the_axes_of_a_free_row_are_those_of_its_frame(ur5):
    end = moved(ur5.forward(UR5_START), 0.05, 0.1, 0.05, (0.3, 0.2, 0.4))
    for frame in ('base', 'tip'):
        options = SolveOptions(task_weights=(1, 1, 0, 1, 1, 1), task_frame=frame)
        solution = solve_path(ur5, [ur5.forward(UR5_START), end], UR5_START, options, PathOptions(**CALM))
        assert solution.complete and solution.stops == (0, len(solution.q) - 1)
        for q, wanted in zip(solution.q, solution.base_from_tip):
            tip = pinocchio_tip(ur5, q)
            away = wanted[:3, 3] - tip[:3, 3]
            away = away if frame == 'base' else wanted[:3, :3].T @ away
            np.testing.assert_allclose(away[:2], 0.0, atol=1e-5)
            np.testing.assert_allclose(tip[:3, :3], wanted[:3, :3], atol=1e-4)


def test_acceleration_limits_of_the_robot_are_kept(ur5):
    slow = replace(ur5, acceleration_limits=np.array([0.5, np.inf, 0.5, 0.5, 0.5, 0.5]))
    path = PathOptions(acceleration_limits=(9.0, 0.3, 9.0, 9.0, 9.0, 9.0), **CALM)
    solution = solve_path(slow, rectangle(slow, UR5_START), UR5_START, path=path)
    motion, grid = motion_of(solution)
    most = np.array([0.5, 0.3, 0.5, 0.5, 0.5, 0.5]) * (1.0 + 1e-6)
    assert solution.complete and (np.abs(motion(grid, 2)) <= most).all()


def test_a_joint_that_turns_back_near_its_limit_does_not_swing_beyond_it(ur5):
    home, coarse = ur5.forward(UR5_START), PathOptions(step=0.05, tolerance=1e-3, **CALM)
    poses = [moved(home, y=-0.15), home, moved(home, y=0.15)]
    free = solve_path(ur5, poses, UR5_START, path=coarse)
    swung = free.q[:, 3].min() - free.at(np.linspace(0.0, free.times[-1], 20000))[:, 3].min()
    assert swung > 1e-4
    lower = ur5.lower.copy()
    lower[3] = free.q[:, 3].min() - 0.3 * swung
    solution = solve_path(replace(ur5, lower=lower), poses, UR5_START, path=coarse)
    motion, _ = motion_of(solution)
    assert solution.complete and len(solution.stops) > len(free.stops)
    assert (motion(np.linspace(0.0, solution.times[-1], 20000)) >= lower - 1e-12).all()


def test_a_free_turn_about_the_vertical_of_the_base_is_used(ur5):
    poses = rectangle(ur5, UR5_START)
    free = SolveOptions(task_weights=(1, 1, 1, 1, 1, 0), task_frame='base')
    loose = solve_path(ur5, poses, UR5_START, free, PathOptions(**CALM))
    tight = solve_path(ur5, poses, UR5_START, path=PathOptions(**CALM))
    assert loose.complete and loose.length < tight.length
    turns = []
    for q, wanted in zip(loose.q, loose.base_from_tip):
        tip = pinocchio_tip(ur5, q)
        np.testing.assert_allclose(tip[:3, 3], wanted[:3, 3], atol=1e-5)
        turns.append(pin.log3(wanted[:3, :3] @ tip[:3, :3].T))
    np.testing.assert_allclose(np.array(turns)[:, :2], 0.0, atol=1e-4)
    assert np.abs(turns).max() > 0.01


def test_what_is_not_clear_is_left_out(ur5):
    poses = rectangle(ur5, UR5_START)

    def elbow_down(q):
        return q[:, 2] < 0.0

    solution = solve_path(ur5, poses, UR5_START, path=PathOptions(**CALM), clear=elbow_down)
    assert solution.complete and (solution.q[:, 2] < 0.0).all()
    nowhere = solve_path(ur5, poses, path=PathOptions(**CALM), clear=lambda q: np.zeros(len(q), bool))
    assert not nowhere.complete and nowhere.breaks[0].reason == BreakReason.CONTACT and len(nowhere.q) == 0


def test_a_deadline_stops_a_long_path_and_says_so(ur5):
    home = ur5.forward(UR5_START)
    began = time.monotonic()
    solution = solve_path(ur5, [home, moved(home, y=0.2)], UR5_START, path=PathOptions(step=1e-5, deadline=0.01))
    assert not solution.complete and solution.breaks[0].reason == BreakReason.DEADLINE
    assert time.monotonic() - began < 60.0


def test_progress_counts_every_sample(ur5):
    home, seen = ur5.forward(UR5_START), []
    solution = solve_path(ur5, [home, moved(home, y=0.2)], UR5_START, path=PathOptions(step=1e-4, **CALM),
                          progress=seen.append)
    assert solution.complete and sum(seen) == 2001 and len(seen) > 1


@pytest.mark.parametrize(
    ('arguments', 'text'),
    [
        ({'seed': [0.0, 1.0]}, 'seed'),
        ({'seed': [np.nan] * 6}, 'seed'),
        ({'options': SolveOptions(posture=(0.0, 1.0))}, 'posture'),
        ({'path': PathOptions(acceleration_limits=(1.0, 2.0))}, 'acceleration_limits'),
        ({'stamps': [1.0, 0.0]}, 'stamps run back: pose 1'),
        ({'vias': [5]}, 'via 5'),
    ],
)
def test_arguments_that_make_no_path_are_refused(ur5, arguments, text):
    home = ur5.forward(UR5_START)
    with pytest.raises(ArgumentError, match=text):
        solve_path(ur5, [home, moved(home, y=0.1)], **arguments)


@pytest.mark.parametrize(('values', 'text'), [({'step': 0.0}, 'path.step'), ({'tol': 1.0}, 'tolerance')])
def test_path_options_out_of_range_are_refused_by_name(values, text):
    with pytest.raises(OptionError, match=text):
        PathOptions(**values)
