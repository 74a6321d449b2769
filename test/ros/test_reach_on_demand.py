"""The reach map of a running node: asked for by a service, latched, while targets are answered."""

from __future__ import annotations

import numpy as np
import pytest
from chains import pinocchio_tip
from ros_helpers import START_TIMEOUT, Client, allow_lark, connected, joint_state, pose_of
from std_srvs.srv import Trigger

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.interface import topics

pytestmark = allow_lark
ARM = load_arm('ur5')


@pytest.fixture(scope='module')
def client(tmp_path_factory):
    log = tmp_path_factory.mktemp('node') / 'log'
    with connected(Client, log, '-p', 'robot:=ur5', '-p', 'seed_source:=home') as client:
        yield client


def ask(client: Client) -> Trigger.Response:
    service = client.node.create_client(Trigger, f'{client.name}/map_reach')
    client.wait_for(service.service_is_ready, 'the service')
    return client._call(service.call_async(Trigger.Request()))


def listen(client: Client, topic) -> list:
    """Return the list that the messages of a topic come into."""
    messages: list = []
    client._subscribe(topic, messages.append)
    return messages


def test_targets_are_answered_while_the_reach_is_mapped_and_the_map_is_there_for_who_comes_late(client):
    cubes = listen(client, topics.REACH)
    answer = ask(client)
    assert answer.success and 'ur5' in answer.message and '/ik_node/reach' in answer.message
    assert ask(client).message == 'a map is under way'
    random, answered = np.random.default_rng(3), 0
    deadline = START_TIMEOUT
    while not cubes and answered < 1e5 * deadline:
        target = ARM.forward(random.uniform(-2.0, 2.0, ARM.n))
        assert client.solve(pose_of(target), 60.0).solved
        answered += 1
    assert answered > 20, 'the map came before there was time for targets'
    late = listen(client, topics.REACH)
    poses = listen(client, topics.REACH_POSES)
    client.wait_for(lambda: late and poses, 'the latched messages')
    (marker, *others), (array,) = late[0].markers, poses
    assert [one.ns for one in (marker, *others)] == ['share', 'sigma_min']
    assert marker.header.stamp == array.header.stamp and marker.header.frame_id == array.header.frame_id == 'base'
    assert len(marker.points) == len(array.poses) > 1000
    edge = marker.scale.x / 0.45
    for point, pose in zip(marker.points[::500], array.poses[::500]):
        offset = np.abs([point.x - pose.position.x, point.y - pose.position.y, point.z - pose.position.z])
        assert offset.max() <= 0.5 * edge + 1e-9
    reply = client.solve(target_from(array.poses[len(array.poses) // 2]), 60.0)
    tip = pinocchio_tip(ARM, np.array([reply.joints[name] for name in ARM.joint_names]))
    p = array.poses[len(array.poses) // 2].position
    np.testing.assert_allclose(tip[:3, 3], [p.x, p.y, p.z], atol=1e-3)


def target_from(pose):
    message = pose_of(np.eye(4))
    message.pose = pose
    return message


def test_without_a_robot_there_is_no_map_and_a_map_whose_robot_is_gone_is_not_published(client):
    cubes = listen(client, topics.REACH)
    client.wait_for(lambda: cubes, 'the map before')
    assert ask(client).success
    client.send_joint_state(joint_state(ARM.joint_names, np.zeros(ARM.n)))
    client.set_parameters({'robot': '', 'robot_description': ''})
    client.wait_for(lambda: not (answer := ask(client)).success and 'no robot' in answer.message, 'a refusal')
    client.set_parameters({'robot': 'puma560'})
    assert len(cubes) == 1
