"""Whole paths over DDS: the real node in a process of its own, and a client."""

from __future__ import annotations

import subprocess
import sys
import time

import numpy as np
import pinocchio as pin
import pytest
from chains import pinocchio_tip
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Path
from ros_helpers import TIMEOUT, Client, allow_lark, connected, joint_state, pose_of
from trajectory_msgs.msg import JointTrajectory

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.reply import values

pytestmark = allow_lark

ARM = load_arm('ur5')
START = np.array([0.3, -1.2, 1.5, 0.2, 0.9, 0.1])
COMPILES = 900.0  # s; the first path on a machine compiles


class PathClient(Client):
    """A client that can send paths without waiting, and keeps all motions, results and markers of paths."""

    def __init__(self, node, name: str = topics.NODE_NAME) -> None:
        self.motions, self.path_results, self.markers = [], [], []
        self.strangers: list[JointTrajectory] = []  # motions of other paths that come just before a result
        super().__init__(node, name)
        self._subscribe(topics.PATH_MARKERS, self.markers.append)

    def _on_path_solution(self, message: JointTrajectory) -> None:
        super()._on_path_solution(message)
        self.motions.append(message)

    def _on_path_result(self, message: DiagnosticArray) -> None:
        for motion in self.strangers:
            super()._on_path_solution(motion)
        super()._on_path_result(message)
        self.path_results.append(message)

    def send_path(self, path: Path) -> None:
        self._paths.publish(path)


@pytest.fixture(scope='module')
def client(tmp_path_factory):
    log = tmp_path_factory.mktemp('node') / 'log'
    arguments = ['-p', 'robot:=ur5', '-p', 'path.deadline:=0.0']
    with connected(PathClient, log, *arguments) as client:
        client.send_joint_state(joint_state(ARM.joint_names, START))
        client.solve_path(path_of(line(0.1)), COMPILES)
        yield client


@pytest.fixture(autouse=True)
def same_state(client):
    client.set_parameters({'path.tool_speed': 0.0, 'path.lead_in': False, 'velocity_scale': 1.0})
    client.send_joint_state(joint_state(ARM.joint_names, START))


def line(*lengths):
    home = ARM.forward(START)
    out = [home]
    for length in lengths:
        pose = out[-1].copy()
        pose[1, 3] += length
        out.append(pose)
    return out


def path_of(poses, frame=''):
    path = Path(poses=[pose_of(pose) for pose in poses])
    path.header.frame_id = frame
    return path


def points_of(trajectory):
    return [np.array([getattr(point, name) for point in trajectory.points])
            for name in ('positions', 'velocities', 'accelerations')]


def times_of(trajectory):
    durations = (point.time_from_start for point in trajectory.points)
    return np.array([duration.sec + 1e-9 * duration.nanosec for duration in durations])


def test_a_path_becomes_a_motion_from_where_the_joints_are(client):
    reply = client.solve_path(path_of(line(0.1, 0.1)), TIMEOUT)
    assert reply.solved, reply.message
    assert reply.trajectory.joint_names == list(ARM.joint_names)
    assert (reply.trajectory.header.stamp.sec, reply.trajectory.header.stamp.nanosec) == (0, 0)
    q, v, a = points_of(reply.trajectory)
    times = times_of(reply.trajectory)
    np.testing.assert_allclose(q[0], START, atol=1e-6)
    assert times[0] == 0.0 and (np.diff(times) > 0.0).all() and len(times) == int(reply.figures['points'])
    assert (v[[0, -1]] == 0.0).all() and (a[[0, -1]] == 0.0).all()
    assert (np.abs(v) <= ARM.velocity_limits).all()
    tips = np.array([pinocchio_tip(ARM, row) for row in q])
    np.testing.assert_allclose(tips[:, :3, :3], np.broadcast_to(tips[0, :3, :3], (len(q), 3, 3)), atol=1e-6)
    np.testing.assert_allclose(tips[:, 0, 3], tips[0, 0, 3], atol=1e-6)
    np.testing.assert_allclose(tips[-1], line(0.1, 0.1)[-1], atol=1e-6)
    assert float(reply.figures['start_distance']) < 1e-6


def test_tool_speed_and_velocity_scale_count_from_the_next_path_on(client):
    fast = times_of(client.solve_path(path_of(line(0.2)), TIMEOUT).trajectory)[-1]
    client.set_parameters({'velocity_scale': 0.1})
    assert times_of(client.solve_path(path_of(line(0.2)), TIMEOUT).trajectory)[-1] > 3.0 * fast
    client.set_parameters({'velocity_scale': 1.0, 'path.tool_speed': 0.05})
    assert times_of(client.solve_path(path_of(line(0.2)), TIMEOUT).trajectory)[-1] == pytest.approx(4.0, rel=0.1)


def test_stamps_of_the_poses_are_times_to_keep(client):
    path = path_of(line(0.1, 0.1))
    for pose, sec in zip(path.poses, (100, 102, 105)):
        pose.header.stamp.sec = sec
    times = times_of(client.solve_path(path, TIMEOUT).trajectory)
    assert 5.0 <= times[-1] < 5.6
    path.poses[2].header.stamp.sec = 101
    reply = client.solve_path(path, TIMEOUT)
    assert not reply.solved and 'run back: pose 2' in reply.message


def test_the_motion_leads_to_the_start_first_if_that_is_asked_for(client):
    away = START + 0.1
    client.send_joint_state(joint_state(ARM.joint_names, away))
    plain = client.solve_path(path_of(line(0.1)), TIMEOUT)
    assert float(plain.figures['start_distance']) == pytest.approx(0.1, abs=1e-5)
    client.set_parameters({'path.lead_in': True})
    led = client.solve_path(path_of(line(0.1)), TIMEOUT)
    assert led.solved, led.message
    q, v, _ = points_of(led.trajectory)
    np.testing.assert_allclose(q[0], away, atol=1e-12)
    np.testing.assert_allclose(q[1:], points_of(plain.trajectory)[0], atol=1e-9)
    assert (v[1] == 0.0).all() and times_of(led.trajectory)[1] > 0.1


def test_markers_show_speed_and_where_the_arm_comes_near_a_singularity(client):
    near = np.array([0.3, -1.2, 1.5, 0.2, 0.02, 0.1])
    client.send_joint_state(joint_state(ARM.joint_names, near))
    pose = ARM.forward(near)
    poses = [pose.copy(), pose.copy()]
    for end, sign in zip(poses, (-1.0, 1.0)):
        end[:2, 3] += [0.1 * sign, 0.03 * sign]
    client.markers.clear()
    reply = client.solve_path(path_of(poses), TIMEOUT)
    assert reply.solved, reply.message
    client.wait_for(lambda: client.markers, 'markers')
    line_of, halo = (next(m for m in client.markers[-1].markers if m.ns == ns) for ns in ('path', 'singularity'))
    assert len(line_of.points) == len(line_of.colors) == len(halo.colors) == len(reply.trajectory.points)
    shown = [colour.a > 0.0 for colour in halo.colors]
    assert any(shown) and min(colour.g for colour in halo.colors) < 0.3


def test_poses_may_be_in_different_frames(client):
    poses = line(0.1)
    tool = ARM.forward(START)
    path = Path(poses=[pose_of(poses[0]), pose_of(np.linalg.inv(tool) @ poses[1], 'tool0')])
    reply = client.solve_path(path, TIMEOUT)
    assert reply.solved, reply.message
    np.testing.assert_allclose(pinocchio_tip(ARM, points_of(reply.trajectory)[0][-1]), poses[1], atol=1e-6)


def send_file(tmp_path, rows):
    """What scripts/send_path prints for a file, and its exit code."""
    file = tmp_path / 'path.csv'
    file.write_text('x,y,z,qx,qy,qz,qw,via\n' + '\n'.join(rows))
    command = [sys.executable, '-m', 'ros_ik_pkg.tools.send_path', str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT)
    return done.stdout + done.stderr, done.returncode


def test_a_file_sends_arcs_as_short_lines(client, tmp_path):
    home = ARM.forward(START)
    (x, y, z), turn = home[:3, 3], pin.Quaternion(home[:3, :3]).coeffs()
    turned = ','.join(map(str, turn))
    rows = [f'{x},{y + 0.05 * k},{z + 0.05 * (k == 1)},{turned},{int(k == 1)}' for k in range(3)]
    client.motions.clear()
    printed, code = send_file(tmp_path, rows)
    assert code == 0 and 'reached_row: 2 (arcs' in printed, printed
    client.wait_for(lambda: client.motions, 'the motion')
    tips = np.array([pinocchio_tip(ARM, q)[:3, 3] for q in points_of(client.motions[-1])[0]])
    np.testing.assert_allclose(np.linalg.norm(tips - (x, y + 0.05, z), axis=1), 0.05, atol=1e-4)
    assert tips[:, 2].max() > z + 0.049
    printed, code = send_file(tmp_path, [*rows, f'{x},{y + 9.0},{z},{turned},0'])
    reached = float(printed.split('reached_row: ')[1].split()[0])
    assert code == 2 and 2.0 < reached < 3.0
    printed, code = send_file(tmp_path, rows[:2])
    assert code == 1 and 'via' in printed


def test_a_path_that_breaks_is_partial_and_nothing_is_published(client):
    count = len(client.path_results)
    client.motions.clear()
    reply = client.solve_path(path_of([*line(0.1), ARM.forward(START) + 5.0 * np.eye(4, k=3)]), TIMEOUT)
    assert not reply.solved and reply.trajectory is None
    assert reply.figures['outcome'] == 'partial' and reply.figures['status'] == 'reach'
    assert 'from pose 1 to 2' in reply.message and 1.0 <= float(reply.figures['reached_pose']) < 2.0
    client.wait_for(lambda: len(client.path_results) > count and client.markers, 'markers')
    assert client.solve_path(path_of(line(0.1)), TIMEOUT).solved
    assert len(client.motions) == 1


def test_the_motion_of_another_path_is_not_taken_for_the_one_that_was_asked_for(client):
    other = client.solve_path(path_of(line(0.05)), TIMEOUT).trajectory
    asked = client.solve_path(path_of(line(0.1)), TIMEOUT).trajectory
    client.strangers = [other, JointTrajectory()]
    try:
        reply = client.solve_path(path_of(line(0.1)), TIMEOUT)
    finally:
        client.strangers = []
    assert reply.trajectory.points == asked.points != other.points


def bad(index, **fields):
    path = path_of(line(*[1e-4] * 600))
    for name, value in fields.items():
        part = path.poses[index].pose
        setattr(part.position if name in 'xyz' else part.orientation, name[-1], value)
    return path


@pytest.mark.parametrize(
    ('path', 'status', 'text'),
    [
        (bad(2, y=float('nan')), 'not_finite', 'pose 2'),
        (bad(499, y=float('nan')), 'not_finite', 'pose 499'),
        (bad(1, qw=5.0), 'quaternion', 'pose 1'),
        (path_of(line()), 'argument', '1 pose'),
        (Path(), 'argument', 'poses'),
        (path_of(line(0.0)), 'argument', 'no length'),
        (path_of(line(0.1), 'moon'), 'frame', 'pose 0'),
        (Path(poses=[pose_of(line()[0]), pose_of(line(0.1)[1], 'moon')]), 'frame', 'pose 1'),
    ],
)
def test_a_path_that_makes_no_sense_is_refused_with_the_pose(client, path, status, text):
    client.motions.clear()
    reply = client.solve_path(path, TIMEOUT)
    assert not reply.solved and reply.figures['outcome'] == 'refused' and reply.figures['status'] == status
    assert text in reply.message and reply.trajectory is None
    assert client.solve_path(path_of(line(0.1)), TIMEOUT).solved
    assert len(client.motions) == 1  # that of the good path


def test_a_new_path_replaces_the_one_that_is_being_solved(client):
    long = path_of([*line(0.2), *line(0.1)] * 300)
    deadline = time.monotonic() + TIMEOUT
    statuses = []
    while 'superseded' not in statuses:  # the long one may not have arrived yet
        assert time.monotonic() < deadline
        count = len(client.path_results)
        client.send_path(long)
        time.sleep(0.1)
        reply = client.solve_path(path_of(line(0.1)), TIMEOUT)
        assert reply.solved, reply.message
        assert len(reply.trajectory.points) < 100
        statuses = [values(message.status[0])['status'] for message in client.path_results[count:]]
    assert statuses[-1] == 'solved' and set(statuses[:-1]) == {'superseded'}


def test_targets_are_answered_while_a_path_is_solved(client):
    long = path_of([*line(0.2), *line(0.1)] * 200)
    count, answered = len(client.path_results), 0
    client.send_path(long)
    while len(client.path_results) == count:
        assert client.solve(pose_of(ARM.forward(START)), TIMEOUT).solved
        answered += 1
    assert answered > 3
