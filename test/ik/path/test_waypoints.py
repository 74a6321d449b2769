"""Samples of a path: straight lines, arcs, and what is refused."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from ros_ik_pkg.ik import ArgumentError
from ros_ik_pkg.ik.path.waypoints import read_poses, read_stamps, sample_arcs, sample_path


def pose(x=0.0, y=0.0, z=0.0, turn=(0.0, 0.0, 0.0)):
    return pin.SE3(pin.exp3(np.array(turn, dtype=float)), np.array([x, y, z])).homogeneous


def sample(poses, vias=(), step=0.01, angle_step=0.1, tolerance=1e-4, stamped=False):
    return sample_path(read_poses(poses), vias, step, angle_step, tolerance, stamped)


def test_samples_of_a_line_are_evenly_spaced_and_end_at_the_poses():
    samples = sample([pose(), pose(x=0.095), pose(x=0.095, y=0.02)])
    steps = np.linalg.norm(np.diff(samples.poses[:, :3, 3], axis=0), axis=1)
    np.testing.assert_allclose(steps[:10], 0.0095, atol=1e-12)
    assert len(samples.poses) == 1 + 10 + 2
    np.testing.assert_array_equal(samples.poses[10], pose(x=0.095))
    np.testing.assert_allclose(samples.place[[0, 5, 10, 11, 12]], [0.0, 0.5, 1.0, 1.5, 2.0])


@pytest.mark.parametrize('angle', [0.01, 1.0, 2.5, 3.1])
def test_orientations_between_two_poses_are_those_of_slerp(angle):
    turn = angle * np.array([0.6, 0.0, 0.8])
    start = pose(turn=(0.3, -1.0, 0.2))
    end = start.copy()
    end[:3, :3] = pin.exp3(turn) @ start[:3, :3]
    samples = sample([start, end])
    for at, found in zip(samples.place, samples.poses):
        expected = pin.exp3(at * turn) @ start[:3, :3]
        np.testing.assert_allclose(found[:3, :3], expected, atol=1e-9)
    assert len(samples.poses) == 1 + np.ceil(angle / 0.1)


def test_an_arc_keeps_its_radius_and_passes_the_via():
    centre, radius = np.array([0.3, 0.1, 0.2]), 0.2
    at = [centre + radius * np.array([np.cos(t), np.sin(t), 0.0]) for t in (0.0, 1.0, 4.0)]
    samples = sample([pose(*p) for p in at], vias=[1], step=0.02)
    away = samples.poses[:, :3, 3] - centre
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), radius, atol=1e-12)
    angles = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
    assert (np.diff(angles) > 0.0).all() and angles[-1] == pytest.approx(4.0)
    np.testing.assert_allclose(samples.poses[samples.place == 1.0][0][:3, 3], at[1], atol=1e-12)
    chords = np.linalg.norm(np.diff(samples.poses[:, :3, 3], axis=0), axis=1)
    assert (radius - np.sqrt(radius**2 - chords**2 / 4.0)).max() <= 1e-5 * (1.0 + 1e-9)


def test_lines_in_place_of_an_arc_keep_near_it_and_leave_the_other_poses_alone():
    given = [pose(), pose(x=0.3), pose(x=0.4, y=0.1, turn=(0.0, 0.0, 0.5)), pose(x=0.3, y=0.2), pose(y=0.2)]
    poses, stamps, place = sample_arcs(given, vias=[2], stamps=[0.0, 3.0, 5.0, 7.0, 10.0])
    inside = (place >= 1.0) & (place <= 3.0)
    assert (~inside).sum() == 2 and inside.sum() > 100
    for k, row in zip((0, 1, 2, 3, 4), np.searchsorted(place, np.arange(5.0))):
        np.testing.assert_allclose(poses[row], given[k], atol=1e-12)
    middles = 0.5 * (poses[inside][1:, :2, 3] + poses[inside][:-1, :2, 3])
    away = np.linalg.norm(middles - np.array([0.3, 0.1]), axis=1)
    assert 0.1 - 1.001e-5 <= away.min() <= away.max() < 0.1
    np.testing.assert_allclose(stamps, np.interp(place, range(5), [0.0, 3.0, 5.0, 7.0, 10.0]))
    whole = sample(given, vias=[2], step=10.0, angle_step=3.0)
    np.testing.assert_array_equal(poses, whole.poses)


def test_a_path_without_arcs_stays_as_it_is():
    given = np.array([pose(), pose(), pose(x=9.0)])
    poses, stamps, place = sample_arcs(given, [])
    np.testing.assert_allclose(poses, given, atol=1e-15)
    assert stamps is None and place.tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize(('vias', 'stamps', 'text'), [
    ([1], None, 'on a line'), ([0], None, 'via 0'), ([], [0.0, 1.0, 0.5], 'run back: pose 2'),
])  # fmt: skip
def test_arcs_that_are_none_are_refused(vias, stamps, text):
    with pytest.raises(ArgumentError, match=text):
        sample_arcs([pose(), pose(x=0.1), pose(x=0.2)], vias, stamps)


def test_a_pose_that_is_there_twice_counts_once():
    samples = sample([pose(), pose(), pose(x=0.01), pose(x=0.01), pose(x=0.02)])
    np.testing.assert_allclose(samples.poses[:, 0, 3], [0.0, 0.01, 0.02])
    np.testing.assert_allclose(samples.place, [1.0, 2.0, 4.0])


def with_nan(count, index):
    poses = np.array([pose(x=0.001 * k) for k in range(count)])
    poses[index, 1, 3] = np.nan
    return poses


@pytest.mark.parametrize(
    ('poses', 'text'),
    [
        ([pose()], '1 pose'),
        ([pose(), pose(), pose()], 'no length'),
        (with_nan(600, 499), 'pose 499 is not finite'),
        ([pose(), 2.0 * pose()], 'pose 1 is no homogeneous matrix'),
        ([pose(), np.diag([1.0, 1.0, -1.0, 1.0])], 'pose 1 is no homogeneous matrix'),
        (np.zeros((3, 4)), 'shape'),
        ('poses', 'not an array'),
        ([pose(), pose(x=1e9)], 'samples'),
    ],
)
def test_poses_that_make_no_path_are_refused_by_name(poses, text):
    with pytest.raises(ArgumentError, match=text):
        sample(poses)


@pytest.mark.parametrize(
    ('stamps', 'text'),
    [
        ([0.0, 1.0, 0.5], 'run back: pose 2'),
        ([0.0, 1.0, 1.0], 'run back: pose 2'),
        ([0.0, np.nan, 1.0], 'pose 1 is nan'),
        ([0.0, 1.0], r'expected \(3,\)'),
    ],
)
def test_stamps_that_are_none_are_refused_by_pose(stamps, text):
    with pytest.raises(ArgumentError, match=text):
        read_stamps(stamps, 3)


@pytest.mark.parametrize(('vias', 'text'), [([0], 'via 0'), ([2], 'via 2'), ([True], 'via True'), ([1], 'on a line')])
def test_vias_that_make_no_arc_are_refused(vias, text):
    with pytest.raises(ArgumentError, match=text):
        sample([pose(), pose(x=0.1), pose(x=0.2)], vias=vias)
