"""IkClient against real nodes: whose answer it is, who may call, and what happens when the node dies."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import rclpy
from chains import pinocchio_tip
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from ros_helpers import (
    CALM_ARGUMENTS,
    ROOT,
    TIMEOUT,
    allow_lark,
    node_process,
    pose_of,
    wait_until_ready,
)
from std_msgs.msg import Empty

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros import IkClient, NodeError
from ros_ik_pkg.ros.runtime.spin import spin
from ros_ik_pkg.tools.processes import ros_node, running

pytestmark = [allow_lark, pytest.mark.newest]

ARM = load_arm('puma560')
HOME = ['-p', 'seed_source:=home']
NEAR = 1.001e-5  # m; the default tolerance
COMMON_INTERFACES = (
    'actionlib_msgs', 'diagnostic_msgs', 'geometry_msgs', 'nav_msgs', 'sensor_msgs', 'shape_msgs', 'std_msgs',
    'std_srvs', 'stereo_msgs', 'trajectory_msgs', 'visualization_msgs',
)  # fmt: skip
FAR = np.eye(4) + 9.0 * np.eye(4)[:, :1] * np.eye(4)[3]  # 9 m along x


def targets(seed, count=20):
    """Return poses within reach, near home."""
    rng = np.random.default_rng(seed)
    return [ARM.forward(ARM.home + rng.uniform(-0.3, 0.3, ARM.n)) for _ in range(count)]


def distance(reply, target):
    """Return how far the tip is from the target [m], by Pinocchio."""
    assert reply.solved, reply.message
    reached = pinocchio_tip(ARM, [reply.joints[name] for name in ARM.joint_names])
    return np.linalg.norm(reached[:3, 3] - target[:3, 3])


@pytest.fixture(scope='module')
def program():
    """A program's own node."""
    with ros_node('program') as node:
        yield node


@pytest.fixture(scope='module')
def ik_node(tmp_path_factory):
    """An IK node that starts its solves from home."""
    log = tmp_path_factory.mktemp('node') / 'log'
    with node_process(log, *HOME) as process:
        wait_until_ready(process, log)
        yield process


@pytest.fixture
def client(program, ik_node):
    """A client of the node, fresh: the first solve finds the node."""
    with IkClient(program) as client:
        yield client


def test_one_call_gives_reason_figures_and_joints_by_name(client):
    (target,) = targets(seed=0, count=1)
    reply = client.solve(pose_of(target), TIMEOUT)
    assert distance(reply, target) < NEAR and set(reply.joints) == set(ARM.joint_names)
    assert float(reply.figures['position_error']) < NEAR
    far = client.solve(pose_of(FAR), TIMEOUT)
    assert not far.solved and not far.joints and 'out of reach' in far.message
    assert far.stamp > reply.stamp


def test_the_pose_is_not_written_to_and_goes_out_under_the_time_of_now(client, program):
    pose = pose_of(targets(seed=0, count=1)[0])
    before = program.get_clock().now().nanoseconds
    sec, nanosec = client.solve(pose, TIMEOUT).stamp
    assert 0 <= sec * 10**9 + nanosec - before + 10**6 < TIMEOUT * 10**9
    assert pose.header.stamp.sec == pose.header.stamp.nanosec == 0


def test_two_clients_at_once_do_not_mix_their_answers(program, ik_node):
    def largest_distance(seed):
        with IkClient(program) as client:
            return max(distance(client.solve(pose_of(target), TIMEOUT), target) for target in targets(seed))

    with ThreadPoolExecutor() as threads:
        assert max(threads.map(largest_distance, (1, 2))) < NEAR


def test_threads_that_share_a_client_take_turns(client):
    with ThreadPoolExecutor(3) as threads:
        found = threads.map(lambda target: distance(client.solve(pose_of(target), TIMEOUT), target), targets(seed=3))
        assert max(found) < NEAR


def test_a_callback_of_a_node_that_is_spun_elsewhere_may_call_solve(client, program):
    (target,), replies, done, over = targets(seed=4, count=1), [], threading.Event(), threading.Event()

    def call(_message):
        replies.append(client.solve(pose_of(target), TIMEOUT))
        done.set()

    program.create_subscription(Empty, 'call', call, 1)
    trigger, executor = program.create_publisher(Empty, 'call', 1), SingleThreadedExecutor()
    thread = threading.Thread(target=spin, args=(executor, program, over.is_set))
    thread.start()
    try:
        deadline = time.monotonic() + TIMEOUT
        while not trigger.get_subscription_count():
            assert time.monotonic() < deadline
            time.sleep(0.02)
        trigger.publish(Empty())
        assert done.wait(TIMEOUT)
    finally:
        over.set()
        thread.join()
        executor.shutdown()
    assert distance(replies[0], target) < NEAR


def test_clients_of_a_clock_that_stands_still_choose_stamps_of_their_own(ik_node, program):
    node = rclpy.create_node('simulated', parameter_overrides=[Parameter('use_sim_time', value=True)])
    with IkClient(node) as one, IkClient(node) as other:
        pose = pose_of(targets(seed=0, count=1)[0])
        stamps = [[client.solve(pose, TIMEOUT).stamp for _ in range(3)] for client in (one, other)]
    node.destroy_node()
    assert all(sorted(set(mine)) == mine for mine in stamps)
    assert not set(stamps[0]) & set(stamps[1])


def test_a_node_that_is_killed_and_started_again_is_found_again(program, tmp_path):
    pose, name = pose_of(targets(seed=0, count=1)[0]), '/again/ik_node'
    command = ['ros_ik_pkg.ros.ik_node', '--ros-args', *CALM_ARGUMENTS, *HOME, '-r', '__ns:=/again']
    with IkClient(program, name) as client:
        for attempt in range(2):
            log = tmp_path / f'log{attempt}'
            with log.open('wb') as output, running(*command, cwd=ROOT, stdout=output, stderr=output) as process:
                wait_until_ready(process, log)
                assert [client.solve(pose, TIMEOUT).solved for _ in range(5)] == [True] * 5
                process.kill()
                process.wait()
                with pytest.raises(NodeError, match=f'of {name} within 0.2 s|on /again/target_pose within 0.2 s'):
                    client.solve(pose, 0.2)


def test_without_a_node_the_error_says_what_to_start(program):
    with IkClient(program, '/nobody/ik_node') as client:
        expected = r'no node takes targets on /nobody/target_pose within 0\.1 s; start it with scripts/run, .*DOMAIN_ID'
        with pytest.raises(NodeError, match=expected):
            client.solve(pose_of(np.eye(4)), 0.1)


def test_without_an_answer_the_error_says_how_often_the_target_was_sent(client, program):
    client.solve(pose_of(np.eye(4)), TIMEOUT)
    with IkClient(program, '/misnamed') as misnamed:
        misnamed._wait_until(misnamed._targets.get_subscription_count, time.monotonic() + TIMEOUT, 'a match')
        with pytest.raises(NodeError) as raised:
            misnamed.solve(pose_of(np.eye(4)), 2.5)
        sent = len(misnamed._pending)
    assert sent in (2, 3)  # not 3 where a busy machine oversleeps
    expected = rf'no answer of /misnamed within 2.5 s to a target that was sent {sent} times on /target_pose; .*name'
    assert re.match(expected, str(raised.value))


def test_joints_that_a_client_publishes_are_heard(program, tmp_path):
    pose, name, log = pose_of(targets(seed=0, count=1)[0]), '/robot/ik_node', tmp_path / 'log'
    home = dict(zip(ARM.joint_names, map(float, ARM.home)))
    with (
        node_process(log, '-r', '__ns:=/robot') as process,
        IkClient(program, name, with_joint_states=True) as client,
    ):
        wait_until_ready(process, log)
        client.connect(TIMEOUT)
        assert 'no message on /robot/joint_states yet' in client.solve(pose, TIMEOUT).message
        deadline = time.monotonic() + TIMEOUT
        client.publish_joints(home)
        while not client.solve(pose, TIMEOUT).solved:  # two topics have no common order, and joint states may be lost
            assert time.monotonic() < deadline
            client.publish_joints(home)


@pytest.mark.parametrize('name', ['', 'ik node', '/ik_node/', '//ik_node', '1st', '/left/{ik_node}'])
def test_what_is_no_name_of_a_node_is_refused_with_what_is_expected(program, name):
    with pytest.raises(ValueError, match=rf'name of the IK node is {re.escape(repr(name))}; expected .* /left/ik_node'):
        IkClient(program, name)


def test_a_relative_name_is_in_the_namespace_of_the_programs_node_and_a_full_one_as_it_is(program):
    node = rclpy.create_node('program', context=program.context, namespace='/left')
    for name, full in {'ik_node': '/left/ik_node', 'arm/ik_node': '/left/arm/ik_node', '/ik_node': '/ik_node'}.items():
        with IkClient(node, name) as client:
            assert client.name == full
            assert client._targets.topic_name == full.replace('ik_node', 'target_pose')
    with IkClient(node) as client:
        assert client.name == '/left/ik_node'
    node.destroy_node()


@pytest.mark.parametrize('timeout', [0.0, -1.0, float('nan')])
def test_a_timeout_that_is_none_is_refused_with_what_was_got(client, timeout):
    for call in (client.connect, lambda timeout: client.solve(pose_of(np.eye(4)), timeout)):
        with pytest.raises(ValueError, match=f'timeout is {timeout}; expected seconds above 0'):
            call(timeout)


def test_a_client_that_is_closed_says_so_and_can_be_closed_again(program):
    client = IkClient(program, with_joint_states=True)
    client.close()
    client.close()
    calls = (
        client.connect, lambda: client.solve(pose_of(np.eye(4)), 1.0), lambda: client.publish_joints({}),
        lambda: client.parameter('method'), lambda: client.parameter_type('method'), client.parameter_names,
        lambda: client.set_parameters({'method': 'dls'}),
    )  # fmt: skip
    for call in calls:
        with pytest.raises(NodeError, match='the client of /ik_node is closed'):
            call()


def test_a_parameter_that_the_node_does_not_have_is_told_with_what_may_be_meant(client):
    for question in (client.parameter, client.parameter_type):
        with pytest.raises(NodeError, match=r"^/ik_node has no parameter 'metod'; did you mean method.*\? it has "):
            question('metod')


def test_the_node_answers_what_type_a_parameter_has_that_it_does_not_have(client):
    assert list(client._ask('get_parameter_types', ['method', 'metod']).types) == [
        Parameter.Type.STRING.value, Parameter.Type.NOT_SET.value
    ]  # fmt: skip


def test_a_client_that_was_made_without_joint_states_says_how_to_make_one_that_has_them(client):
    with pytest.raises(TypeError, match='with_joint_states=True'):
        client.publish_joints({})


def test_the_example_of_the_docs_prints_joints_by_name(client):
    client.solve(pose_of(np.eye(4)), TIMEOUT)
    example = re.search(r'^```python\n(.*?)^```', (ROOT / 'docs' / 'client.md').read_text(), re.M | re.S)[1]
    assert 'timeout=5.0' in example
    example = example.replace('timeout=5.0', f'timeout={TIMEOUT}')  # more patience, for a busy machine
    done = subprocess.run([sys.executable, '-c', example], cwd=ROOT, capture_output=True, text=True, timeout=900.0)
    assert (done.returncode, done.stderr) == (0, '')
    *_, joints = done.stdout.splitlines()
    assert tuple(ast.literal_eval(joints)) == ARM.joint_names


def test_the_other_modules_import_no_client():
    names = '[name for name in sys.modules if name.startswith("rclpy")]'
    code = f'import ros_ik_pkg.ros.output.messages, sys; print({names})'
    assert subprocess.check_output([sys.executable, '-c', code], cwd=ROOT, text=True).strip() == '[]'
