"""Two arms of one robot: a node process for each, in namespaces, with one joint_states and one robot_description."""

from __future__ import annotations

import itertools
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

import numpy as np
import pytest
from chains import pinocchio_pose
from made_up_robots import humanoid
from ros_helpers import TIMEOUT, Client, allow_lark, joint_state, node_process, pose_of, wait_until_ready
from std_msgs.msg import String

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.tools.processes import ros_node

pytestmark = [allow_lark, pytest.mark.newest]

SIDES = ('left', 'right')
BASE = 'waist_pitch_link'
NEAR = 1.001e-5  # m; the default tolerance
# What launch/two_arms.launch.py gives a node; there is no launch where ROS comes from wheels.
SHARED = [f'{name}:=/{name}' for name in ('joint_states', 'robot_description')]


def arguments(side):
    """Return the arguments of the node of one side."""
    remaps = ['-r', f'__ns:=/{side}', *(word for remap in SHARED for word in ('-r', remap))]
    return [*remaps, '-p', "robot:=''", '-p', f'base_frame:={BASE}', '-p', f'tip_frame:={side}_hand_link']


class WholeRobot:
    """What a robot publishes once for both of its arms: its URDF, latched, and its joint states."""

    def __init__(self, node) -> None:
        self._descriptions, self._joint_states = (
            node.create_publisher(topic.type, f'/{topic.name}', topic.qos)
            for topic in (topics.ROBOT_DESCRIPTION, topics.JOINT_STATES)
        )

    def describe(self, text) -> None:
        """Publish the URDF."""
        self._descriptions.publish(String(data=text))

    def move(self, positions) -> None:
        """Publish the positions of all joints [rad, m], by name."""
        self._joint_states.publish(joint_state(positions.keys(), positions.values()))


@pytest.fixture(scope='module')
def robot_and_clients(tmp_path_factory):
    """The robot, whose description was there before the nodes, and a client of the node of each side."""
    folder = tmp_path_factory.mktemp('two_arms')
    with ExitStack() as stack:
        node = stack.enter_context(ros_node('robot'))
        robot = WholeRobot(node)
        robot.describe(humanoid())
        logs = {side: folder / side for side in SIDES}
        processes = {side: stack.enter_context(node_process(logs[side], *arguments(side))) for side in SIDES}
        clients = {side: stack.enter_context(Client(node, f'/{side}/ik_node')) for side in SIDES}
        for side in SIDES:
            wait_until_ready(processes[side], logs[side])
            clients[side].connect()
        yield robot, clients, logs


@pytest.fixture
def robot(robot_and_clients):
    """The robot, standing as made, with its joints away from their limits; both nodes know."""
    robot, clients, _ = robot_and_clients
    robot.describe(humanoid())
    for side in SIDES:
        arm = arm_of(side)
        settle(robot, clients[side], arm, lambda reply: reply.figures.get('iterations') == '0')
    return robot


@pytest.fixture
def clients(robot_and_clients, robot):
    """The clients by side."""
    return robot_and_clients[1]


def arm_of(side, text=None):
    return load_arm(text or humanoid(), BASE, f'{side}_hand_link')


def stance():
    """Return the positions of both arms in the middle of their ranges, one joint state for both nodes."""
    return {name: float(q) for side in SIDES for name, q in zip(arm_of(side).joint_names, arm_of(side).home)}


def settle(robot, client, arm, wanted):
    """Let the robot publish its joints and send the pose of its hand until the reply is the wanted one."""
    pose = pose_of(arm.forward(arm.home))

    def reply_is_wanted():
        robot.move(stance())
        return wanted(client.solve(pose, TIMEOUT))

    client.wait_for(reply_is_wanted, 'the wanted reply')


def refuse(robot, client, log, text):
    """Let the robot publish a URDF until the node says that it keeps the old one; it says so once a second at most."""
    said = log.read_text().count('keeping taller')
    versions = (text + ' ' * k for k in itertools.count())  # the same text again is no news
    client.wait_for(lambda: robot.describe(next(versions)) or log.read_text().count('keeping taller') > said, 'a word')


def distance(side, joints, target, text=None):
    """Return how far a hand is from its target [m], by Pinocchio's own reading of the URDF."""
    reached = pinocchio_pose(text or humanoid(), BASE, f'{side}_hand_link', joints)
    return np.linalg.norm(reached[:3, 3] - target[:3, 3])


def test_each_node_answers_its_own_targets_at_the_same_time(clients):
    def solve_all(side):
        arm, rng = arm_of(side), np.random.default_rng(8)
        for _ in range(20):
            target = arm.forward(arm.home + rng.uniform(-0.2, 0.2, arm.n))
            reply = clients[side].solve(pose_of(target, BASE), TIMEOUT)
            assert reply.solved, reply.message
            assert tuple(reply.joints) == arm.joint_names
            assert reply.status.name == f'/{side}/ik_node: solved'
            assert distance(side, reply.joints, target) < NEAR
        return set(clients[side].statuses)

    with ThreadPoolExecutor() as threads:
        left, right = threads.map(solve_all, SIDES)
    assert len(left) >= 20 and len(right) >= 20 and not left & right


def test_a_frame_of_one_arm_may_be_the_frame_of_a_target_of_the_other(clients):
    wrist = arm_of('left').base_from_frame('right_hand_link', stance())
    target = arm_of('left').forward(arm_of('left').home)
    reply = clients['left'].solve(pose_of(np.linalg.solve(wrist, target), 'right_hand_link'), TIMEOUT)
    assert reply.solved, reply.message
    assert distance('left', reply.joints, target) < NEAR


def test_a_description_that_changes_is_taken_by_both_and_a_malformed_one_by_none(robot_and_clients, robot, clients):
    _, _, logs = robot_and_clients
    longer = humanoid().replace('name="humanoid"', 'name="taller"').replace('0.0 0.0 -0.14', '0.0 0.0 -0.25')
    robot.describe(longer)
    for side in SIDES:
        settle(robot, clients[side], arm_of(side, longer), lambda reply: reply.status.hardware_id == 'taller')
    for text in ('<robot name="broken"><link', longer.replace('left_hand', 'hook').replace('right_hand', 'claw')):
        for side in SIDES:
            refuse(robot, clients[side], logs[side], text)
            target = arm_of(side, longer).forward(arm_of(side).home + 0.05)
            reply = clients[side].solve(pose_of(target), TIMEOUT)
            assert reply.solved and distance(side, reply.joints, target, longer) < NEAR
