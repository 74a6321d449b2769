"""The real node with two tips over DDS: a target topic for each, one solution of both arms."""

from __future__ import annotations

import numpy as np
import pytest
from ros_helpers import Client, allow_lark, connected, joint_state, pose_of
from two_arms import TIPS, get_arms, off, poses, robot_text

from ros_ik_pkg.ros.interface import topics

pytestmark = [allow_lark, pytest.mark.newest]


class TipsClient(Client):
    """A client that sends targets of both tips."""

    def __init__(self, node, name: str = topics.NODE_NAME) -> None:
        super().__init__(node, name)
        self.tips = [self._publisher(topic) for topic in (topics.FIRST_TARGET_POSE, topics.SECOND_TARGET_POSE)]


@pytest.fixture(scope='module')
def client(tmp_path_factory):
    folder = tmp_path_factory.mktemp('tips')
    path = folder / 'two_arms.urdf'
    path.write_text(robot_text(True))
    words = [f'robot:={path}', f'tip_frames:=[{", ".join(TIPS)}]', 'seed_source:=last_solution']
    arguments = [part for word in words for part in ('-p', word)]
    with connected(TipsClient, folder / 'log', *arguments) as found:
        found.log = folder / 'log'
        yield found


def reply_to(client, tip, pose, stamp, frame=''):
    """Send a target of a tip, again until it is answered; return the status."""
    message = pose_of(pose, frame)
    message.header.stamp.sec = stamp
    client.wait_for(lambda: client.tips[tip].get_subscription_count() > 0, 'a subscription')
    client.tips[tip].publish(message)
    client.wait_for(lambda: client.statuses[stamp, 0], f'a result of target {stamp}')
    return client.statuses[stamp, 0][-1]


def test_each_target_of_a_tip_is_answered_by_a_solution_of_both_arms(client):
    arms, rng = get_arms(), np.random.default_rng(1)
    for k, q in enumerate(rng.uniform(0.5 * arms.lower, 0.5 * arms.upper, (10, arms.n))):
        left, right = poses(arms, q)
        reply_to(client, 0, left, 100 + 2 * k)
        status = reply_to(client, 1, right, 101 + 2 * k)
        assert status.name.endswith('solved'), status.message
        client.wait_for(lambda stamp=101 + 2 * k: client.solutions[stamp, 0], 'a solution')
        message = client.solutions[101 + 2 * k, 0][-1]
        assert tuple(message.name) == arms.joint_names
        for target, pose in zip((left, right), poses(arms, np.array(message.position))):
            assert max(off(target, pose)) < 1.1e-5


def test_the_node_says_where_it_takes_targets(client):
    (ready,) = (line for line in client.log.read_text().splitlines() if 'ready: ' in line)
    assert ready.endswith('targets on /first_target_pose and /second_target_pose')


def test_the_target_of_one_tip_is_refused_and_parameters_of_one_tip_too(client):
    reply = client.solve(pose_of(np.eye(4)), 60.0)
    assert reply.figures['status'] == 'tip_frames'
    assert 'velocity_limiting' in client.refusal_of(velocity_limiting='whole')
    assert 'two different links' in client.refusal_of(tip_frames=['left_tip'])


def test_the_seed_can_be_the_joint_states_of_both_arms(client):
    arms = get_arms()
    client.set_parameters({'seed_source': 'joint_states'})
    client.send_joint_state(joint_state(arms.joint_names, 0.2 * np.ones(arms.n)))
    left, right = poses(arms, 0.25 * np.ones(arms.n))
    reply_to(client, 0, left, 300)
    status = reply_to(client, 1, right, 301)
    client.set_parameters({'seed_source': 'last_solution'})
    assert status.name.endswith('solved'), status.message
