"""MoveIt's kinematics services and planning scene over DDS, judged by Pinocchio's own reading of the URDF.

moveit_msgs has no wheels, so where it is not installed a stand-in is made with the same fields by rosidl's generators
(test/moveit_stand_in). Its messages are real ones; what is not tested is MoveIt itself on the other side.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import moveit_helpers
import numpy as np
import pinocchio as pin
import pytest
from geometry_msgs.msg import PoseStamped
from ros_helpers import (
    ROOT,
    TIMEOUT,
    Client,
    allow_lark,
    connected,
    joint_state,
    node_process,
    pose_of,
    wait_until_ready,
)
from shape_msgs.msg import SolidPrimitive
from visualization_msgs.msg import Marker, MarkerArray

from bench.published_robots import PANDA
from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.handling.target_handler import IDENTITY
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.output.moveit_services import CODES
from ros_ik_pkg.ros.reply import values

pytestmark = [
    allow_lark, pytest.mark.newest,
    pytest.mark.skipif(bool(moveit_helpers.why_not()), reason=moveit_helpers.why_not()),
]  # fmt: skip
REAL = importlib.util.find_spec('moveit_msgs') is not None
URDF, SRDF, _ = PANDA
TIP = 'panda_link8'
ARM = load_arm(URDF, tip=TIP, srdf=SRDF)
MODEL = pin.buildModelFromUrdf(str(URDF))
NEAR = 1.001e-5  # m, rad; the default tolerances
READY = np.array([0.1, -0.7, 0.2, -2.2, 0.3, 1.7, 0.6])
FINGERS = {'panda_finger_joint1': 0.02, 'panda_finger_joint2': 0.02}
TOOL = pin.SE3(pin.rpy.rpyToMatrix(0.3, 0.2, -0.5), np.array([0.01, 0.02, 0.2]))


class MoveItClient(Client):
    """A client of the services, at the names that move_group gives them."""

    def __init__(self, node, name: str = topics.NODE_NAME) -> None:
        from moveit_msgs.msg import AttachedCollisionObject, CollisionObject, PlanningScene
        from moveit_msgs.srv import GetPositionFK, GetPositionIK

        super().__init__(node, name)
        self.scenes, self.objects, self.held = (
            self.node.create_publisher(kind, f'/{topic}', 10) for kind, topic in (
                (PlanningScene, 'planning_scene'), (CollisionObject, 'collision_object'),
                (AttachedCollisionObject, 'attached_collision_object'))
        )  # fmt: skip
        self.ik_type, self.fk_type = GetPositionIK, GetPositionFK
        self._ik = self.node.create_client(GetPositionIK, '/compute_ik')
        self._fk = self.node.create_client(GetPositionFK, '/compute_fk')
        self._obstacles = self._publisher(topics.OBSTACLES)

    def connect(self, timeout: float = TIMEOUT) -> None:
        super().connect(timeout)
        for client in (self._ik, self._fk):
            assert client.wait_for_service(timeout)

    def ask(self, change=lambda asked: None, pose: np.ndarray | None = None, frame: str = ''):
        """Return the response to a request for a pose, changed before it is sent."""
        request = self.ik_type.Request()
        asked = request.ik_request
        asked.pose_stamped = pose_of(link_pose(READY + 0.1, TIP) if pose is None else pose, frame)
        asked.robot_state.joint_state = joint_state(ARM.joint_names, READY)
        change(asked)
        return self._call(self._ik.call_async(request))

    def code(self, change=lambda asked: None, pose: np.ndarray | None = None, frame: str = '') -> str:
        """Return the name of the error code of a response, whose reason must be in it."""
        code = self.ask(change, pose, frame).error_code
        assert code.message if hasattr(code, 'message') else True
        return next(name for name in dir(code) if name.isupper() and getattr(code, name) == code.val)

    def look(self, links, joints, frame: str = ''):
        """Return the response to a request for the poses of links."""
        request = self.fk_type.Request(fk_link_names=list(links))
        request.header.frame_id = frame
        request.robot_state.joint_state = joint_state(joints, joints.values())
        return self._call(self._fk.call_async(request))


def link_pose(q, link: str, base: str = 'panda_link0') -> np.ndarray:
    """Return the pose (4, 4) of a link in another's frame, by Pinocchio from the URDF."""
    data, positions = MODEL.createData(), pin.neutral(MODEL)
    for name, value in {**dict(zip(ARM.joint_names, q)), **FINGERS}.items():
        positions[MODEL.joints[MODEL.getJointId(name)].idx_q] = value
    pin.framesForwardKinematics(MODEL, data, positions)
    one, other = (data.oMf[MODEL.getFrameId(name)] for name in (base, link))
    return one.actInv(other).homogeneous


def joints_of(response) -> np.ndarray:
    """Return the solution of a response (n,), which begins with the joints of the arm."""
    assert response.error_code.val == response.error_code.SUCCESS, response.error_code
    state = response.solution.joint_state
    assert tuple(state.name[: ARM.n]) == ARM.joint_names
    return np.array(state.position[: ARM.n])


def off(pose: np.ndarray, wanted: np.ndarray) -> float:
    """Return how far two poses are apart [m, rad]."""
    turned = pin.log3(wanted[:3, :3] @ pose[:3, :3].T)
    return max(float(np.linalg.norm((pose - wanted)[:3, 3])), float(np.linalg.norm(turned)))


def as_matrix(stamped: PoseStamped) -> np.ndarray:
    p, q = stamped.pose.position, stamped.pose.orientation
    return pin.XYZQUATToSE3(np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w])).homogeneous


@pytest.fixture(scope='module')
def client(tmp_path_factory, pytestconfig):
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend('')  # both are put back at the end
        patch.setenv('PYTHONPATH', str(ROOT))
        moveit_helpers.provide(Path(pytestconfig.cache.mkdir('moveit_stand_in')))
        log = tmp_path_factory.mktemp('moveit') / 'log'
        words = [f'robot:={URDF}', f'srdf:={SRDF}', f'tip_frame:={TIP}', 'group_name:=panda_arm', 'ground:=-0.3']
        remaps = [f'~/compute_{kind}:=/compute_{kind}' for kind in ('ik', 'fk')]
        arguments = [part for word in words for part in ('-p', word)]
        arguments += [part for word in remaps for part in ('-r', word)]
        with connected(MoveItClient, log, *arguments) as found:
            found.log = log
            yield found


@pytest.fixture(autouse=True)
def at_the_start(client):
    client.set_parameters({'tool': [], 'deadline': 10.0, 'group_name': 'panda_arm'})


def test_a_program_as_tutorials_write_it_runs_unchanged(client):
    client.settle(pose_of(link_pose(READY, TIP)), lambda reply: reply.solved, joint_state(ARM.joint_names, READY))
    program = Path(__file__).parents[1] / 'moveit_tutorial.py'
    said = subprocess.run([sys.executable, program], capture_output=True, text=True, timeout=TIMEOUT, check=True).stdout
    lines = [line.split() for line in said.splitlines()]
    q = np.array([float(position) for name, position in lines[: ARM.n]])
    assert [name for name, _ in lines[: ARM.n]] == list(ARM.joint_names)
    np.testing.assert_allclose(link_pose(q, TIP)[:3, 3], [0.4, 0.1, 0.5], atol=NEAR)
    np.testing.assert_allclose(np.array(lines[ARM.n][1:], dtype=float), [0.4, 0.1, 0.5], atol=NEAR)


def test_the_answer_brings_the_tip_to_the_pose_from_the_given_seed(client):
    wanted = link_pose(READY + 0.05, TIP)
    q = joints_of(client.ask(pose=wanted))
    assert off(link_pose(q, TIP), wanted) <= 2.0 * NEAR
    assert np.abs(q - READY).max() < 0.5


@pytest.mark.parametrize('group', ['', 'panda_arm', ARM.name])
def test_the_group_is_free_or_the_arms(client, group):
    assert client.code(lambda asked: setattr(asked, 'group_name', group)) == 'SUCCESS'


def test_another_group_than_the_arms_is_refused_if_the_parameter_names_one(client):
    def other(asked):
        asked.group_name = 'hand'

    assert client.code(other) == 'INVALID_GROUP_NAME'
    client.set_parameters({'group_name': ''})
    assert client.code(other) == 'SUCCESS'


def test_the_pose_may_be_in_any_frame_of_the_robot(client):
    client.send_joint_state(joint_state(ARM.joint_names, READY))
    wanted = link_pose(READY + 0.1, TIP)
    in_link = np.linalg.inv(link_pose(READY, 'panda_link3')) @ wanted
    client.wait_for(
        lambda: off(link_pose(joints_of(client.ask(pose=in_link, frame='panda_link3')), TIP), wanted) <= 2.0 * NEAR,
        'an answer in the frame of a link',
    )
    assert client.code(frame='nowhere') == 'FRAME_TRANSFORM_FAILURE'


def test_another_link_than_the_tip_reaches_the_pose_if_it_moves_with_it(client):
    def for_link(name):
        return lambda asked: setattr(asked, 'ik_link_name', name)

    wanted = link_pose(READY + 0.1, 'panda_hand')
    q = joints_of(client.ask(for_link('panda_hand'), wanted))
    assert off(link_pose(q, 'panda_hand'), wanted) <= 5.0 * NEAR
    assert client.code(for_link('panda_link3')) == 'INVALID_LINK_NAME'
    assert client.code(for_link('no_link')) == 'INVALID_LINK_NAME'


def test_without_a_link_the_tool_reaches_the_pose_and_with_its_name_the_tip_frame(client):
    client.set_parameters({'tool': pin.SE3ToXYZQUAT(TOOL).tolist()})
    wanted = link_pose(READY + 0.1, TIP)
    q = joints_of(client.ask(pose=wanted @ TOOL.homogeneous))
    assert off(link_pose(q, TIP) @ TOOL.homogeneous, wanted @ TOOL.homogeneous) <= 2.0 * NEAR
    q = joints_of(client.ask(lambda asked: setattr(asked, 'ik_link_name', TIP), wanted))
    assert off(link_pose(q, TIP), wanted) <= 5.0 * NEAR
    found = client.look(['tool', TIP], dict(zip(ARM.joint_names, READY)))
    assert off(as_matrix(found.pose_stamped[0]), link_pose(READY, TIP) @ TOOL.homogeneous) < 1e-9


def test_the_seed_is_the_joint_states_if_none_is_given(client):
    def without(asked):
        asked.robot_state.joint_state = joint_state([], [])

    client.send_joint_state(joint_state(ARM.joint_names, READY))
    wanted = link_pose(READY + 0.02, TIP)
    client.wait_for(lambda: np.abs(joints_of(client.ask(without, wanted)) - READY).max() < 0.3, 'an answer near')


def test_of_a_seed_for_some_joints_the_others_are_the_joint_states(client):
    client.send_joint_state(joint_state(ARM.joint_names, READY))

    def some(asked):
        asked.robot_state.joint_state = joint_state(ARM.joint_names[:2], READY[:2])

    assert client.code(some) == 'SUCCESS'


@pytest.mark.parametrize(
    'state',
    [
        (ARM.joint_names, READY[:3]),
        (ARM.joint_names, [*READY[:6], np.nan]),
        ([*ARM.joint_names, ARM.joint_names[0]], [*READY, 0.0]),
    ],
    ids=['lengths', 'nan', 'twice'],
)
def test_a_robot_state_that_makes_no_sense_is_refused(client, state):
    def with_state(asked):
        asked.robot_state.joint_state = joint_state(*state)

    assert client.code(with_state) == 'INVALID_ROBOT_STATE'


def test_the_solution_has_the_other_joints_of_the_robot_too(client):
    def with_fingers(asked):
        asked.robot_state.joint_state = joint_state([*FINGERS, *ARM.joint_names], [*FINGERS.values(), *READY])

    state = client.ask(with_fingers).solution.joint_state
    assert dict(zip(state.name, state.position)).items() >= FINGERS.items()


def test_a_pose_that_is_none_is_refused(client):
    for change in (
        lambda pose: setattr(pose.position, 'x', float('nan')),
        lambda pose: setattr(pose.orientation, 'w', 5.0),
        lambda pose: setattr(pose.position, 'x', 1e9),
    ):
        assert client.code(lambda asked, change=change: change(asked.pose_stamped.pose)) == 'INVALID_GOAL_CONSTRAINTS'


def test_what_has_no_solution_has_the_code_of_that_and_the_reason_is_in_the_log_and_in_the_result(client):
    far = link_pose(READY, TIP)
    far[0, 3] = 3.0
    client.statuses.clear()
    assert client.code(pose=far) == 'NO_IK_SOLUTION'
    client.wait_for(lambda: client.statuses[0, 0], 'the result')
    figures = values(client.statuses[0, 0][-1])
    assert (figures['status'], figures['service'], figures['published']) == ('unreachable', 'compute_ik', 'nothing')
    client.wait_for(lambda: 'compute_ik not solved: out of reach' in client.log.read_text(), 'the reason in the log')


def test_a_request_without_time_enough_is_answered_so(client):
    def at_once(asked):
        asked.timeout.nanosec = 1

    beyond = link_pose(READY, TIP)
    beyond[:3, :3] = beyond[:3, :3] @ pin.rpy.rpyToMatrix(0.0, 2.0, 0.0)
    beyond[2, 3] -= 0.25
    assert client.code(at_once, beyond) in ('TIMED_OUT', 'SUCCESS')
    assert client.code(at_once, link_pose(-READY, TIP)) == 'TIMED_OUT'


def test_contact_counts_if_the_request_says_so_and_not_otherwise(client):
    wanted = link_pose(READY + 0.1, TIP)
    ball = Marker(ns='ball', type=Marker.SPHERE, action=Marker.ADD)
    ball.scale.x = ball.scale.y = ball.scale.z = 0.1
    ball.pose.position.x, ball.pose.position.y, ball.pose.position.z = wanted[:3, 3].tolist()
    ball.pose.orientation.w = 1.0

    def clear(asked):
        asked.avoid_collisions = True

    assert client.code(clear, wanted) == 'SUCCESS'
    client._obstacles.publish(MarkerArray(markers=[ball]))
    client.wait_for(lambda: client.code(clear, wanted) == 'NO_IK_SOLUTION', 'a refusal')
    assert client.code(pose=wanted) == 'SUCCESS'
    ball.action = Marker.DELETEALL
    client._obstacles.publish(MarkerArray(markers=[ball]))
    client.wait_for(lambda: client.code(clear, wanted) == 'SUCCESS', 'an answer without the ball')


def test_what_this_node_cannot_do_is_refused_and_not_left_aside(client):
    from moveit_msgs.msg import AttachedCollisionObject, JointConstraint

    def constrained(asked):
        asked.constraints.joint_constraints = [JointConstraint(joint_name=ARM.joint_names[0])]

    def attached(asked):
        asked.avoid_collisions = True
        asked.robot_state.attached_collision_objects = [AttachedCollisionObject()]

    def two(asked):
        asked.pose_stamped_vector, asked.ik_link_names = [asked.pose_stamped] * 2, [TIP, TIP]

    def two_for_one(asked):
        asked.pose_stamped_vector, asked.ik_link_names = [asked.pose_stamped] * 2, [TIP]

    def one(asked):
        asked.pose_stamped_vector, asked.ik_link_names = [asked.pose_stamped], [TIP]
        asked.pose_stamped = PoseStamped()

    assert client.code(constrained) == 'INVALID_GOAL_CONSTRAINTS'
    assert client.code(attached) == 'COLLISION_CHECKING_UNAVAILABLE'
    assert client.code(two) == 'NO_IK_SOLUTION'
    assert client.code(two_for_one) == 'INVALID_LINK_NAME'
    assert client.code(one) == 'SUCCESS'


def test_requests_command_nothing_and_do_not_count_as_targets(client):
    def quiet():
        return client.health and values(client.health[-1])['targets_per_second'] == '0.0'

    client.wait_for(quiet, 'a second without targets')
    client.health.clear()
    client.solutions.clear()
    for _ in range(20):
        assert client.code() == 'SUCCESS'
    client.wait_for(lambda: len(client.health) >= 2, 'two health reports')
    assert not client.solutions
    assert {values(status)['targets_per_second'] for status in client.health} == {'0.0'}


def test_poses_of_links_are_those_of_the_urdf_in_any_frame(client):
    joints = dict(zip(ARM.joint_names, READY)) | FINGERS
    links = ['panda_link3', 'panda_hand', 'panda_leftfinger', 'panda_link0']
    for frame in ('', 'panda_link0', 'panda_link5'):
        found = client.look(links, joints, frame)
        assert found.error_code.val == found.error_code.SUCCESS
        assert list(found.fk_link_names) == links
        for link, stamped in zip(links, found.pose_stamped):
            assert stamped.header.frame_id == (frame or 'panda_link0')
            assert off(as_matrix(stamped), link_pose(READY, link, frame or 'panda_link0')) < 1e-9


def test_poses_are_those_of_the_joint_states_if_no_joints_are_given(client):
    client.send_joint_state(joint_state(ARM.joint_names, READY))
    client.wait_for(
        lambda: off(as_matrix(client.look([TIP], {}).pose_stamped[0]), link_pose(READY, TIP)) < 1e-9, 'the joint states'
    )


def test_links_and_frames_that_there_are_not_have_their_codes(client):
    joints = dict(zip(ARM.joint_names, READY))
    found = client.look([TIP, 'no_link'], joints)
    assert found.error_code.val == found.error_code.INVALID_LINK_NAME
    assert list(found.fk_link_names) == [TIP] and len(found.pose_stamped) == 1
    found = client.look([], joints)
    assert found.error_code.val == found.error_code.INVALID_LINK_NAME
    found = client.look([TIP], joints, 'nowhere')
    assert found.error_code.val == found.error_code.FRAME_TRANSFORM_FAILURE
    found = client.look([TIP], {ARM.joint_names[0]: float('nan')})
    assert found.error_code.val == found.error_code.INVALID_ROBOT_STATE
    assert not found.pose_stamped


def test_every_code_is_one_of_moveits(client):
    from moveit_msgs.msg import MoveItErrorCodes

    assert all(isinstance(getattr(MoveItErrorCodes, name), int) for name in CODES.values())
    assert np.array_equal(IDENTITY, np.eye(4))  # nobody has written to what all targets in the base frame share


@pytest.mark.skipif(REAL, reason='moveit_msgs is installed')
def test_without_moveit_msgs_the_node_answers_targets_and_has_no_such_services(client, tmp_path, monkeypatch):
    monkeypatch.setenv('PYTHONPATH', str(ROOT))
    words = ('-r', '__ns:=/without', '-p', 'seed_source:=home')
    with node_process(tmp_path / 'log', *words) as process, Client(client.node, '/without/ik_node') as other:
        wait_until_ready(process, tmp_path / 'log')
        other.connect()
        arm = load_arm('puma560')
        assert other.solve(pose_of(arm.forward(arm.home + 0.1)), TIMEOUT).solved
        names = dict(client.node.get_service_names_and_types())
        assert '/without/ik_node/pause' in names
        assert '/without/ik_node/compute_ik' not in names


def solid(client, operation: bytes, kind: int, size, place, link: str = 'panda_link0'):
    """Return a CollisionObject of one primitive at a place in the frame of a link."""
    from moveit_msgs.msg import CollisionObject

    thing = CollisionObject(id=f'thing {kind}', operation=operation)
    thing.header.frame_id = link
    thing.primitives = [SolidPrimitive(type=kind, dimensions=[float(value) for value in size])]
    thing.primitive_poses = [pose_of(pin.SE3(np.eye(3), np.asarray(place)).homogeneous).pose]
    return thing


def until(client, publish, solved: bool) -> None:
    """Publish until the answer clear of contact to the usual pose is there, or is not there."""
    wanted, codes = link_pose(READY, TIP), []
    while not codes or (codes[-1] == 'SUCCESS') != solved:
        assert len(codes) < 200, codes
        publish()
        codes.append(client.code(lambda asked: setattr(asked, 'avoid_collisions', True), wanted))


@pytest.mark.parametrize('topic', ['planning_scene', 'collision_object'])
def test_an_object_of_moveits_messages_counts_until_it_is_removed(client, topic):
    from moveit_msgs.msg import PlanningScene

    def publish(operation: bytes) -> None:
        ball = solid(client, operation, SolidPrimitive.SPHERE, [0.05], link_pose(READY, TIP)[:3, 3])
        if topic == 'collision_object':
            client.objects.publish(ball)
        else:
            scene = PlanningScene(is_diff=True)
            scene.world.collision_objects = [ball]
            client.scenes.publish(scene)

    until(client, lambda: None, True)
    until(client, lambda: publish(b'\x00'), False)
    until(client, lambda: publish(b'\x01'), True)


def test_a_held_object_moves_with_its_link(client):
    from moveit_msgs.msg import AttachedCollisionObject

    place = link_pose(READY, TIP) @ [0.0, 0.0, 0.35, 1.0]
    ball = solid(client, b'\x00', SolidPrimitive.SPHERE, [0.03], place[:3])
    rod = AttachedCollisionObject(
        link_name=TIP, object=solid(client, b'\x00', SolidPrimitive.CYLINDER, [0.2, 0.01], (0.0, 0.0, 0.3), TIP))
    until(client, lambda: client.objects.publish(ball), True)
    until(client, lambda: client.held.publish(rod), False)  # it reaches into the ball
    for message, publisher in ((rod, client.held), (ball, client.objects)):
        getattr(message, 'object', message).operation = b'\x01'
        publisher.publish(message)
    rod.object.id, ball.id = '', ''  # that which was let go, too
    until(client, lambda: client.held.publish(rod) or client.objects.publish(ball), True)
