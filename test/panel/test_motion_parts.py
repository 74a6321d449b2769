"""The folders *Path*, *Drive* and *Reach* without a browser: words, charts, messages that come late or never."""

from __future__ import annotations

import re

import numpy as np
import pytest
from builtin_interfaces.msg import Duration, Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point, Pose, PoseArray
from ros_helpers import allow_lark
from std_msgs.msg import ColorRGBA, Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from visualization_msgs.msg import Marker, MarkerArray

from ros_ik_pkg.ik import ArgumentError, load_arm
from ros_ik_pkg.ik.path.path_solution import BreakReason
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.interface.servo_settings import SERVO_OPTIONS
from ros_ik_pkg.ros.output.statuses import key_values
from ros_ik_pkg.tools.processes import ros_node

viser = pytest.importorskip('viser', reason='viser is not installed: scripts/panel installs it')
from test_panel_logic import MadeUpNode, panel_on, ticks  # noqa: E402

from ros_ik_pkg.panel.commands import BINS, Commands  # noqa: E402
from ros_ik_pkg.panel.markup.commands_html import commands_html  # noqa: E402
from ros_ik_pkg.panel.markup.motion_html import charts_html, moved_html, path_words  # noqa: E402
from ros_ik_pkg.panel.markup.texts import Texts  # noqa: E402
from ros_ik_pkg.panel.motion import read_motion  # noqa: E402

pytestmark = [allow_lark, pytest.mark.once]
ARM = load_arm('puma560')
SOLVED = {
    'outcome': 'solved', 'status': 'solved', 'message': 'so it is', 'points': 2, 'duration': 2.0, 'joint_travel': 1.5,
    'reconfigured_at_poses': '', 'reconfigured_at_times': '', 'slowed_intervals': 0, 'sigma_min': 0.1234,
    'sigma_min_at_pose': 1.5,
}  # fmt: skip


def trajectory(names=ARM.joint_names) -> JointTrajectory:
    """Return a motion from rest to rest: of all joints by 1 rad in 2 s."""
    message = JointTrajectory(joint_names=list(names))
    for second, position in ((0, 0.0), (2, 1.0)):
        point = JointTrajectoryPoint(positions=[position] * ARM.n, velocities=[0.0] * ARM.n,
                                     accelerations=[0.0] * ARM.n, time_from_start=Duration(sec=second))  # fmt: skip
        message.points.append(point)
    return message


def figures(**changes) -> dict[str, str]:
    return {name: str(value) for name, value in {**SOLVED, **changes}.items()}


def test_a_motion_from_rest_to_rest_is_a_polynomial_of_the_fifth_degree():
    motion = read_motion(trajectory(), ARM, [])
    for share in (0.0, 0.25, 0.5, 0.9, 1.0):
        expected = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        np.testing.assert_allclose(motion.at(2.0 * share), expected, atol=1e-12)


@pytest.mark.parametrize('message', [trajectory(('a', 'b')), JointTrajectory(joint_names=list(ARM.joint_names))])
def test_a_motion_of_other_joints_or_without_points_is_refused(message):
    with pytest.raises(ArgumentError, match='a motion of'):
        read_motion(message, ARM, [])


def test_the_charts_have_a_strip_for_each_joint_and_sigma_min_and_a_band_for_each_reconfiguration_in_each():
    motion = read_motion(trajectory(), ARM, [0.0])
    html = charts_html(motion, ARM, ARM.joint_names, Texts())
    assert html.count('class="curve"') == html.count('<rect class="off"') == ARM.n + 1
    assert 'left: 25.00%' in moved_html(0.5, motion, Texts())
    limit = re.search(r'limits (-?[\d.]+) and ([\d.]+)', html)
    assert float(limit[1]) == pytest.approx(ARM.lower[0], abs=5e-3)


def test_what_became_of_a_path_is_said_with_the_places():
    words = path_words(figures(reconfigured_at_poses='1.250 3.000', slowed_intervals=2), Texts())
    assert 'pose 1.250, 3.000' in words and 'cannot keep the tip speed' in words and 'sigma_min 0.123' in words
    partial = figures(outcome='partial', status='reach', message='pose 2 is out of reach', reached_pose=1.75)
    assert path_words(partial, Texts()) == 'partial: pose 2 is out of reach. It goes as far as pose 1.75 (red cube).'


@pytest.mark.parametrize('reason', [reason.value for reason in BreakReason])
def test_in_polish_every_reason_for_a_break_has_its_words(reason):
    words = path_words(figures(outcome='partial', status=reason, message='in English', reached_pose=1.0), Texts('pl'))
    assert 'in English' not in words and f': {reason}.' not in words


def test_the_largest_share_of_a_limit_is_in_the_chart_however_short_it_was():
    parameters = {option.ros_name: option.default for option in SERVO_OPTIONS}
    commands = Commands(ARM, np.zeros(ARM.n), {**parameters, 'command_rate': 100.0, 'velocity_scale': 0.5})
    assert commands.peaks.shape == (0, 2, ARM.n)
    for number in range(700):
        message = trajectory()
        point = message.points[-1]
        point.velocities = [0.5 if number == 333 else 0.0, *[0.0] * (ARM.n - 1)]  # half of servo.max_velocity
        point.accelerations = [-1.0] * ARM.n
        commands.take(message)
    peaks = commands.peaks
    assert len(peaks) == BINS and (peaks[:, 0, 0] > 0.0).sum() == 1
    assert peaks[:, 0, 0].max() == pytest.approx(1.0) and peaks[:, 1].max() < 0.0
    assert '100 % of its limit: a' in commands_html(peaks, ['a', *'bcdef'], Texts())


@pytest.fixture(scope='module')
def server():
    server = viser.ViserServer(host='127.0.0.1', port=18160, verbose=False)
    yield server
    server.stop()


@pytest.fixture(scope='module')
def ros():
    with ros_node('test_motion_parts') as node:
        yield node


@pytest.fixture
def panel(server, ros, monkeypatch):
    panel = panel_on(MadeUpNode(), server, ros, monkeypatch)
    ticks(panel)
    return panel


def result(stamp: int, **changes) -> DiagnosticArray:
    status = DiagnosticStatus(message='so it is', values=key_values({**SOLVED, **changes}))
    return DiagnosticArray(header=Header(stamp=Time(sec=stamp)), status=[status])


def test_a_path_needs_two_poses_and_its_motion_is_shown_once_result_and_motion_are_there(panel):
    path, link = panel._pages[0], panel._link
    path.add_point()
    with pytest.raises(ArgumentError, match='two poses'):
        path.solve()
    path.add_point()
    path.solve()
    assert len(link.published[-1].poses) == 2 and 'solves the path' in path._words.content
    link.heard[topics.PATH_RESULT.name](result(6))  # of another path
    assert not path._result
    link.heard[topics.PATH_RESULT.name](result(7))
    assert path._result and path._motion is None
    other = trajectory()
    other.points[-1].time_from_start.sec = 4
    link.heard[topics.PATH_SOLUTION.name](other)
    assert path._motion is None
    link.heard[topics.PATH_SOLUTION.name](trajectory())
    assert path._motion is not None and not path._slider.disabled
    link.heard[topics.PATH_SOLUTION.name](other)
    path.go_to(1.0)
    np.testing.assert_allclose(panel._scene._shown, 0.5)


def test_what_comes_of_a_path_whose_poses_have_changed_since_is_not_shown(panel):
    path, link = panel._pages[0], panel._link
    path.add_point()
    path.add_point()
    path.solve()
    path.move(1, np.eye(4))
    link.heard[topics.PATH_SOLUTION.name](trajectory())
    link.heard[topics.PATH_RESULT.name](result(7))
    assert path._motion is None and not path._result
    with pytest.raises(ArgumentError, match='not finite'):
        path.move(1, np.full((4, 4), np.nan))


def test_an_answer_to_a_target_ends_what_is_played(panel):
    path = panel._pages[0]
    path._motion = read_motion(trajectory(), ARM, [])
    path.play()
    panel._link.say('solved', q=np.full(6, 0.3))
    ticks(panel)
    assert not path._playing
    np.testing.assert_allclose(panel._scene._goal, 0.3)


def test_while_the_page_drives_the_last_command_is_the_joint_state_and_no_target_is_sent(panel):
    drive, link = panel._pages[1], panel._link
    link.say('solved', q=np.full(6, 0.3))
    link.compare('dls')
    ticks(panel, 40)
    drive.choose(True)
    assert link.sent[-1] == {'command_rate': 100.0}
    sent = len(link.targets)
    link.heard[topics.JOINT_TRAJECTORY.name](trajectory())
    ticks(panel)
    np.testing.assert_allclose(link.joints, 1.0)
    assert len(link.targets) == sent
    np.testing.assert_allclose(panel.target, ARM.forward(np.ones(6)), atol=1e-9)  # the gizmo goes with the tip
    target = panel.target.copy()
    target[0, 3] += 1.0
    panel.set_target(target, dragged=True)
    ticks(panel, 1)
    twist = link.published[-1].twist
    np.testing.assert_allclose([twist.linear.x, twist.linear.y, twist.linear.z], [0.1, 0.0, 0.0], atol=1e-9)
    drive.choose(False)
    assert link.sent[-1] == {'command_rate': 0.0} and link.published[-1].twist.linear.x == 0.0
    ticks(panel)
    assert len(link.targets) > sent


def test_a_refused_stream_leaves_the_arm_to_the_targets(panel):
    drive = panel._pages[1]
    panel._link.refusal = lambda values: 'no stream' if values.get('command_rate') else ''
    drive.choose(True)
    assert not drive.drives and not drive._switch.value


def test_a_map_is_shown_once_cubes_and_poses_of_one_stamp_are_there(panel):
    reach, link = panel._pages[2], panel._link
    reach.ask()
    assert 'map_reach is called' in reach._words.content
    header = Header(stamp=Time(sec=3), frame_id='base')
    cubes = Marker(header=header, ns='share', text='1', type=Marker.CUBE_LIST, points=[Point(y=-0.5), Point(y=0.5)],
                   colors=[ColorRGBA(r=1.0), ColorRGBA(b=1.0)])  # fmt: skip
    cubes.scale.x = 0.1
    pose = Pose()
    pose.position.x = 0.4
    link.heard[topics.REACH.name](MarkerArray(markers=[cubes]))
    link.heard[topics.REACH_POSES.name](PoseArray(header=Header(stamp=Time(sec=2)), poses=[pose, pose]))
    assert not len(reach._drawing.positions)
    link.heard[topics.REACH_POSES.name](PoseArray(header=header, poses=[pose, pose]))
    assert len(reach._drawing.positions) == 2
    reach.cut_at(0.0)
    np.testing.assert_allclose(reach._drawing.positions, [[0.0, 0.5, 0.0]])
    reach.go_to(1)
    assert panel.target[0, 3] == 0.4 and '100 % of the rotations' in reach._words.content
    panel.choose_robot('ur5')
    assert not reach._known and 'ten seconds' in reach._words.content
