"""The real node over real DDS, in a process of its own: what goes in, what comes out."""

from __future__ import annotations

import re
import signal
import subprocess
import sys

import numpy as np
import pinocchio as pin
import pytest
from chains import pinocchio_tip
from numerics import random_rotation
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from ros_helpers import (
    DEFAULTS,
    ROOT,
    START_TIMEOUT,
    TIMEOUT,
    Client,
    TraceClient,
    allow_lark,
    connected,
    joint_state,
    node_process,
    pose_of,
    seconds_to_end,
    stamp_of,
    wait_until_ready,
)

from ros_ik_pkg.ik import METHODS, TRACE_COLUMNS, load_arm
from ros_ik_pkg.ros.input.pose import stamp_text
from ros_ik_pkg.ros.interface import topics

pytestmark = allow_lark

POSITION = 1e-5  # m, the default tolerances
ORIENTATION = 1e-5  # rad
ROUNDING = 1e-12
STOP_TIMEOUT = 2.0  # s, what the node promises
FAR = np.array([[1.0, 0, 0, 9.0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])

LINK = '<link name="{}"/>'
HINGE = (
    '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="0 0 0.3"/>'
    '<axis xyz="{3}"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>'
)
FORK = '<robot name="fork">{}</robot>'.format(
    ''.join(LINK.format(name) for name in ('body', 'l1', 'l2', 'r1', 'r2'))
    + HINGE.format('left_a', 'body', 'l1', '0 1 0')
    + HINGE.format('left_b', 'l1', 'l2', '1 0 0')
    + HINGE.format('right_a', 'body', 'r1', '0 1 0')
    + HINGE.format('right_b', 'r1', 'r2', '1 0 0')
)


@pytest.fixture(scope='module')
def running(tmp_path_factory):
    """One node and one client for all tests of this file."""
    with connected(TraceClient, tmp_path_factory.mktemp('node') / 'log') as client:
        yield client


@pytest.fixture
def client(running):
    """The client, the node at its defaults, the joint states of the puma560 at home known."""
    running.set_parameters(DEFAULTS)
    arm = load_arm('puma560')
    home = joint_state(arm.joint_names, arm.home)
    running.settle(pose_of(arm.forward(arm.home)), lambda reply: reply.figures.get('iterations') == '0', home)
    return running


@pytest.fixture(scope='module')
def arm():
    return load_arm('puma560')


def reachable(arm, count, seed=0):
    """Return so many configurations inside the limits."""
    share = np.random.default_rng(seed).uniform(0.1, 0.9, (count, arm.n))
    return arm.lower + share * (arm.upper - arm.lower)


def errors(arm, reply, target):
    """Return distance [m] and angle [rad] of a reply from its target, by Pinocchio."""
    pose = pinocchio_tip(arm, [reply.joints[name] for name in arm.joint_names])
    cosine = (np.trace(target[:3, :3] @ pose[:3, :3].T) - 1.0) / 2.0
    sine = np.linalg.norm(target[:3, :3] - pose[:3, :3]) / np.sqrt(8.0)
    return np.linalg.norm(target[:3, 3] - pose[:3, 3]), np.arctan2(2.0 * sine, 1.0 + cosine)


def assert_solved(arm, reply, target):
    assert reply.solved, reply.message
    distance, angle = errors(arm, reply, target)
    assert distance <= POSITION + ROUNDING and angle <= 1.01 * ORIENTATION
    q = np.array([reply.joints[name] for name in arm.joint_names])
    assert (arm.lower <= q).all() and (q <= arm.upper).all()


def test_reachable_targets_are_solved_within_tolerance_and_limits(client, arm):
    for q in reachable(arm, 10):
        target = arm.forward(q)
        assert_solved(arm, client.solve(pose_of(target), TIMEOUT), target)


@pytest.mark.parametrize('method', METHODS)
def test_a_method_switched_over_the_service_is_used_from_the_next_target_on(client, arm, method):
    client.set_parameters({'method': method, 'max_iterations': 5000, 'deadline': 2.0})
    target = arm.forward(arm.home + 0.1)
    reply = client.solve(pose_of(target), TIMEOUT)
    assert reply.figures['method'] == method
    assert_solved(arm, reply, target)


def test_the_task_is_what_the_parameters_say(client, arm):
    task = {'task_frame': 'tip', 'task_weights': [1, 1, 1, 1, 1, 0], 'task_tolerances': [0.0, 0.0, 0.02, 0.0, 0.0, 0.0]}
    client.set_parameters(task)
    for q in reachable(arm, 10, seed=3):
        target = arm.forward(q)
        reply = client.solve(pose_of(target), TIMEOUT)
        assert reply.solved, reply.message
        pose = pinocchio_tip(arm, [reply.joints[name] for name in arm.joint_names])
        along = target[:3, :3].T @ (pose - target)[:3, 3]
        assert np.hypot(*along[:2]) <= 1.1 * POSITION and abs(along[2]) <= 0.02 + POSITION
        assert np.linalg.norm(np.cross(pose[:3, 2], target[:3, 2])) <= 1.1 * ORIENTATION
    assert 'posture has 2 numbers' in client.refusal_of(null_space='posture', posture=[0.0, 0.0])


def test_posture_brings_the_joints_of_a_seven_joint_arm_back(client):
    panda = load_arm('panda')
    client.set_parameters({'robot': 'panda', 'seed_source': 'last_solution'})
    client.set_parameters({'null_space': 'posture', 'posture': panda.home.tolist()})
    for x in (0.0, 0.1, 0.0):
        target = panda.forward(panda.home)
        target[0, 3] -= x
        reply = client.solve(pose_of(target), TIMEOUT)
        assert reply.solved, reply.message
    q = [reply.joints[name] for name in panda.joint_names]
    np.testing.assert_allclose(q, panda.home, rtol=0, atol=1e-3)


def test_every_target_gets_one_result_and_only_solved_ones_a_solution(client, arm):
    replies = [client.solve(pose_of(arm.forward(q)), TIMEOUT) for q in reachable(arm, 5, seed=1)]
    replies += [client.solve(pose_of(FAR), TIMEOUT), client.solve(pose_of(FAR, 'nowhere'), TIMEOUT)]
    assert [reply.figures['outcome'] for reply in replies] == ['solved'] * 5 + ['failed', 'refused']
    counts = {key: len(statuses) for key, statuses in client.statuses.items()}
    assert set(counts.values()) == {1}
    solved = {key for key, (status,) in client.statuses.items() if status.name == 'ik_node: solved'}
    assert {key for key, messages in client.solutions.items() if len(messages) == 1} == solved


def test_a_target_out_of_reach_fails_with_reason_and_figures(client):
    reply = client.solve(pose_of(FAR), TIMEOUT)
    assert reply.figures['outcome'] == 'failed' and not reply.joints
    assert reply.figures['status'] not in ('', 'converged')
    assert float(reply.figures['position_error']) > 1.0
    assert 'rad off' in reply.message


def test_iterations_and_trace_have_the_same_numbers_and_end_at_the_solution(client, arm):
    target = arm.forward(arm.home + 0.2)
    pose = pose_of(target)
    reply = client.solve(pose, TIMEOUT)

    def newest(messages, stamps=stamp_of, stamp=reply.stamp):
        client.wait_for(lambda: messages and stamps(messages[-1]) == stamp, 'the message of this target')
        return messages[-1]

    def stamp_in_label(message):
        return message.layout.dim[0].label.rpartition('stamp=')[2]

    trace = newest(client.traces, stamp_in_label, stamp_text(pose.header.stamp))
    statuses, path = newest(client.iterations).status, newest(client.paths)
    matrix = np.array(trace.data).reshape([dim.size for dim in trace.layout.dim])
    rows = [[float(pair.value) for pair in status.values] for status in statuses]
    np.testing.assert_array_equal(rows, matrix[:, : len(TRACE_COLUMNS)])
    assert len(rows) == int(reply.figures['iterations']) + int(reply.figures['attempts'])
    np.testing.assert_array_equal(matrix[-1, len(TRACE_COLUMNS) :], list(reply.joints.values()))
    last = path.poses[-1].pose.position
    np.testing.assert_allclose([last.x, last.y, last.z], target[:3, 3], atol=2 * POSITION)
    assert path.header.frame_id == arm.base_frame


def test_targets_may_be_given_in_any_frame_of_the_robot(client, arm):
    target = arm.forward(arm.home + 0.1)
    for frame in (arm.base_frame, f'/{arm.base_frame}', 'link3', arm.tip_frame):
        known = dict(zip(arm.joint_names, arm.home))
        base_from_frame = arm.base_from_frame(frame.removeprefix('/'), known)
        reply = client.solve(pose_of(np.linalg.solve(base_from_frame, target), frame), TIMEOUT)
        assert_solved(arm, reply, target)


def test_seeds_outside_the_limits_and_quaternions_slightly_off_are_mended_with_a_note(client, arm):
    pose = pose_of(arm.forward(arm.home))
    pose.pose.orientation.w *= 1.004
    pose.pose.orientation.x *= 1.004
    pose.pose.orientation.y *= 1.004
    pose.pose.orientation.z *= 1.004
    outside = joint_state(arm.joint_names, arm.upper + 1.0)
    reply = client.settle(pose, lambda reply: 'seed outside' in reply.figures['notes'], outside)
    assert reply.solved
    assert 'quaternion of norm 1.004 normalised' in reply.figures['notes']


def test_an_answer_too_far_from_the_joint_state_is_not_published_whatever_the_seed(client, arm):
    far = arm.home + 0.5
    client.set_parameters({'seed_source': 'home', 'max_joint_jump': 0.4})
    near = client.solve(pose_of(arm.forward(arm.home + 0.2)), TIMEOUT)
    assert near.figures['outcome'] == 'solved' and float(near.figures['joint_distance']) <= 0.4
    # The seed stays at home, the arm moves on: what was near is far now.
    reply = client.settle(
        pose_of(arm.forward(arm.home)),
        lambda reply: reply.figures['outcome'] == 'failed',
        joint_state(arm.joint_names, far),
    )
    assert reply.figures['status'] == 'joint_jump' and not reply.joints


def test_the_last_solution_can_be_the_seed(client, arm):
    client.set_parameters({'seed_source': 'last_solution'})
    pose = pose_of(arm.forward(arm.home + 0.3))
    assert client.solve(pose, TIMEOUT).solved
    assert int(client.solve(pose, TIMEOUT).figures['iterations']) <= 1  # one step that refines it


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'method': 'nonsense'}, ['method', "'nonsense'", 'sdls']),
        ({'max_iterations': -1}, ['max_iterations', '-1', '100000']),
        ({'method': 'pinv', 'dls.damping': 'much'}, ['dls.damping', "'much'", 'from 0 to 100']),
        ({'method': 'pinv', 'robot': 'no_such_arm'}, ['no_such_arm', 'puma560']),
        ({'method': 'pinv', 'tip_frame': 'no_such_frame'}, ['tip_frame', 'no_such_frame', 'link3']),
        ({'method': 'pinv', 'no_such_parameter': 1}, ['no_such_parameter']),
    ],
)
def test_a_refused_change_names_what_is_wrong_and_changes_nothing(client, arm, change, words):
    reason = client.refusal_of(**change)
    assert all(word in reason for word in words), reason
    assert client.parameter('method') == 'adaptive_dls'
    reply = client.solve(pose_of(arm.forward(arm.home + 0.1)), TIMEOUT)
    assert reply.solved and reply.figures['method'] == 'adaptive_dls'


def test_an_integer_is_taken_for_a_number_and_kept_as_one(client):
    client.set_parameters({'step_size': 1, 'task_weights': [1, 1, 1, 1, 1, 1]})
    assert client.parameter_type('step_size') == Parameter.Type.DOUBLE.value
    assert client.parameter_type('task_weights') == Parameter.Type.DOUBLE_ARRAY.value


def test_a_value_of_the_wrong_type_leaves_the_type_as_it_was(client):
    assert 'step_size' in client.set_one(Parameter('step_size', value='fast'))
    assert client.parameter_type('step_size') == Parameter.Type.DOUBLE.value
    assert 'method' in client.set_one(Parameter('method', value=None))
    assert client.parameter('method') == 'adaptive_dls'


def test_the_robot_can_be_changed_while_targets_come(client):
    for name in ('ur5', 'panda'):
        other = load_arm(name)
        client.set_parameters({'robot': name, 'seed_source': 'home'})
        target = other.forward(other.home + 0.05)
        reply = client.solve(pose_of(target), TIMEOUT)
        assert reply.status.hardware_id == other.name
        assert_solved(other, reply, target)


def test_five_joints_by_name_answer_full_poses_and_say_how_near_they_came(client):
    so101, rng = load_arm('so101'), np.random.default_rng(2)
    client.set_parameters({'robot': 'so101', 'seed_source': 'home', 'deadline': 2.0})
    for q in reachable(so101, 10, seed=5):
        target = so101.forward(q)
        target[:3, :3] = random_rotation(rng)
        reply = client.solve(pose_of(target), TIMEOUT)
        assert reply.solved, reply.message
        pose = pinocchio_tip(so101, np.array([reply.joints[name] for name in so101.joint_names]))
        angle = np.linalg.norm(pin.log3(target[:3, :3] @ pose[:3, :3].T))
        assert np.linalg.norm(target[:3, 3] - pose[:3, 3]) <= POSITION + ROUNDING
        assert (reply.figures['demanded_rows'], reply.figures['wished_rows']) == ('x y z', 'rx ry rz')
        assert float(reply.figures['wished_orientation_error']) == pytest.approx(angle, abs=1e-6)
        assert 'in those wished for, rx ry rz, ' in reply.message


def test_a_robot_with_fewer_joints_than_the_lists_have_numbers_is_refused_with_the_way_out(client):
    client.set_parameters({'robot': 'panda', 'posture': [0.1] * 7, 'joint_weights': [1.0] * 7})
    expected = "robot 'ur5': joint_weights has 7 numbers; expected 6, one for each joint, or none: for another"
    assert expected in client.refusal_of(robot='ur5')
    client.set_parameters({'robot': 'ur5', 'posture': [], 'joint_weights': [1.0] * 6})


def test_the_robot_and_its_frames_can_be_changed_one_at_a_time(client, tmp_path):
    fork = tmp_path / 'fork.urdf'
    fork.write_text(FORK)
    client.set_parameters({'tip_frame': 'wrist', 'seed_source': 'home'})
    assert 'wrist' in client.set_one(Parameter('robot', value='ur5'))
    assert not client.set_one(Parameter('tip_frame', value=''))
    assert 'several possible tips' in client.set_one(Parameter('robot', value=str(fork)))
    for name, value in (('robot', ''), ('tip_frame', 'r2'), ('robot', str(fork))):
        assert not client.set_one(Parameter(name, value=value))
    right = load_arm(FORK, tip='r2')
    reply = client.solve(pose_of(right.forward(np.array([0.3, -0.4]))), TIMEOUT)
    assert reply.status.hardware_id == 'fork' and list(reply.joints) == ['right_a', 'right_b']


def test_in_a_namespace_a_robot_description_comes_by_topic_late_or_broken(running, tmp_path):
    log = tmp_path / 'log'
    left = load_arm(FORK, tip='l2')
    pose = pose_of(left.forward(np.array([0.3, -0.4])))
    arguments = ['-r', '__ns:=/left', '-p', "robot:=''", '-p', 'tip_frame:=l2', '-p', 'seed_source:=home']
    with node_process(log, *arguments) as process:
        client = Client(running.node, '/left/ik_node')
        wait_until_ready(process, log, 'no robot yet')
        client.connect()
        message = client.solve(pose, TIMEOUT).message
        assert message.startswith('no robot yet: no URDF came on topic /left/robot_description')
        client.send_description('<robot name="broken"><link')
        # The reason stays in what is said from now on.
        client.wait_for(lambda: 'well-formed' in client.solve(pose, TIMEOUT).message, 'a refusal with the reason')
        reason = 'no robot yet: topic /left/robot_description: line 1, column 22: not well-formed XML'
        assert client.solve(pose, TIMEOUT).message.startswith(reason)
        client.health.clear()
        client.wait_for(lambda: any(reason in status.message for status in client.health), 'health with the reason')
        assert 'ready: ' not in log.read_text()
        client.send_description(FORK)
        client.wait_for(lambda: client.solve(pose, TIMEOUT).solved, 'a solution with the robot of the topic')
        assert 'ready: arm fork' in log.read_text()
        for text, complaint in (('<robot name="broken"><link', 'not well-formed XML'), ('', "the text is ''")):
            complained = f'topic /left/robot_description: .*{complaint}.*; keeping fork'
            # Once a second at most there is a line about it, so it may take more than one.
            client.wait_for(
                lambda text=text, complained=complained: client.send_description(text)
                or (client.solve(pose, TIMEOUT) and re.search(complained, log.read_text())),
                complained,
            )
            assert client.solve(pose, TIMEOUT).solved
        client.set_parameters({'tip_frame': 'r2'})
        assert list(client.solve(pose, TIMEOUT).joints) == ['right_a', 'right_b']


def test_partial_joint_states_fill_in(client, arm):
    other = load_arm('ur5')
    client.set_parameters({'robot': 'ur5'})
    first, second = (joint_state(other.joint_names[k::2], other.home[k::2]) for k in (0, 1))
    pose = pose_of(other.forward(other.home))
    reply = client.settle(pose, lambda reply: 'no position yet' in reply.message, first)
    assert other.joint_names[1] in reply.message and other.joint_names[0] not in reply.message
    assert client.settle(pose, lambda reply: reply.solved, second).figures['iterations'] == '0'


def test_of_a_burst_the_newest_target_is_solved_and_none_after_a_newer_one(client, arm):
    poses = [pose_of(arm.forward(q)) for q in reachable(arm, 300, seed=2)]
    known = set(client.statuses)
    for number, pose in enumerate(poses):
        pose.header.stamp.sec, pose.header.stamp.nanosec = 1, number
        client.send(pose)
    client.wait_for(lambda: (1, len(poses) - 1) in client.statuses, 'a result for the newest target')
    order = [key for key in client.statuses if key not in known]
    assert order == sorted(order)


def test_iterations_come_for_every_target_that_leaves_time_and_for_the_newest_of_a_flood(client, arm):
    client.iterations.clear()
    poses = [pose_of(arm.forward(q)) for q in reachable(arm, 30, seed=4)]
    for pose in poses:
        client.solve(pose, TIMEOUT)
        client.wait_for(lambda pose=pose: stamp_of(pose) in map(stamp_of, client.iterations), 'iterations')
    sent = 0
    client.health.clear()
    client.iterations.clear()

    def keep_sending_until_some_are_dropped():
        nonlocal sent
        sent += 1
        poses[0].header.stamp.sec, poses[0].header.stamp.nanosec = 2, sent
        client.send(poses[0])
        return client.health_figure('reports_dropped') > 0

    client.wait_for(keep_sending_until_some_are_dropped, 'a count of what was dropped')
    client.wait_for(lambda: (2, sent) in map(stamp_of, client.iterations[-1:]), 'the newest iterations')
    client.wait_for(lambda: (2, sent) in client.statuses, 'the newest result')
    assert len(client.iterations) <= sent - client.health_figure('reports_dropped')


def test_health_is_reported_with_rates_and_reasons(client, arm):
    def has(key):
        return any(pair.key == key for status in client.health for pair in status.values)

    client.health.clear()
    client.solve(pose_of(FAR, 'nowhere'), TIMEOUT)
    client.wait_for(lambda: has('refused.frame'), 'health that counts the refused target')
    figures = {pair.key for pair in client.health[-1].values}
    assert {'targets_per_second', 'solved_per_second', 'latency_p99', 'solve_time_p50'} <= figures


def test_the_topics_of_the_table_are_those_of_the_node(client):
    node, sets = client.node, {'in': set(), 'out': set()}

    def all_seen():  # what DDS tells comes bit by bit
        if ('ik_node', '/') in node.get_node_names_and_namespaces():
            sets['in'] = set(dict(node.get_subscriber_names_and_types_by_node('ik_node', '/')))
            sets['out'] = set(dict(node.get_publisher_names_and_types_by_node('ik_node', '/')))
        return all(topic.of('/ik_node') in sets[topic.direction] for topic in topics.TOPICS)

    client.wait_for(all_seen, 'all topics of the table')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_node_in_time_without_a_word(tmp_path, number):
    log = tmp_path / 'log'
    with node_process(log) as process:
        wait_until_ready(process, log)
        process.send_signal(number)
        assert seconds_to_end(process) < STOP_TIMEOUT
    assert process.returncode == 0
    assert 'Traceback' not in log.read_text()


@pytest.mark.parametrize(
    ('arguments', 'code', 'words'),
    [
        (['-p', 'max_iterations:=-1'], 2, ['max_iterations', '-1', '100000']),
        (['-p', 'method:=5'], 2, ['method', '5', 'sdls']),
        (['-p', 'robot:=no_such_arm'], 1, ['no_such_arm', 'puma560']),
        (['-p', 'tip_frame:=no_such_frame'], 1, ['tip_frame', 'no_such_frame']),
        (['--params-file', '/no/such/file.yaml'], 1, ['/no/such/file.yaml']),
    ],
)
def test_a_start_with_wrong_parameters_ends_with_a_reason(arguments, code, words):
    command = [sys.executable, '-m', 'ros_ik_pkg.ros.ik_node', '--ros-args', *arguments]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=START_TIMEOUT)
    assert ended.returncode == code
    assert all(word in ended.stderr for word in words), ended.stderr
    assert 'Traceback' not in ended.stderr


ENDLESS = """
import rclpy
from ros_ik_pkg.ik import ModelError
from ros_ik_pkg.ros import node
class Endless:
    def __init__(self, report): print('began')
    def close(self): print('ended')
node.Compilation = Endless
rclpy.init(args=['--ros-args', '-p', 'robot:=no_such_arm'])
try:
    node.IkNode()
except ModelError:
    print('refused')
"""


def test_a_start_with_wrong_parameters_ends_what_still_compiles():
    command = [sys.executable, '-c', ENDLESS]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=START_TIMEOUT)
    assert ended.stdout.split() == ['began', 'ended', 'refused'], ended.stderr


def test_the_shipped_parameters_file_starts_the_node_and_a_slip_in_a_name_is_told(tmp_path):
    log = tmp_path / 'log'
    file = str(ROOT / 'config' / 'ik_node.yaml')
    with node_process(log, '--params-file', file, '-p', 'max_iteration:=5') as process:
        wait_until_ready(process, log)
    assert 'max_iteration is not known and ignored; did you mean max_iterations?' in log.read_text()


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (['--robot', 'panda'], "'--robot'; a parameter is set by --ros-args -p robot:=panda"),
        (['--robot=panda'], '--ros-args -p robot:=panda'),
        (['robot:=panda'], '--ros-args -p robot:=panda'),  # by itself it is a remapping, of nothing
        (['--ros-args', '-p', 'robot:=ur5', '--', 'panda'], "unknown argument 'panda'"),
    ],
)
def test_an_argument_that_is_not_for_ros_is_refused_with_what_to_write(arguments, words):
    ended = run_to_its_end(*arguments)
    assert ended.returncode == 2 and words in ended.stderr and ended.stderr.count('\n') == 1


def test_help_says_how_to_set_parameters_and_starts_nothing():
    ended = run_to_its_end('--help')
    assert ended.returncode == 0 and '--ros-args -p robot:=panda' in ended.stdout and not ended.stderr


def run_to_its_end(*arguments):
    """Run the node's program, which must end by itself."""
    command = [sys.executable, '-m', 'ros_ik_pkg.ros.ik_node', *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=START_TIMEOUT)


def test_a_start_that_fails_is_in_the_ros_log_too(tmp_path, monkeypatch):
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path))
    assert run_to_its_end('--ros-args', '-p', 'robot:=no_such_arm').returncode == 1
    (log,) = tmp_path.glob('*.log')
    assert 'cannot start: ' in log.read_text() and 'no_such_arm' in log.read_text()


def test_numbers_that_come_as_text_are_taken_as_ros2_param_load_sends_them(client):
    # A stand-in for `ros2 param load`: it writes values as text and reads them as YAML 1.1, in which 1e-05 is text; a
    # list of whole and other numbers it sends as one text.
    lists = '[1.0, 1, 1e-05, 1, 1, 0.0]'
    for name, text, value in (('position_tolerance', '1e-05', 1e-5), ('task_weights', lists, [1, 1, 1e-5, 1, 1, 0])):
        assert not client.set_one(Parameter(name, value=text))
        assert client.parameter(name) == value
    assert client.parameter_type('position_tolerance') == Parameter.Type.DOUBLE.value
    assert client.parameter_type('task_weights') == Parameter.Type.DOUBLE_ARRAY.value


def test_a_list_of_whole_numbers_is_refused_as_a_list(client):
    assert 'task_weights = [1, 1, 1] is not allowed' in client.set_one(Parameter('task_weights', value=[1, 1, 1]))


def test_velocities_of_another_length_are_noted_once_and_the_positions_taken(client, arm):
    state = joint_state(arm.joint_names, arm.home + 0.05)
    state.velocity = [0.0, 0.0]
    pose = pose_of(arm.forward(arm.home + 0.05))
    reply = client.settle(pose, lambda reply: '2 velocities' in reply.figures['notes'], state)
    assert reply.solved and reply.figures['iterations'] == '0'
    client.send_joint_state(state)
    assert client.solve(pose, TIMEOUT).figures['notes'] == ''


def test_a_solution_for_a_target_of_stamp_zero_has_the_time_of_now_and_its_result_the_stamp(client, arm):
    before = client.node.get_clock().now().seconds_nanoseconds()
    pose = pose_of(arm.forward(arm.home + 0.1))
    for stamps in (client.solutions, client.statuses):
        stamps.pop((0, 0), None)
    known = set(client.solutions)
    client.send(pose)
    client.wait_for(lambda: client.statuses.get((0, 0)) and set(client.solutions) - known, 'a result and a solution')
    (stamp,) = set(client.solutions) - known
    assert before <= stamp <= client.node.get_clock().now().seconds_nanoseconds()


def test_the_node_has_one_name_in_all_statuses(client, arm):
    client.health.clear()
    reply = client.solve(pose_of(arm.forward(arm.home)), TIMEOUT)
    client.wait_for(lambda: client.health, 'health')
    assert (reply.status.name, client.health[-1].name) == ('ik_node: solved', 'ik_node: health')


def test_a_robot_on_the_topic_is_said_once_to_be_ignored_if_a_parameter_names_another(running, tmp_path):
    log = tmp_path / 'log'
    arguments = ['-r', '__ns:=/named', '-p', 'robot:=ur5', '-p', 'seed_source:=home']
    with node_process(log, *arguments) as process, Client(running.node, '/named/ik_node') as client:
        wait_until_ready(process, log)
        client.connect()
        client.wait_for(lambda: client.send_description(FORK) or 'is ignored' in log.read_text(), 'that it is ignored')
        client.send_description(FORK.replace('right_a', 'right_c'))  # the same robot, published anew
        client.set_parameters({'robot': '', 'tip_frame': 'l2'})
        assert client.solve(pose_of(np.eye(4)), TIMEOUT).status.hardware_id == 'fork'
    said = log.read_text()
    assert said.count("robot 'fork' on topic /named/robot_description is ignored: parameter robot = 'ur5'") == 1
    assert "to follow the topic, set robot and robot_description to ''" in said


def test_no_robot_is_said_once_when_the_description_is_taken_away_and_comes_back(running, tmp_path):
    log = tmp_path / 'log'
    arguments = ['-r', '__ns:=/away', '-p', "robot:=''", '-p', f'robot_description:={FORK}', '-p', 'tip_frame:=l2']
    with node_process(log, *arguments) as process, Client(running.node, '/away/ik_node') as client:
        wait_until_ready(process, log)
        client.connect()
        client.set_parameters({'robot_description': ''})
        client.health.clear()
        client.wait_for(lambda: len(client.health) > 1, 'two health reports')
        client.set_parameters({'robot_description': FORK})
    assert log.read_text().count('no robot yet') == 1


@pytest.mark.filterwarnings('ignore:Deprecated in favor of:DeprecationWarning')  # rclpy of Kilted calls its own warn()
def test_a_best_effort_publisher_of_targets_is_heard_with_the_override_that_the_warning_names(running, tmp_path):
    name, override = '/deaf/ik_node', 'qos_overrides./deaf/target_pose.subscription.reliability:=best_effort'
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    targets = running.node.create_publisher(topics.TARGET_POSE.type, topics.TARGET_POSE.of(name), best_effort)
    log, pose = tmp_path / 'log', pose_of(np.eye(4))
    arguments = ['-r', '__ns:=/deaf', '-p', 'seed_source:=home']
    try:
        with node_process(log, *arguments) as process:
            wait_until_ready(process, log)
            running.wait_for(lambda: f'start the node with -p {override}' in log.read_text(), 'advice')
        with node_process(log, *arguments, '-p', override) as process, Client(running.node, name) as client:
            wait_until_ready(process, log)
            client.connect()
            client.wait_for(lambda: targets.publish(pose) or client.statuses, 'an answer')
            assert client.solve(pose, TIMEOUT).message  # a reliable publisher is heard as before
        assert 'not known' not in log.read_text()
    finally:
        running.node.destroy_publisher(targets)
