"""Bad messages and parameters over DDS: each has its reason, and the next good target is solved."""

from __future__ import annotations

import importlib.util
import math

import numpy as np
import pytest
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from ros_helpers import DEFAULTS, TIMEOUT, Client, allow_lark, connected, joint_state, pose_of

from ros_ik_pkg.ik import load_arm

pytestmark = allow_lark

ARM = load_arm('puma560')
NAMES = list(ARM.joint_names)
HOME = [float(value) for value in ARM.home]
GOOD_POSE = pose_of(ARM.forward(ARM.home))
NAN, INF = math.nan, math.inf


@pytest.fixture(scope='module')
def running(tmp_path_factory):
    """One node and one client for all tests of this file; no joint state was ever sent to the node."""
    with connected(Client, tmp_path_factory.mktemp('node') / 'log') as client:
        client.first = client.solve(GOOD_POSE, TIMEOUT)
        yield client


@pytest.fixture
def client(running):
    """The client of a node that is right before the test and, on the next good target, after it."""
    assert_right(running)
    yield running
    assert_right(running)


def assert_right(client) -> None:
    """Set the defaults and check that a good joint state and target are answered with home."""
    client.set_parameters(DEFAULTS)
    reply = client.settle(GOOD_POSE, lambda reply: reply.solved, joint_state(NAMES, HOME))
    np.testing.assert_array_equal([reply.joints[name] for name in NAMES], HOME)


def bad_pose(frame='', **numbers):
    """Return a good target with some numbers changed, by name such as position_x."""
    pose = pose_of(ARM.forward(ARM.home), frame)
    for name, value in numbers.items():
        part, field = name.split('_')
        setattr(getattr(pose.pose, part), field, value)
    return pose


def quaternion(x, y, z, w):
    return bad_pose(orientation_x=x, orientation_y=y, orientation_z=z, orientation_w=w)


BAD_TARGETS = {
    'x is NaN': (bad_pose(position_x=NAN), 'position is [nan'),
    'y is infinite': (bad_pose(position_y=INF), 'inf'),
    'z is minus infinite': (bad_pose(position_z=-INF), '-inf'),
    'z is huge': (bad_pose(position_z=1e300), 'beyond 1e+06 m'),
    'quaternion with NaN': (bad_pose(orientation_x=NAN), 'orientation is [nan'),
    'quaternion with infinity': (bad_pose(orientation_w=INF), 'orientation is ['),
    'quaternion of zeros': (quaternion(0.0, 0.0, 0.0, 0.0), 'norm 0;'),
    'quaternion too long': (quaternion(0.0, 0.0, 0.0, 1.5), 'norm 1.5;'),
    'quaternion too short': (quaternion(0.5, 0.0, 0.0, 0.0), 'norm 0.5;'),
    'quaternion overflows': (quaternion(1e308, 1e308, 1e308, 1e308), 'expected a unit quaternion'),
    'quaternion denormal': (quaternion(0.0, 0.0, 0.0, 5e-324), 'expected a unit quaternion'),
    'unknown frame': (bad_pose(frame='kitchen'), "'kitchen'"),
    'frame with other case': (bad_pose(frame='BASE_LINK'), "'BASE_LINK'"),
    'frame is a slash': (bad_pose(frame='//base_link'), "'/base_link'"),
    'frame of unicode': (bad_pose(frame='stół'), 'stół'),
    'frame of ten thousand letters': (bad_pose(frame='f' * 10000), 'characters)'),
}

BAD_JOINT_STATES = {
    'fewer positions than names': (joint_state(NAMES, HOME[:-1]), '6 names, 5 positions'),
    'more positions than names': (joint_state(NAMES, [*HOME, 0.0]), '6 names, 7 positions'),
    'positions without names': (joint_state([], HOME), '0 names, 6 positions'),
    'position is NaN': (joint_state(NAMES, [NAN, *HOME[1:]]), f'position nan of {NAMES[0]}'),
    'position is infinite': (joint_state(NAMES, [*HOME[:-1], INF]), f'position inf of {NAMES[-1]}'),
    'a name twice': (joint_state([*NAMES, NAMES[2]], [*HOME, 1.0]), f'{NAMES[2]} more than once'),
    'ten thousand names too many': (
        joint_state([*NAMES, *(f'x{i}' for i in range(10000))], HOME), '10006 names'),
}  # fmt: skip

BAD_PARAMETERS = {
    'unknown method': ('method', 'newton', 'one of transpose, pinv'),
    'method in capitals': ('method', 'DLS', "'DLS'"),
    'method is a number': ('method', 3, 'method = 3'),
    'iterations below zero': ('max_iterations', -1, '-1'),
    'iterations with a fraction': ('max_iterations', 10.5, '10.5'),
    'iterations beyond 64 bits of sense': ('max_iterations', 2**62, str(2**62)),
    'tolerance is zero': ('position_tolerance', 0.0, 'position_tolerance'),
    'tolerance is NaN': ('orientation_tolerance', NAN, 'orientation_tolerance'),
    'damping is infinite': ('dls.damping', INF, 'dls.damping'),
    'damping is a word': ('adaptive_dls.damping', 'small', "'small'"),
    'a flag is a number': ('respect_limits', 1, 'true or false'),
    'a flag is a text': ('home_until_joint_states', 'true', 'true or false'),
    'five weights': ('task_weights', [1.0] * 5, '6 numbers'),
    'all weights zero': ('task_weights', [0.0] * 6, 'at least one weight'),
    'weight is NaN': ('task_weights', [1.0] * 5 + [NAN], 'task_weights'),
    'weights of three joints': ('joint_weights', [1.0] * 3, 'expected 6, one for each joint'),
    'unknown seed source': ('seed_source', 'guess', 'last_solution'),
    'unknown robot': ('robot', 'r2d2', 'puma560'),
    'robot file that is not there': ('robot', '/no/such/arm.urdf', '/no/such/arm.urdf'),
    'robot is a number': ('robot', 560, 'robot = 560'),
    'description is no XML': ('robot_description', 'hello', "'hello'"),
    'description is broken XML': ('robot_description', '<robot name="x"><link', 'robot_description'),
    'description with a DOCTYPE': ('robot_description', '<!DOCTYPE x [<!ENTITY a "b">]><robot/>', 'DOCTYPE'),
    'unknown base frame': ('base_frame', 'kitchen', "'kitchen'"),
    'unknown tip frame': ('tip_frame', 'hand', "'hand'"),
    'tip above base': ('tip_frame', 'base_link', 'base_link'),
    'comparison with an unknown method': ('compare', ['dls', 'newton'], 'newton'),
    'comparison is one text': ('compare', 'dls', 'a list of'),
    'unset': ('max_iterations', None, 'max_iterations = None'),
    'undeclared': ('speed', 1.0, 'speed'),
}


def test_a_target_before_any_joint_state_is_refused(running):
    assert running.first.figures['outcome'] == 'refused'
    assert 'no message on /joint_states yet' in running.first.message


@pytest.mark.parametrize('case', BAD_TARGETS)
def test_a_bad_target_is_refused_with_its_reason(client, case):
    pose, words = BAD_TARGETS[case]
    reply = client.solve(pose, TIMEOUT)
    assert reply.figures['outcome'] == 'refused' and not reply.joints
    assert words in reply.message


@pytest.mark.skipif(importlib.util.find_spec('tf2_ros') is not None, reason='tf2_ros is installed')
def test_without_tf_the_refusal_of_an_unknown_frame_says_that_it_is_not_there(client):
    message = client.solve(bad_pose(frame='camera'), TIMEOUT).message
    assert "frame 'camera' does not exist; known: base_link" in message
    assert "TF is not available here: No module named 'tf2_ros'" in message


@pytest.mark.parametrize('case', BAD_JOINT_STATES)
def test_a_bad_joint_state_refuses_targets_with_its_reason(client, case):
    message, words = BAD_JOINT_STATES[case]
    reply = client.settle(GOOD_POSE, lambda reply: not reply.solved, message)
    assert reply.figures['outcome'] == 'refused' and not reply.joints
    assert words in reply.message


def test_a_joint_state_of_other_joints_alone_is_not_enough(client):
    other = load_arm('ur5')
    client.set_parameters({'robot': 'ur5'})
    reply = client.solve(pose_of(other.forward(other.home)), TIMEOUT)
    assert f'none of the joints: expected {other.joint_names[0]}' in reply.message


@pytest.mark.parametrize('case', BAD_PARAMETERS)
def test_a_bad_parameter_is_refused_with_its_reason(client, case):
    name, value, words = BAD_PARAMETERS[case]
    reason = client.set_one(Parameter(name, value=value))
    assert words in reason and name in reason
    if name in DEFAULTS:
        kept = client.parameter(name)
        assert (tuple(kept) if isinstance(kept, list) else kept) == DEFAULTS[name]


def test_a_parameter_of_a_type_that_ros_does_not_have_does_not_end_the_node(client):
    request = SetParameters.Request(
        parameters=[ParameterMessage(name='method', value=ParameterValue(type=77, string_value='dls'))]
    )
    client._set_one_by_one.call_async(request)
    assert_right(client)
