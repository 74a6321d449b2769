"""The real node over DDS: commands that are clear, obstacles by topic, contacts as markers."""

from __future__ import annotations

import numpy as np
import pytest
from ros_helpers import Client, allow_lark, connected, pose_of
from visualization_msgs.msg import Marker, MarkerArray

from bench.published_robots import UR5, configurations
from ros_ik_pkg.ik import World, load_arm
from ros_ik_pkg.ros.interface import topics

pytestmark = allow_lark
GROUND = -0.05  # m


class RoomClient(Client):
    """A client that sends obstacles and listens to contacts."""

    def __init__(self, node, name: str = topics.NODE_NAME) -> None:
        self.contacts: list[MarkerArray] = []
        super().__init__(node, name)
        self.obstacles = self._publisher(topics.OBSTACLES)
        self._subscribe(topics.CONTACTS, self.contacts.append)


@pytest.fixture(scope='module')
def client(tmp_path_factory):
    words = [f'robot:={UR5[0]}', f'srdf:={UR5[1]}', f'tip_frame:={UR5[2]}', f'ground:={GROUND}', 'seed_source:=home']
    arguments = [part for word in words for part in ('-p', word)]
    with connected(RoomClient, tmp_path_factory.mktemp('contact') / 'log', *arguments) as found:
        yield found


@pytest.fixture(scope='module')
def arm():
    return load_arm(UR5[0], tip=UR5[2], srdf=UR5[1])


def ball(center, action=Marker.ADD, size=0.1):
    marker = Marker(ns='ball', type=Marker.SPHERE, action=action)
    marker.scale.x = marker.scale.y = marker.scale.z = size
    marker.pose.position.x, marker.pose.position.y, marker.pose.position.z = map(float, center)
    marker.pose.orientation.w = 1.0
    return MarkerArray(markers=[marker])


def test_what_is_published_touches_neither_the_robot_nor_the_floor(client, arm):
    world, published = World(floor=GROUND), 0
    for q in configurations(arm, 100, seed=9):
        reply = client.solve(pose_of(arm.forward(q)), 60.0)
        if reply.joints:
            published += 1
            assert arm.contacts.is_clear(np.array([reply.joints[name] for name in arm.joint_names]), 0.0, world)
        else:
            assert reply.figures['status'] == 'collision', reply.message
    assert published > 30
    client.wait_for(lambda: client.contacts, 'a marker of contacts')


def test_obstacles_of_the_topic_count_until_they_are_deleted_and_wrong_ones_do_nothing(client, arm):
    target = pose_of(arm.forward(np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])))
    center = arm.forward(np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2]))[:3, 3]

    def answer(message, wanted):
        for _ in range(200):
            client.obstacles.publish(message)
            reply = client.solve(target, 60.0)
            if bool(reply.joints) == wanted:
                return reply
        raise AssertionError('the obstacle does not count')

    assert 'ball/0' in answer(ball(center), False).message
    client.obstacles.publish(ball(center, size=-1.0))
    assert not client.solve(target, 60.0).joints  # the old one stays
    reply = answer(ball(center, Marker.DELETE), True)
    assert float(reply.figures['clearance']) > 0.0
