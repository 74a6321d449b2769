"""The stream of commands over DDS, by the real node."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from chains import pinocchio_tip
from geometry_msgs.msg import TwistStamped
from ros_helpers import DEFAULTS, TIMEOUT, Client, allow_lark, connected, joint_state, pose_of
from smooth_commands import assert_within_limits
from std_srvs.srv import SetBool
from visualization_msgs.msg import Marker, MarkerArray

from bench.published_robots import UR5
from ros_ik_pkg.ik import Obstacle, World, load_arm
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.interface.servo_settings import SERVO_OPTIONS, ServoSettings
from ros_ik_pkg.ros.reply import values
from ros_ik_pkg.ros.servo.servo import motion_limits

pytestmark = [allow_lark, pytest.mark.newest]

ARM = load_arm('ur5')
START = np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])
RATE = 100.0  # Hz
LIMITS = motion_limits(ARM, ServoSettings(**{option.name: option.default for option in SERVO_OPTIONS}), 1.0)
PATIENT = {'command_timeout': 1.0, 'servo.joint_states_timeout': 0.0}  # s; on a busy machine too


class ServoClient(Client):
    """A client that sends twists and keeps every command and status."""

    def __init__(self, node, name: str = topics.NODE_NAME) -> None:
        self.commands: list[np.ndarray] = []
        self.mute = False  # the robot sends no joint states
        self.trajectories, self.positions, self.servo = [], [], []
        super().__init__(node, name)
        # Deep enough that no command is lost while this process gets no processor: the judge takes each for a period.
        self._subscribe(replace(topics.SOLUTION, depth=1000), self._on_command)
        self._subscribe(topics.JOINT_TRAJECTORY, self.trajectories.append)
        self._subscribe(topics.POSITION_COMMANDS, self.positions.append)
        self._subscribe(topics.SERVO_STATUS, lambda message: self.servo.append(message.status[0]))
        self.obstacles = self._publisher(topics.OBSTACLES)
        self._twists = self._publisher(topics.TARGET_TWIST)
        self._pause = self.node.create_client(SetBool, f'{self.name}/pause')

    def _on_command(self, message) -> None:
        self.commands.append(np.array(message.position))

    def twist(self, linear=(0.0, 0.0, 0.0), angular=(0.0, 0.0, 0.0), frame='', stamp=0) -> None:
        message = TwistStamped()
        message.header.frame_id, message.header.stamp.sec = frame, stamp
        message.twist.linear.x, message.twist.linear.y, message.twist.linear.z = linear
        message.twist.angular.x, message.twist.angular.y, message.twist.angular.z = angular
        self._twists.publish(message)

    def keep_moving(self, until, what: str, **twist) -> None:
        """Send a twist again and again until something holds."""
        deadline = time.monotonic() + TIMEOUT
        while not until():
            self.twist(**twist)
            if self.commands and not self.mute:  # as a robot that obeys
                self.send_joint_state(joint_state(ARM.joint_names, self.commands[-1]))
            before = time.monotonic()
            self.wait_for(lambda since=before: time.monotonic() > since + 0.02, 'a little time')
            assert time.monotonic() < deadline, what

    def pause(self, paused: bool) -> str:
        return self._call(self._pause.call_async(SetBool.Request(data=paused))).message

    def await_label(self, label: str) -> str:
        """Wait for a status of the servo with this label; return its message."""
        self.servo.clear()
        self.wait_for(lambda: self.servo and values(self.servo[-1])['label'] == label, label)
        return self.servo[-1].message


@pytest.fixture(scope='module')
def running(tmp_path_factory):
    """One node and one client for all tests of this file."""
    with connected(ServoClient, tmp_path_factory.mktemp('node') / 'log') as client:
        yield client


@pytest.fixture
def client(running):
    """The client of a node that streams for an arm that stands at START, and has not commanded anything."""
    running.set_parameters(DEFAULTS | {'robot': 'planar3r'})  # another robot: the last command is forgotten
    running.set_parameters(DEFAULTS | PATIENT | {'robot': 'ur5', 'command_rate': RATE})
    running.pause(False)
    running.mute = False
    running.send_joint_state(joint_state(ARM.joint_names, START))
    for messages in (running.commands, running.trajectories, running.positions, running.servo):
        messages.clear()
    return running


def ball(center, action=Marker.ADD) -> MarkerArray:
    """Return an obstacle of 0.1 m in diameter."""
    marker = Marker(ns='ball', type=Marker.SPHERE, action=action)
    marker.scale.x = marker.scale.y = marker.scale.z = 0.1
    marker.pose.position.x, marker.pose.position.y, marker.pose.position.z = map(float, center)
    marker.pose.orientation.w = 1.0
    return MarkerArray(markers=[marker])


def moved(client) -> float:
    return float(np.abs(client.commands[-1] - client.commands[0]).max()) if client.commands else 0.0


def test_without_a_rate_a_twist_moves_nothing_and_poses_are_answered_as_ever(client):
    client.set_parameters({'command_rate': 0.0})
    client.twist(linear=(0.1, 0.0, 0.0))
    assert client.solve(pose_of(ARM.forward(START + 0.1)), TIMEOUT).joints
    client.wait_for(lambda: client.commands, 'the answer')  # it comes to this subscription after the other
    assert len(client.commands) == 1


def test_a_twist_becomes_a_smooth_stream_in_all_forms_that_ends_when_it_ends(client):
    client.set_parameters({'command_timeout': 0.1})
    client.keep_moving(lambda: moved(client) > 0.1, 'no motion', linear=(0.0, 0.05, 0.05))
    message = client.await_label('commands_stopped')
    assert 'no twist for more than 0.1 s' in message
    count = len(client.commands)
    client.wait_for(lambda: len(client.commands) > count + 100, 'the stream goes on')
    assert np.allclose(client.commands[0], START, atol=1e-3)
    assert np.allclose(client.commands[-1], client.commands[-10], atol=1e-9)
    assert_within_limits(client.commands, LIMITS, 1.0 / RATE)
    assert client.positions and client.trajectories
    (point,) = client.trajectories[-1].points
    assert any(np.array_equal(point.positions, q) for q in client.commands) and len(point.velocities) == ARM.n
    assert point.time_from_start.nanosec == pytest.approx(1e9 / RATE, abs=1)


def test_a_twist_in_the_axes_of_the_tip_goes_along_them(client):
    axis = pinocchio_tip(ARM, START)[:3, 2]
    client.keep_moving(lambda: moved(client) > 0.1, 'no motion', linear=(0.0, 0.0, 0.05), frame=ARM.tip_frame)
    way = (pinocchio_tip(ARM, client.commands[-1]) - pinocchio_tip(ARM, START))[:3, 3]
    assert np.linalg.norm(way - (way @ axis) * axis) < 1e-3 < way @ axis


def test_a_pose_takes_the_arm_from_a_twist_and_is_reached_within_the_limits(client):
    client.keep_moving(lambda: moved(client) > 0.05, 'no motion', linear=(0.0, 0.05, 0.0))
    goal = ARM.forward(START + 0.2)
    reply = client.solve(pose_of(goal), TIMEOUT)
    assert reply.solved and reply.published == 'stream'
    client.wait_for(
        lambda: np.abs(pinocchio_tip(ARM, client.commands[-1]) - goal).max() < 1e-4, 'the arm gets there'
    )
    client.await_label('standing')
    assert_within_limits(client.commands, LIMITS, 1.0 / RATE)


def test_a_pause_halts_refuses_and_goes_on_with_the_next_command(client):
    client.keep_moving(lambda: moved(client) > 0.05, 'no motion', linear=(0.0, 0.05, 0.0))
    assert 'halts' in client.pause(True)
    client.await_label('paused')
    client.wait_for(lambda: np.allclose(client.commands[-1], client.commands[-5], atol=1e-9), 'the arm stands')
    stood = client.commands[-1]
    reply = client.solve(pose_of(ARM.forward(START)), TIMEOUT)
    assert 'paused' in reply.figures['notes'] and reply.published == 'nothing'
    client.twist(linear=(0.0, 0.05, 0.0))
    assert np.array_equal(client.commands[-1], stood)
    client.pause(False)
    client.keep_moving(lambda: np.abs(client.commands[-1] - stood).max() > 0.05, 'no motion', linear=(0.0, -0.05, 0.0))
    assert_within_limits(client.commands, LIMITS, 1.0 / RATE)


def test_a_change_of_parameters_in_motion_is_no_leap(client):
    client.keep_moving(lambda: moved(client) > 0.05, 'no motion', linear=(0.0, 0.05, 0.0))
    for change in ({'method': 'sdls'}, {'velocity_scale': 0.5}, {'servo.max_jerk': 50.0}, {'robot': 'ur5'}):
        before = len(client.commands)
        client.set_parameters(change)
        client.keep_moving(
            lambda before=before: len(client.commands) > before + 30, 'no stream', linear=(0.0, 0.05, 0.0)
        )
    assert_within_limits(client.commands, LIMITS, 1.0 / RATE)


@pytest.mark.parametrize(
    ('twist', 'why'),
    [
        ({'linear': (np.nan, 0.0, 0.0)}, 'expected numbers'),
        ({'linear': (1e9, 0.0, 0.0)}, 'expected numbers'),
        ({'frame': 'nowhere'}, 'nowhere'),
        ({'stamp': 1}, 'old; command_timeout'),
    ],
)
def test_a_twist_that_cannot_be_meant_is_refused_with_a_reason(client, twist, why):
    client.servo.clear()
    client.keep_moving(
        lambda: any(values(status)['label'] == 'refused' and why in status.message for status in client.servo),
        'no refusal',
        **{'linear': (0.0, 0.05, 0.0)} | twist,
    )
    assert not client.commands or moved(client) == 0.0


def test_a_pose_without_a_solution_is_said_until_the_next_one_that_has_one(client):
    near, far = ARM.forward(START), ARM.forward(START)
    near[2, 3] += 0.02
    far[0, 3] += 5.0
    client.send(pose_of(near))
    client.await_label('standing')
    client.send(pose_of(far))
    assert 'the last pose: ' in (said := client.await_label('refused')) and 'reach' in said
    client.send(pose_of(near))
    client.await_label('standing')
    assert_within_limits(client.commands, LIMITS, 1.0 / RATE)


def test_when_joint_states_stop_the_arm_halts_and_says_so(client):
    client.set_parameters({'servo.joint_states_timeout': 0.2})
    client.send_joint_state(joint_state(ARM.joint_names, START))
    client.mute = True
    client.keep_moving(
        lambda: client.servo and values(client.servo[-1])['label'] == 'joint_states_stopped', 'no halt',
        linear=(0.0, 0.05, 0.0),
    )  # fmt: skip
    assert 'no joint state for more than 0.2 s' in client.servo[-1].message
    assert_within_limits(client.commands, LIMITS, 1.0 / RATE)


def test_the_stream_halts_before_an_obstacle_and_goes_on_when_it_is_gone(client):
    urdf, srdf, tip = UR5
    arm = load_arm(urdf, tip=tip, srdf=srdf)
    client.set_parameters({**DEFAULTS, **PATIENT, 'robot': str(urdf), 'srdf': str(srdf), 'tip_frame': tip,
                           'command_rate': RATE})  # fmt: skip
    client.send_joint_state(joint_state(ARM.joint_names, START))
    client.commands.clear()
    below = arm.forward(START)[:3, 3] - (0.0, 0.0, 0.25)
    client.obstacles.publish(ball(below))
    client.servo.clear()
    client.keep_moving(
        lambda: client.servo and values(client.servo[-1])['label'] == 'halted_contact', 'no halt',
        linear=(0.0, 0.0, -0.1),
    )  # fmt: skip
    assert 'ball/0' in client.servo[-1].message
    world = World(obstacles=(Obstacle('ball', 'sphere', [0.05], pin.SE3(np.eye(3), below)),))
    assert all(arm.contacts.is_clear(q, 0.0, world) for q in client.commands)
    assert_within_limits(client.commands, LIMITS, 1.0 / RATE)
    client.obstacles.publish(ball(below, Marker.DELETE))
    client.keep_moving(
        lambda: arm.forward(client.commands[-1])[2, 3] < below[2] + 0.02, 'no motion', linear=(0.0, 0.0, -0.1)
    )
    client.set_parameters({'command_rate': 0.0, 'srdf': '', 'robot': 'ur5', 'tip_frame': ''})
