"""Targets in frames that the robot does not have: over DDS, by TF, or refused with the reason.

tf2 has no wheels, so where it is not installed the node process gets a stand-in (test/tf2_stand_in), which has the
signatures and exceptions of the real tf2_ros and hears geometry_msgs/TransformStamped on /tf and /tf_static. What is
tested is this package's side of it: which frames TF is asked for, at what time, how long, and in what words it refuses.
"""

from __future__ import annotations

import importlib.util
import itertools
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pinocchio as pin
import pytest
from chains import pinocchio_tip
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_helpers import (
    DEFAULTS,
    ROOT,
    START_TIMEOUT,
    TIMEOUT,
    Client,
    allow_lark,
    connected,
    joint_state,
    node_process,
    pose_of,
    seconds_to_end,
    wait_until_ready,
)

from ros_ik_pkg.ik import load_arm

pytestmark = [allow_lark, pytest.mark.newest]

REAL = importlib.util.find_spec('tf2_ros') is not None
ARM = load_arm('puma560')
NEAR = 1.001e-5  # m; the default tolerance
WAIT = 0.5  # s; a tf_timeout that a busy machine does not exceed by accident
STOP_TIMEOUT = 2.0  # s, what the node promises
CAMERA = pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.2, 0.5), np.array([0.4, 0.1, 0.7]))
WORLD = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, 2.0), np.array([-1.0, 3.0, 0.2]))  # world -> base_link


class TfClient(Client):
    """A client that sends transforms too, as a TransformBroadcaster does."""

    def __init__(self, node, name: str = 'ik_node') -> None:
        super().__init__(node, name)
        kind = importlib.import_module('tf2_msgs.msg').TFMessage if REAL else TransformStamped
        self._tf = self.node.create_publisher(kind, '/tf', 100)
        latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._tf_static = self.node.create_publisher(kind, '/tf_static', latched)

    def send_transform(self, parent, child, placement, stamp=None) -> None:
        """Publish a transform; one without a stamp is static."""
        message = TransformStamped(child_frame_id=child)
        message.header.frame_id = parent
        if stamp is not None:
            message.header.stamp.sec, message.header.stamp.nanosec = stamp
        p, q = message.transform.translation, message.transform.rotation
        p.x, p.y, p.z, q.x, q.y, q.z, q.w = pin.SE3ToXYZQUAT(placement).tolist()
        publisher = self._tf_static if stamp is None else self._tf
        publisher.publish(type(publisher.msg_type())(transforms=[message]) if REAL else message)

    def answer_at(self, pose, stamp):
        """Send a target under a stamp; return the status of its answer and the joint positions [rad, m]."""
        self.statuses.pop(stamp, None)
        self.solutions.clear()  # one for stamp 0 comes under the time of now
        pose.header.stamp.sec, pose.header.stamp.nanosec = stamp
        self.send(pose)
        self.wait_for(lambda: self.statuses[stamp], f'an answer at {stamp}')
        status = self.statuses[stamp][0]
        if status.name.endswith('solved'):
            self.wait_for(lambda: self.solutions, f'a solution at {stamp}')
        solutions = [message for messages in self.solutions.values() for message in messages]
        return status, [dict(zip(message.name, message.position)) for message in solutions]


@pytest.fixture(scope='module')
def stand_in():
    """Let processes that are started from now on find a tf2_ros."""
    with pytest.MonkeyPatch.context() as patch:
        if not REAL:
            paths = [str(ROOT / 'test' / 'tf2_stand_in'), *os.environ.get('PYTHONPATH', '').split(os.pathsep)]
            patch.setenv('PYTHONPATH', os.pathsep.join(filter(None, paths)))
        yield


@pytest.fixture(scope='module')
def running(stand_in, tmp_path_factory):
    """A node that knows where the world and the camera are: world -> base_link -> camera."""
    with connected(TfClient, tmp_path_factory.mktemp('node') / 'log', '-p', 'seed_source:=home') as client:
        client.send_transform('world', ARM.base_frame, WORLD)
        client.send_transform(ARM.base_frame, 'camera', CAMERA)
        pose = pose_of(CAMERA.actInv(pin.SE3(ARM.forward(ARM.home))).homogeneous, 'camera')
        client.wait_for(lambda: client.solve(pose, TIMEOUT).solved, 'the static transforms')
        yield client


@pytest.fixture
def client(running):
    """The client, the node at its defaults but for the seed."""
    running.set_parameters({**DEFAULTS, 'seed_source': 'home'})
    return running


def target():
    """Return a pose of the tip that the arm reaches."""
    return pin.SE3(ARM.forward(ARM.home + 0.1))


def distance(joints, wanted) -> float:
    """Return how far the tip is from where it should be, in the base frame [m], by Pinocchio."""
    reached = pinocchio_tip(ARM, [joints[name] for name in ARM.joint_names])
    return float(np.linalg.norm(reached[:3, 3] - wanted.translation))


@pytest.mark.parametrize(
    ('frame', 'base_from_frame'), [('camera', CAMERA), ('/camera', CAMERA), ('world', WORLD.inverse())]
)
def test_a_target_in_a_frame_of_tf_is_solved_in_the_base_frame(client, frame, base_from_frame):
    reply = client.solve(pose_of(base_from_frame.actInv(target()).homogeneous, frame), TIMEOUT)
    assert reply.solved, reply.message
    assert distance(reply.joints, target()) < NEAR
    assert reply.figures['notes'] == 'frame of the target by TF' and reply.figures['target_frame'] == frame


def test_a_moving_frame_is_looked_up_at_the_stamp_of_the_target_and_at_zero_the_newest_is_taken(client):
    here, there = (pin.SE3(np.eye(3), np.array([x, 0.0, 0.0])) for x in (0.1, 0.2))
    client.set_parameters({'tf_timeout': 1.0})
    client.send_transform('camera', 'belt', here, (100, 0))
    client.send_transform('camera', 'belt', there, (200, 0))
    for stamp, belt in (((100, 0), here), ((200, 0), there), ((0, 0), there)):
        pose = pose_of((CAMERA * belt).actInv(target()).homogeneous, 'belt')
        client.wait_for(lambda pose=pose, stamp=stamp: client.answer_at(pose, stamp)[1], 'a solution')
        status, (joints,) = client.answer_at(pose, stamp)
        assert distance(joints, target()) < NEAR, status.message


def test_a_transform_that_comes_while_the_node_waits_is_used(client):
    client.set_parameters({'tf_timeout': 1.0})
    client.send_transform('camera', 'late', pin.SE3.Identity(), (300, 0))
    pose, seconds = pose_of(CAMERA.actInv(target()).homogeneous, 'late'), itertools.count(400)
    client.wait_for(lambda: client.answer_at(pose, (300, 0))[1], 'a solution')

    def transform_after_target():  # again where a busy machine brings it too late
        stamp = next(seconds), 0
        pose.header.stamp.sec = stamp[0]
        client.send(pose)
        client.send_transform('camera', 'late', pin.SE3.Identity(), stamp)
        client.wait_for(lambda: client.statuses[stamp], 'an answer')
        return client.statuses[stamp][0].level == DiagnosticStatus.OK

    client.wait_for(transform_after_target, 'a solution')


def test_what_tf_cannot_tell_is_refused_with_both_frames_stamp_wait_and_reason(client):
    client.send_transform('camera', 'belt', pin.SE3.Identity(), (200, 0))
    client.send_transform('island', 'hut', pin.SE3.Identity())
    for frame, word in (('hut', 'tree'), ('belt', 'the future')):
        pose = pose_of(np.eye(4), frame)
        client.wait_for(lambda pose=pose, word=word: word in client.solve(pose, TIMEOUT).message, f'the frame {frame}')
    for frame, stamp, reason in (
        ('nowhere', (5, 7), '"nowhere" passed to lookupTransform argument source_frame does not exist'),
        ('belt', (900, 0), 'extrapolation into the future'),
        ('hut', (0, 0), 'not part of the same tree'),
        ('//camera', (0, 0), 'cannot start with'),
    ):
        status, solutions = client.answer_at(pose_of(np.eye(4), frame), stamp)
        figures = {pair.key: pair.value for pair in status.values}
        assert (figures['outcome'], figures['status'], solutions) == ('refused', 'frame', [])
        stamp_text = f'{stamp[0]}.{stamp[1]:09d}' if any(stamp) else '0, the newest'
        name = frame.removeprefix('/')
        assert f"no transform from '{name}' to '{ARM.base_frame}' at stamp {stamp_text}, waited" in status.message
        assert '(tf_timeout 0.1 s): ' in status.message and reason in status.message


def test_targets_do_not_pile_up_behind_the_wait(client):
    client.set_parameters({'tf_timeout': WAIT})
    began, sent, pose = time.monotonic(), 0, pose_of(np.eye(4), 'nowhere')

    def refused() -> int:
        return sum(stamp[0] == 7 for stamp in client.statuses)

    def send_some() -> None:
        nonlocal sent
        for _ in range(10):
            sent += 1
            pose.header.stamp.sec, pose.header.stamp.nanosec = 7, sent
            client.send(pose)

    client.wait_for(lambda: send_some() or refused(), 'a refusal, with the next target waiting')
    seconds = time.monotonic() - began
    assert client.solve(pose_of(target().homogeneous), TIMEOUT).solved
    # One after the other as long as such targets came, one that was under way, one that waited.
    assert refused() <= seconds / WAIT + 2 < sent


def test_while_a_target_waits_for_its_transform_others_are_answered_and_it_is_not_gone_back_to(client):
    client.set_parameters({'tf_timeout': 1.0})
    seconds = itertools.count(500)

    def overtaken() -> bool:  # again where a busy machine takes longer than the wait
        stamp = next(seconds), 0
        waiting = pose_of(np.eye(4), 'nowhere')
        waiting.header.stamp.sec = stamp[0]
        client.send(waiting)
        client.parameter('tf_timeout')  # answered after the node took the target: else the next often takes its place
        reply = client.solve(pose_of(target().homogeneous), TIMEOUT)
        assert reply.solved
        if not client._spin_until(lambda: client.statuses[stamp], time.monotonic() + 5.0):
            return False  # the second one took its place before the node had it: only the newest waits
        (status,) = client.statuses[stamp]
        figures = {pair.key: pair.value for pair in status.values}
        assert figures['outcome'] == 'refused' and not client.solutions[stamp]
        return figures['status'] == 'superseded' and 'a newer target was commanded' in status.message

    client.wait_for(overtaken, 'a target that is answered while another waits')


def test_while_a_target_waits_for_its_transform_parameters_are_set(client):
    client.set_parameters({'tf_timeout': 1.0})
    seconds = itertools.count(600)

    def set_meanwhile() -> bool:  # again where a busy machine takes longer than the wait
        stamp = next(seconds), 0
        pose = pose_of(np.eye(4), 'nowhere')
        pose.header.stamp.sec = stamp[0]
        client.send(pose)
        count = 0
        while not client.statuses[stamp]:
            client.set_parameters({'max_attempts': 7})
            count += 1
        return count > 3  # one or two come before the wait and with its end anyway

    client.wait_for(set_meanwhile, 'parameters that are set while a target waits')


def test_the_node_that_listens_to_tf_is_hidden_and_has_no_services(client):
    client.wait_for(
        lambda: '_ik_node_tf_listener' in client.node.get_node_names(), 'the hidden name, in which ros2 finds no node'
    )
    services = client.node.get_service_names_and_types_by_node('_ik_node_tf_listener', '/')
    assert not [name for name, _ in services if 'parameter' in name]
    visible = [name for name in client.node.get_node_names() if not name.startswith('_')]
    assert [name for name in visible if name.startswith('ik_node')] == ['ik_node']


def test_frames_of_the_robot_are_placed_by_the_joint_states_whatever_tf_says(client):
    client.send_transform('link2', 'link3', pin.SE3(np.eye(3), np.array([5.0, 5.0, 5.0])))
    known = dict(zip(ARM.joint_names, ARM.home))
    base_from_link3 = pin.SE3(ARM.base_from_frame('link3', known))
    pose = pose_of(base_from_link3.actInv(target()).homogeneous, 'link3')
    reply = client.settle(pose, lambda reply: reply.solved, joint_state(ARM.joint_names, ARM.home))
    assert distance(reply.joints, target()) < NEAR and reply.figures['notes'] == ''


def test_with_a_timeout_of_zero_tf_is_not_asked(client):
    pose = pose_of(CAMERA.actInv(target()).homogeneous, 'camera')
    client.set_parameters({'tf_timeout': 0.0})
    message = client.solve(pose, TIMEOUT).message
    assert "'camera' does not exist" in message and 'TF is not asked, because tf_timeout is 0' in message
    client.set_parameters({'tf_timeout': 0.1})
    client.wait_for(lambda: client.solve(pose, TIMEOUT).solved, 'the static transforms again')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_node_in_time_while_it_waits_for_a_transform(running, tmp_path, number):
    log, pose = tmp_path / 'log', pose_of(np.eye(4), 'nowhere')
    arguments = ['-p', 'tf_timeout:=1.0', '-r', '__ns:=/ending']
    with node_process(log, *arguments) as process, Client(running.node, '/ending/ik_node') as client:
        wait_until_ready(process, log)
        client.connect()
        client.wait_for(lambda: client.send(pose) or client.statuses, 'a refusal, with the next target waiting')
        process.send_signal(number)
        assert seconds_to_end(process) < STOP_TIMEOUT
    assert process.returncode == 0
    assert 'Traceback' not in log.read_text()


SIGNAL_BEFORE_SPINNING = """
import os, signal, sys
from ros_ik_pkg.ros import ik_node, node

class IkNode(node.IkNode):
    def __init__(self):
        super().__init__()
        os.kill(os.getpid(), signal.SIGTERM)

node.IkNode = IkNode
sys.exit(ik_node.main(sys.argv))
"""


def test_a_signal_before_the_node_spins_ends_it_without_a_word(stand_in):
    command = [sys.executable, '-c', SIGNAL_BEFORE_SPINNING, '--ros-args', '-r', '__ns:=/early']
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=START_TIMEOUT)
    assert done.returncode == 0
    assert 'ready: ' in done.stderr and 'Traceback' not in done.stderr, done.stderr
