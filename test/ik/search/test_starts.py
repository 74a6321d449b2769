"""Where searches start: well spread within the limits, nearest to the target first, the same everywhere."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from chains import chain, random_urdf
from numerics import get_arm, make_workspace, pinocchio_tip, reachable_poses

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ik.kernel.data_layout import Task
from ros_ik_pkg.ik.search.starts import COUNT, nearest_start, next_start, r_sequence, score_starts

ROBOTS = ('iiwa14', 'panda', 'planar3r', 'puma560', 'stanford', 'ur5')
SINGLE = 2e-6  # the rounding of single precision, a few metres and turns


@pytest.mark.parametrize('dimensions', [1, 2, 3, 6, 7, 12])
def test_the_sequence_fills_the_unit_cube_evenly(dimensions):
    points = r_sequence(COUNT, dimensions)
    assert points.shape == (COUNT, dimensions)
    assert np.all((points >= 0.0) & (points < 1.0))
    for column in np.sort(points, axis=0).T:
        assert np.max(np.diff(np.concatenate([[0.0], column, [1.0]]))) < 0.04  # no part of a side is left out
        assert np.all(np.histogram(column, 8, (0.0, 1.0))[0] > 0.7 * COUNT / 8)


@pytest.mark.parametrize('dimensions', [2, 3, 6])
def test_no_two_points_are_close(dimensions):
    points = r_sequence(200, dimensions)
    gaps = np.linalg.norm(points[:, None] - points[None], axis=2) + 10.0 * np.eye(200)
    spacing = 200.0 ** (-1.0 / dimensions)  # of a regular grid
    assert np.min(gaps) > 0.3 * spacing


@pytest.mark.parametrize('robot', ROBOTS)
def test_starts_are_within_the_limits(robot):
    arm = get_arm(robot)
    q = arm.starts[: arm.n].T
    assert q.shape == (COUNT, arm.n)
    assert np.all((arm.lower - SINGLE <= q) & (q <= arm.upper + SINGLE))


def test_a_joint_without_end_starts_within_a_turn_about_zero():
    arm = load_arm(chain(('j1', 'continuous', {}), ('j2', 'prismatic', {'lower': -0.1, 'upper': 0.3})))
    q = arm.starts[:2].T
    assert np.all(np.abs(q[:, 0]) <= np.pi + SINGLE)
    assert np.min(q[:, 0]) < -3.0 and np.max(q[:, 0]) > 3.0
    assert np.all((q[:, 1] >= -0.1) & (q[:, 1] <= 0.3))


def test_a_joint_of_several_turns_starts_within_one():
    arm = get_arm('ur5')
    q = arm.starts[0]
    assert np.ptp(arm.upper[0] - arm.lower[0] + q) <= 2.0 * np.pi + SINGLE


@pytest.mark.parametrize('robot', ROBOTS)
def test_the_pose_of_each_start_is_known(robot):
    arm = get_arm(robot)
    for column in arm.starts.T[::50].astype(float):
        pose = pinocchio_tip(arm, column[: arm.n])
        np.testing.assert_allclose(column[arm.n : arm.n + 3], pose[:3, 3], rtol=0, atol=SINGLE)
        w, x, y, z = column[arm.n + 3 :]
        np.testing.assert_allclose(pin.Quaternion(w, x, y, z).matrix(), pose[:3, :3], rtol=0, atol=2 * SINGLE)


def order(arm, target, count, weights=(1, 1, 1, 1, 1, 1)):
    """Starts (count, n) in the order in which a search takes them."""
    work = make_workspace(len(arm.prismatic), arm.n, COUNT)
    task = Task(
        tuple(target[:3, :3].ravel()), tuple(target[:3, 3]), np.array(weights, dtype=float), np.zeros(6),
        0.0, 0.0, 0.0, 0.0,
    )  # fmt: skip
    score_starts(arm.starts, task, 1.0, work.scores)
    taken = []
    for attempt in range(1, count + 1):
        next_start(arm.starts, attempt, nearest_start(work.scores), work)
        taken.append(work.q.copy())
    return np.array(taken)


def distances(arm, target, configurations):
    """Distance of poses, with Pinocchio: 4 |dp|^2 and 2 (1 - cos(angle / 2))."""
    poses = [pinocchio_tip(arm, q) for q in configurations]
    angles = np.array([np.linalg.norm(pin.log3(target[:3, :3] @ pose[:3, :3].T)) for pose in poses])
    return np.array([4.0 * np.sum((target[:3, 3] - pose[:3, 3]) ** 2) for pose in poses]), 2.0 * (
        1.0 - np.cos(angles / 2)
    )


@pytest.mark.parametrize('robot', ['puma560', 'panda'])
def test_the_start_whose_pose_is_nearest_comes_first(robot):
    arm = get_arm(robot)
    target = reachable_poses(arm, np.random.default_rng(1), 1)[0]
    every = np.sort(np.sum(distances(arm, target, arm.starts[: arm.n].T.astype(float)), axis=0))
    first = np.sum(distances(arm, target, order(arm, target, 20)), axis=0)
    np.testing.assert_allclose(first, every[:20], rtol=0, atol=1e-5)


@pytest.mark.parametrize(('weights', 'part'), [((1, 1, 1, 0, 0, 0), 0), ((0, 0, 0, 1, 1, 1), 1)])
def test_rows_that_are_dropped_do_not_count(weights, part):
    arm = get_arm('puma560')
    target = reachable_poses(arm, np.random.default_rng(2), 1)[0]
    every = np.sort(distances(arm, target, arm.starts[: arm.n].T.astype(float))[part])
    first = distances(arm, target, order(arm, target, 20, weights))[part]
    np.testing.assert_allclose(first, every[:20], rtol=0, atol=1e-5)


def test_no_start_is_taken_twice_and_after_all_of_them_come_new_ones_within_the_limits():
    arm = get_arm('puma560')
    target = reachable_poses(arm, np.random.default_rng(3), 1)[0]
    taken = order(arm, target, COUNT + 300)
    assert len(np.unique(taken[:COUNT], axis=0)) == COUNT
    assert len(np.unique(taken, axis=0)) >= COUNT + 290
    assert np.all((arm.lower - SINGLE <= taken) & (taken <= arm.upper + SINGLE))


def test_two_arms_of_one_source_have_the_same_starts():
    text = random_urdf(np.random.default_rng(4), joints=7)
    np.testing.assert_array_equal(load_arm(text, 'base', 'tip').starts, load_arm(text, 'base', 'tip').starts)
