"""The tool at runtime, over DDS: by parameter and by messages, judged by Pinocchio with the tool that results name."""

from __future__ import annotations

import time

import numpy as np
import pinocchio as pin
import pytest
from chains import pinocchio_tip
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Path
from ros_helpers import (
    START_TIMEOUT,
    TIMEOUT,
    Client,
    allow_lark,
    connected,
    joint_state,
    node_process,
    pose_of,
    wait_until_ready,
)

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.handling.tools import LOG_PERIOD
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.reply import values

pytestmark = [allow_lark, pytest.mark.newest]

ARM = load_arm('panda')
NEAR = 1.001e-5  # m, rad; the default tolerances
HOME = joint_state(ARM.joint_names, ARM.home)
TOOL = pin.SE3(pin.rpy.rpyToMatrix(0.5, -0.2, 1.0), np.array([0.02, 0.01, 0.15]))
CHANGES = 50.0  # Hz
ARGUMENTS = ('-p', 'robot:=panda', '-p', 'avoid_collisions:=false', '-p', 'path.deadline:=0.0')


class ToolClient(Client):
    """A client that mounts tools."""

    def __init__(self, node, name: str = topics.NODE_NAME) -> None:
        super().__init__(node, name)
        self._tool, self._tool_pose = self._publisher(topics.TOOL), self._publisher(topics.TOOL_POSE)

    def send_transform(self, tool: pin.SE3, frame: str = '', child: str = '') -> None:
        self._tool.publish(transform_of(tool, frame, child))

    def send_pose(self, tool: pin.SE3, frame: str = '') -> None:
        self._tool_pose.publish(pose_of(tool.homogeneous, frame))


def transform_of(tool: pin.SE3, frame: str = '', child: str = '') -> TransformStamped:
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = frame
    p, q = message.transform.translation, message.transform.rotation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = pin.SE3ToXYZQUAT(tool).tolist()
    return message


def numbers(tool: pin.SE3) -> list[float]:
    return pin.SE3ToXYZQUAT(tool).tolist()


def tool_of(reply) -> pin.SE3:
    """Return the tool that a result names."""
    text = reply.figures['tool']
    return pin.XYZQUATToSE3(np.array(text.split(), dtype=float)) if text else pin.SE3.Identity()


def off(joints, tool: pin.SE3, target: np.ndarray) -> float:
    """Return how far [m, rad] the tool is from the target at these joints, by Pinocchio."""
    reached = pin.SE3(pinocchio_tip(ARM, joints)) * tool
    return max(np.linalg.norm((reached.homogeneous - target)[:3, 3]),
               np.linalg.norm(pin.log3(target[:3, :3] @ reached.rotation.T)))  # fmt: skip


def some_target(tool: pin.SE3, rng) -> np.ndarray:
    """Return a pose (4, 4) that the tool reaches."""
    q = ARM.home + rng.uniform(-0.3, 0.3, ARM.n)
    return pinocchio_tip(ARM, np.clip(q, ARM.lower, ARM.upper)) @ tool.homogeneous


@pytest.fixture(scope='module')
def client(tmp_path_factory):
    log = tmp_path_factory.mktemp('tool') / 'log'
    with connected(ToolClient, log, *ARGUMENTS) as client:
        client.log = log
        yield client


@pytest.fixture(autouse=True)
def bare(client):
    client.set_parameters({'tool': []})
    client.settle(pose_of(pinocchio_tip(ARM, ARM.home)), lambda reply: reply.solved, HOME)


def settled(client, wanted: pin.SE3, target: np.ndarray):
    """Return the reply to a target from the moment on that the tool is on."""
    return client.settle(
        pose_of(target), lambda reply: np.allclose(tool_of(reply).homogeneous, wanted.homogeneous, atol=1e-12), HOME
    )


def joints_of(reply):
    assert reply.solved, reply.message
    return [reply.joints[name] for name in ARM.joint_names]


@pytest.mark.parametrize('given', [[*TOOL.translation, 0.5, -0.2, 1.0], numbers(TOOL)], ids=['rpy', 'quaternion'])
def test_the_tool_of_the_parameter_reaches_the_target(client, given):
    target = some_target(TOOL, np.random.default_rng(1))
    client.set_parameters({'tool': given})
    reply = client.solve(pose_of(target), TIMEOUT)
    np.testing.assert_allclose(tool_of(reply).homogeneous, TOOL.homogeneous, atol=1e-12)
    assert off(joints_of(reply), TOOL, target) <= 2.0 * NEAR
    client.set_parameters({'tool': []})
    reply = client.solve(pose_of(target), TIMEOUT)
    assert reply.figures['tool'] == ''
    assert off(joints_of(reply), pin.SE3.Identity(), target) <= 2.0 * NEAR


@pytest.mark.parametrize('kind', ['transform', 'pose'])
@pytest.mark.parametrize('frame', ['', ARM.tip_frame])
def test_the_tool_of_a_message_reaches_the_target_and_is_in_the_parameter(client, kind, frame):
    target = some_target(TOOL, np.random.default_rng(2))
    (client.send_transform if kind == 'transform' else client.send_pose)(TOOL, frame)
    reply = settled(client, TOOL, target)
    assert off(joints_of(reply), TOOL, target) <= 2.0 * NEAR
    np.testing.assert_allclose(client.parameter('tool'), numbers(TOOL), atol=1e-12)


def test_a_target_may_be_given_in_the_frame_of_the_tool(client):
    client.send_transform(TOOL, ARM.tip_frame, 'gripper')
    ahead = pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.05]))
    settled(client, TOOL, some_target(TOOL, np.random.default_rng(3)))
    client.send_joint_state(HOME)
    target = pinocchio_tip(ARM, ARM.home) @ (TOOL * ahead).homogeneous
    reply = client.solve(pose_of(ahead.homogeneous, 'gripper'), TIMEOUT)
    assert off(joints_of(reply), TOOL, target) <= 2.0 * NEAR
    client.set_parameters({'tool': [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]})
    assert client.solve(pose_of(ahead.homogeneous, 'tool'), TIMEOUT).solved
    assert client.solve(pose_of(ahead.homogeneous, 'gripper'), TIMEOUT).figures['status'] == 'frame'


def test_a_tool_that_makes_no_sense_is_refused_with_the_reason_and_the_old_one_stays(client):
    client.set_parameters({'tool': numbers(TOOL)})
    for given in ([1.0], [0.0] * 7, [float('nan')] * 6, ['tool']):
        assert 'tool' in client.refusal_of(tool=given)
    broken = transform_of(pin.SE3.Identity())
    broken.transform.rotation.w = float('nan')
    for message, why in (
        (transform_of(pin.SE3.Identity(), 'nowhere'), "its frame_id is 'nowhere'"),
        (transform_of(pin.SE3.Identity(), ARM.tip_frame, ARM.base_frame), 'is a link of the robot'),
        (broken, 'nan] is not allowed: expected x y z'),
    ):
        time.sleep(LOG_PERIOD)
        client._tool.publish(message)
        client.wait_for(lambda why=why: why in client.log.read_text(), why)
        target = some_target(TOOL, np.random.default_rng(4))
        reply = client.solve(pose_of(target), TIMEOUT)
        assert off(joints_of(reply), TOOL, target) <= 2.0 * NEAR


def test_a_path_is_one_of_the_tool_and_its_result_names_it(client):
    client.set_parameters({'tool': numbers(TOOL)})
    client.send_joint_state(HOME)
    start = pinocchio_tip(ARM, ARM.home) @ TOOL.homogeneous
    path = Path()
    for k in range(3):
        pose = start.copy()
        pose[2, 3] += 0.01 * k
        path.poses.append(pose_of(pose))
    reply = client.solve_path(path, START_TIMEOUT)  # the first path on a machine compiles
    assert reply.solved, reply.message
    named = np.array(values(reply.status)['tool'].split(), dtype=float)
    np.testing.assert_allclose(named, numbers(TOOL), atol=1e-12)
    for point, target in ((reply.trajectory.points[0], start), (reply.trajectory.points[-1], pose)):
        assert off(point.positions, TOOL, target) <= 2.0 * NEAR


def test_no_answer_is_for_the_wrong_tool_while_the_tool_changes(client):
    """Each target is one that the tools reach in different configurations, so only one fits."""
    rng, sent, wrong, used = np.random.default_rng(5), set(), [], set()
    tools = [TOOL * pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.002 * k])) for k in range(25)]
    due = began = time.monotonic()
    k = 0
    while len(used) < 15:
        assert time.monotonic() < began + TIMEOUT
        if time.monotonic() >= due:
            due += 1.0 / CHANGES
            k += 1
            tool = tools[k % len(tools)]
            sent.add(tuple(numbers(tool)))
            client.send_transform(tool, ARM.tip_frame)
        target = some_target(tools[12], rng)
        reply = client.solve(pose_of(target), TIMEOUT)
        named = tool_of(reply)
        fits = [tool for tool in [pin.SE3.Identity(), *tools] if off(joints_of(reply), tool, target) <= 3.0 * NEAR]
        if len(fits) != 1 or not np.allclose(fits[0].homogeneous, named.homogeneous, atol=1e-9):
            wrong.append(reply.figures)
        used.add(reply.figures['tool'])
    assert not wrong


def test_a_latched_tool_that_was_sent_before_the_start_is_on_after_it(client, tmp_path):
    publisher = client.node.create_publisher(topics.TOOL_POSE.type, '/early/tool_pose', topics.TOOL_POSE.qos)
    publisher.publish(pose_of(TOOL.homogeneous, ARM.tip_frame))
    words = ('-r', '__ns:=/early', '-p', 'robot:=panda', '-p', 'avoid_collisions:=false')
    with node_process(tmp_path / 'log', *words) as process, Client(client.node, '/early/ik_node') as early:
        wait_until_ready(process, tmp_path / 'log')
        early.connect()
        target = some_target(TOOL, np.random.default_rng(6))
        assert off(joints_of(settled(early, TOOL, target)), TOOL, target) <= 2.0 * NEAR
