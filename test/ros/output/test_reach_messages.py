"""A reach map as messages: the cubes are its positions, and each pose is one that the arm reaches there."""

from __future__ import annotations

import numpy as np
import pytest
from numerics import get_arm, pinocchio_tip
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from ros_ik_pkg.ik import reach_map, solve
from ros_ik_pkg.ros.output.reach_messages import reach_cloud, reach_markers_message, reach_poses_message

HEADER = Header(frame_id='base')


@pytest.fixture(scope='module')
def mapped():
    arm = get_arm('ur5')
    found = reach_map(arm, step=0.3, parts=2, samples_count=20_000, rounds=1)
    return arm, found, reach_cloud(found, arm)


def test_there_is_a_cube_for_each_position_that_is_reached_and_its_colour_is_the_share_of_the_rotations(mapped):
    _, found, cloud = mapped
    marker, _ = reach_markers_message(cloud, found.step, HEADER).markers
    assert marker.ns == 'share'
    assert marker.type == Marker.CUBE_LIST and marker.header.frame_id == 'base'
    assert len(marker.points) == len(marker.colors) == int((found.share > 0.0).sum())
    for point, colour in zip(marker.points[::50], marker.colors[::50]):
        place = np.floor((np.array([point.x, point.y, point.z]) - found.corner) / found.step).astype(int)
        share = found.share[tuple(place)]
        assert colour.b == pytest.approx(share, abs=1e-6) and colour.r == pytest.approx(1.0 - share, abs=1e-6)


def test_a_second_list_of_cubes_shows_the_singular_values_and_says_which_is_the_largest(mapped):
    _, found, cloud = mapped
    share, marker = reach_markers_message(cloud, found.step, HEADER).markers
    assert marker.ns == 'sigma_min' and marker.points == share.points
    assert marker.scale.x < share.scale.x < found.step
    best = found.best_sigma_min[found.share > 0.0]
    assert float(marker.text) == pytest.approx(best.max(), rel=1e-2) and float(share.text) == 1.0
    np.testing.assert_allclose([colour.b for colour in marker.colors], best / best.max(), atol=1e-6)


def test_each_pose_is_in_the_cube_of_its_number_and_is_reached_with_the_largest_singular_value_there(mapped):
    arm, found, cloud = mapped
    poses = reach_poses_message(cloud, HEADER).poses
    best = found.best_sigma_min[found.share > 0.0]
    assert len(poses) == len(best)
    for number in range(0, len(poses), 40):
        p = poses[number].position
        assert np.abs(np.array([p.x, p.y, p.z]) - cloud.centres[number]).max() <= 0.5 * found.step + 1e-9
        q = found.configuration(cloud.centres[number])
        np.testing.assert_allclose(pinocchio_tip(arm, q), cloud.base_from_tip[number], atol=1e-9)
        assert np.linalg.svd(arm.jacobian(q), compute_uv=False)[-1] == pytest.approx(best[number], abs=1e-9)
        assert solve(arm, cloud.base_from_tip[number]).converged
