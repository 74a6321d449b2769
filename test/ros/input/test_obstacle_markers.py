"""Obstacles from markers: taken, changed, deleted, refused one by one."""

from __future__ import annotations

import time

import numpy as np
import pytest
from visualization_msgs.msg import Marker, MarkerArray

from ros_ik_pkg.ik.model.transforms import transform
from ros_ik_pkg.ros.input.obstacle_markers import ObstacleMarkers
from ros_ik_pkg.ros.input.refusal import RefusedError

SHIFTED = np.array([[1.0, 0, 0, 2.0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def marker(number=0, kind=Marker.CUBE, action=Marker.ADD, scale=(0.1, 0.2, 0.3), w=1.0, x=0.0):
    found = Marker(ns='room', id=number, type=kind, action=action)
    found.scale.x, found.scale.y, found.scale.z = scale
    found.pose.orientation.w, found.pose.position.x = w, x
    return found


def take(markers, *messages, place=lambda header: np.eye(4)):
    return markers.take(MarkerArray(markers=list(messages)), place)


@pytest.mark.parametrize(('kind', 'scale', 'shape', 'size'), [
    (Marker.CUBE, (0.1, 0.2, 0.3), 'box', (0.1, 0.2, 0.3)),
    (Marker.SPHERE, (0.2, 0.2, 0.2), 'sphere', (0.1,)),
    (Marker.SPHERE, (0.2, 0.4, 0.1), 'sphere', (0.2,)),
    (Marker.CYLINDER, (0.2, 0.2, 0.5), 'cylinder', (0.1, 0.5)),
])
def test_shapes_are_taken_in_the_frame_of_their_header(kind, scale, shape, size):
    markers = ObstacleMarkers()
    assert take(markers, marker(kind=kind, scale=scale, x=1.0), place=lambda header: SHIFTED) == []
    (obstacle,) = markers.current()
    assert (obstacle.kind, obstacle.name) == (shape, 'room/0')
    assert np.allclose(obstacle.shape.size, size)
    assert np.allclose(obstacle.shape.frame_from_shape[:3, 3], [3.0, 0.0, 0.0])


def test_an_obstacle_is_changed_and_deleted_by_namespace_and_id():
    markers = ObstacleMarkers()
    take(markers, marker(0), marker(1))
    take(markers, marker(1, x=5.0))
    assert [obstacle.shape.frame_from_shape[0, 3] for obstacle in markers.current()] == [0.0, 5.0]
    take(markers, marker(0, action=Marker.DELETE))
    assert [obstacle.name for obstacle in markers.current()] == ['room/1']
    take(markers, marker(action=Marker.DELETEALL))
    assert markers.current() == ()


def test_an_obstacle_ends_with_its_lifetime():
    markers = ObstacleMarkers()
    short, long = marker(0), marker(1)
    short.lifetime.nanosec, long.lifetime.sec = 1000, 1000
    take(markers, short, long)
    time.sleep(0.01)
    assert [obstacle.name for obstacle in markers.current()] == ['room/1']


@pytest.mark.parametrize(('wrong', 'reason'), [
    (marker(1, scale=(0.1, 0.0, 0.1)), 'expected three numbers above 0'),
    (marker(1, scale=(0.1, np.nan, 0.1)), 'expected three numbers above 0'),
    (marker(1, kind=Marker.ARROW), 'expected CUBE, SPHERE or CYLINDER'),
    (marker(1, w=0.0), 'pose of norm 0'),
    (marker(1, x=np.nan), 'expected finite numbers'),
    (marker(1, action=7), 'action 7'),
    (marker(1, scale=(1e6, 1.0, 1.0)), 'at most 10000'),
])  # fmt: skip
def test_a_marker_that_makes_no_sense_is_left_aside_with_a_reason_and_the_others_stay(wrong, reason):
    markers = ObstacleMarkers()
    reasons = take(markers, marker(0), wrong, marker(2))
    assert len(reasons) == 1 and reason in reasons[0] and 'room/1' in reasons[0]
    assert [obstacle.name for obstacle in markers.current()] == ['room/0', 'room/2']


def test_a_marker_in_a_frame_that_cannot_be_placed_is_left_aside():
    def nowhere(header):
        raise RefusedError('frame', 'no such frame')

    assert 'no such frame' in take(ObstacleMarkers(), marker(), place=nowhere)[0]


def test_a_marker_that_is_locked_to_a_link_is_attached_to_it():
    markers = ObstacleMarkers()
    locked = marker(x=0.3)
    locked.header.frame_id, locked.frame_locked = 'hand', True
    assert markers.take(MarkerArray(markers=[locked]), lambda header: 2.0 * np.eye(4), ('hand',), ('hand',)) == []
    (obstacle,) = markers.current()
    assert obstacle.link == 'hand' and obstacle.shape.frame_from_shape[:3, 3].tolist() == [0.3, 0.0, 0.0]


def test_a_marker_in_the_frame_of_the_tip_is_left_aside_unless_it_is_attached():
    markers = ObstacleMarkers()
    loose = marker()
    loose.header.frame_id = '/hand'
    (reason,) = markers.take(MarkerArray(markers=[loose]), lambda header: np.eye(4), ('hand',), ('hand',))
    assert "frame 'hand' moves with the tip" in reason and 'frame_locked' in reason and not markers.current()


def test_obstacles_stay_where_they_are_when_the_base_frame_moves():
    markers = ObstacleMarkers()
    locked = marker(1)
    locked.header.frame_id, locked.frame_locked = 'hand', True
    markers.take(MarkerArray(markers=[marker(0, x=0.3), locked]), lambda header: np.eye(4), ('hand',))
    markers.move(transform(np.eye(3), np.array([0.0, 0.0, -1.0])))
    stands, held = (obstacle.shape.frame_from_shape[:3, 3].tolist() for obstacle in markers.current())
    assert stands == [0.3, 0.0, -1.0] and held == [0.0, 0.0, 0.0]
