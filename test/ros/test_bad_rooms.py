"""What is wrong with a room, or too much of it: the node says so, and answers the next target right."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from ros_helpers import Client, allow_lark, connected, pose_of
from visualization_msgs.msg import Marker, MarkerArray

from bench.published_robots import PANDA, SHARE, UR5, configurations
from ros_ik_pkg.ik import Obstacle, World, load_arm
from ros_ik_pkg.ik.collision.scene import contacts_of
from ros_ik_pkg.ros.interface import topics

pytestmark = allow_lark
TRIANGLES = 2_000_000
MOST_MEMORY = 2e9  # bytes of a process that reads it for the first time, the solver in it
PATIENCE = 60.0  # s


class RoomClient(Client):
    """A client that sends obstacles."""

    def __init__(self, node, name: str = topics.NODE_NAME) -> None:
        super().__init__(node, name)
        self.obstacles = self._publisher(topics.OBSTACLES)


@pytest.fixture(scope='module')
def log(tmp_path_factory):
    return tmp_path_factory.mktemp('rooms') / 'log'


@pytest.fixture(scope='module')
def client(log):
    words = [f'robot:={UR5[0]}', f'srdf:={UR5[1]}', f'tip_frame:={UR5[2]}', 'seed_source:=home']
    with connected(RoomClient, log, *(part for word in words for part in ('-p', word))) as found:
        yield found


@pytest.fixture(scope='module')
def arm():
    return load_arm(UR5[0], tip=UR5[2], srdf=UR5[1])


@pytest.fixture
def target(arm):
    q = configurations(arm, 100, seed=2)
    return pose_of(arm.forward(q[contacts_of(arm.contacts.room().packed, q, 1e-3) < 0][0]))


def box(number, center, size=0.1, frame=''):
    marker = Marker(ns='box', id=number, type=Marker.CUBE, action=Marker.ADD)
    marker.header.frame_id = frame
    marker.scale.x = marker.scale.y = marker.scale.z = size
    marker.pose.position.x, marker.pose.position.y, marker.pose.position.z = map(float, center)
    marker.pose.orientation.w = 1.0
    return marker


def assert_right(client, arm, target, world=None):
    """Assert that a target is answered, and clear of contact as Python's coal has it."""
    reply = client.solve(target, PATIENCE)
    assert reply.joints, reply.message
    assert arm.contacts.is_clear(np.array([reply.joints[name] for name in arm.joint_names]), 0.0, world)


def test_the_srdf_of_another_robot_is_refused_and_the_old_one_stays(client, arm, target):
    assert 'panda' in client.refusal_of(srdf=str(PANDA[1]))
    assert_right(client, arm, target)


def test_boxes_without_size_and_poses_that_are_none_are_left_aside(client, arm, target, log):
    wrong = [box(1, (0.5, 0.0, 0.5), size=0.0), box(2, (np.nan, 0.0, 0.5)), box(3, (0.5, 0.0, 0.5), frame='nowhere')]
    tilted = box(4, (0.5, 0.0, 0.5))
    tilted.pose.orientation.w = np.nan
    for marker in (*wrong, tilted):
        client.obstacles.publish(MarkerArray(markers=[marker]))
        client.wait_for(lambda: 'obstacle left aside: marker box/1' in log.read_text(), 'the reason')
        assert_right(client, arm, target)


def test_a_thousand_obstacles_count(client, arm, target):
    random = np.random.default_rng(1)
    directions = random.normal(size=(1000, 3)) * [1.0, 1.0, 0.3]
    centers = [2.0 * direction / np.linalg.norm(direction) + [0.0, 0.0, 1.0] for direction in directions]
    inside = pose_of(np.eye(4)).pose.position
    inside.x, inside.y, inside.z = target.pose.position.x, target.pose.position.y, target.pose.position.z
    far = [box(number, center) for number, center in enumerate(centers)]
    blocking = MarkerArray(markers=[*far[:-1], box(999, (inside.x, inside.y, inside.z), 0.3)])

    def solved_with(message, wanted):
        for _ in range(100):
            client.obstacles.publish(message)
            if bool(client.solve(target, PATIENCE).joints) == wanted:
                return
        raise AssertionError('the obstacles do not count')

    solved_with(blocking, False)
    solved_with(MarkerArray(markers=far), True)
    obstacles = tuple(Obstacle(f'box/{k}', 'box', (0.1, 0.1, 0.1), _at(center)) for k, center in enumerate(centers))
    assert_right(client, arm, target, World(obstacles=obstacles))
    client.obstacles.publish(MarkerArray(markers=[Marker(action=Marker.DELETEALL)]))


def _at(center):
    pose = np.eye(4)
    pose[:3, 3] = center
    return pose


def test_a_floor_through_the_arm_is_refused_by_name_until_it_is_gone(client, arm, target):
    client.set_parameters({'ground': 0.5})
    reply = client.solve(target, PATIENCE)
    assert not reply.joints and "'floor' touches link" in reply.message and 'every configuration' in reply.message
    client.set_parameters({'ground': -1000.0})
    assert_right(client, arm, target)


def test_a_mesh_of_two_million_triangles_is_loaded_within_bounded_memory(
    client, arm, target, tmp_path, monkeypatch
):
    monkeypatch.setattr('ros_ik_pkg.ros.client.DISCOVERY_TIMEOUT', PATIENCE)  # of the answer to set_parameters
    urdf, other = (heavy_robot(tmp_path, name) for name in ('one', 'other'))
    client.set_parameters({'robot': str(urdf)})
    program = f'''import resource; from ros_ik_pkg.ik import load_arm
assert load_arm({str(other)!r}, tip={UR5[2]!r}).contacts.known
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)'''
    memory = subprocess.run([sys.executable, '-c', program], stdout=subprocess.PIPE, text=True, check=True).stdout
    assert 1024.0 * int(memory) < MOST_MEMORY
    heavy = load_arm(urdf, tip=UR5[2], srdf=UR5[1])
    for q in configurations(heavy, 20, seed=4):
        reply = client.solve(pose_of(heavy.forward(q)), PATIENCE)
        if reply.joints:
            assert heavy.contacts.is_clear(np.array([reply.joints[name] for name in heavy.joint_names]))
    client.set_parameters({'robot': str(UR5[0])})
    assert_right(client, arm, target)


def heavy_robot(folder, name):
    """Write a UR5 with a ball of many triangles around its forearm; return the path of its URDF."""
    write_ball(folder / f'{name}.stl', TRIANGLES)
    mesh = f'<mesh filename="{folder}/{name}.stl" scale="0.1 0.1 0.1"/>'
    link = f'<link name="forearm_link"><collision><geometry>{mesh}</geometry></collision>'
    text = UR5[0].read_text().replace('package://example-robot-data', f'file://{SHARE}/example-robot-data')
    assert '<link name="forearm_link">' in text
    urdf = folder / f'{name}.urdf'
    urdf.write_text(text.replace('<link name="forearm_link">', link, 1))
    return urdf


def write_ball(path, triangles):
    """Write a binary STL of a unit ball with about so many triangles; a new one each time, of which no cache knows."""
    n = int(np.sqrt(triangles / 2))
    u, v = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, n + 1), np.linspace(0.0, np.pi, n + 1), indexing='ij')
    points = np.stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)], axis=-1)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    corners = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3, 3)
    rows = np.zeros(len(corners), dtype=[('normal', '<f4', 3), ('corners', '<f4', (3, 3)), ('attribute', '<u2')])
    rows['corners'] = corners
    with path.open('wb') as file:
        file.write(os.urandom(80) + np.uint32(len(rows)).tobytes() + rows.tobytes())
