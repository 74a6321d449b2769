"""The folder *Drive* in a real browser, over a real node: the gizmo pulls the arm, and the charts are the commands'."""

from __future__ import annotations

import re

import numpy as np
import pytest
from browser import need_browser
from rclpy.qos import QoSProfile
from ros_helpers import START_TIMEOUT, allow_lark

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.interface import topics

need_browser()
from shown_panel import ShownPanel, drag, shown_panel  # noqa: E402  (these import viser)

from ros_ik_pkg.panel.drawing.arm_drawing import size_of  # noqa: E402
from ros_ik_pkg.panel.drawing.scene import GIZMO  # noqa: E402
from ros_ik_pkg.panel.pages.drive import DrivePage  # noqa: E402

pytestmark = [allow_lark, pytest.mark.once]
SPEED = 0.2  # m/s


@pytest.fixture(scope='module')
def shown(tmp_path_factory):
    log = tmp_path_factory.mktemp('node') / 'node.log'
    with shown_panel('test_drive_page', log, 18130, (1280, 720), '-p', 'robot:=panda') as shown:
        shown.wait(lambda: shown.panel._arm.name == 'panda', 'the Panda')
        shown.open_folder('Motion', 'Drive')
        shown.commands = []
        topic = topics.JOINT_TRAJECTORY
        shown.node.create_subscription(
            topic.type, topic.of('/ik_node'), shown.commands.append, QoSProfile(depth=1000)
        )
        yield shown


def rate_of(shown: ShownPanel) -> float:
    return shown.panel._sync.parameters.node.get('command_rate')


def test_while_the_gizmo_is_held_the_tip_follows_it_within_speed_and_limits_and_stops_when_it_is_let_go(shown):
    drive, arm, judge = shown.page_of(DrivePage), shown.panel._arm, load_arm('panda')
    shown.page.get_by_label('Drive by the gizmo').check()
    shown.wait(lambda: rate_of(shown) == 100.0, 'a stream', START_TIMEOUT)
    shown.type_into_slider('Most [m/s]', SPEED)
    shown.wait(lambda: drive._speeds[0] == SPEED, 'another speed')
    with shown.still():
        assert len(shown.panel._link.answers.runs) and not drive._held
        before = arm.forward(drive._commands.position)
        start = before[:3, 3] + 0.9 * GIZMO * size_of(arm) * before[:3, 2]
        shown.commands.clear()
    drag(shown, start, start + 0.12 * before[:3, 2])
    shown.wait(lambda: not drive._held and drive._released > 0.0, 'the release')
    shown.wait(lambda: len(shown.commands) > 50 and np.abs(velocities(shown)[-30:]).max() < 1e-9, 'standstill')
    with shown.still():
        commands = [np.array(message.points[0].positions) for message in shown.commands]
        shares = np.abs(velocities(shown)) / judge.velocity_limits
        target, end = shown.panel._problem.target, judge.forward(drive._commands.position)
    tips = np.array([judge.forward(q)[:3, 3] for q in commands])
    assert np.linalg.norm(tips[-1] - before[:3, 3]) > 0.03
    assert (tips[-1] - before[:3, 3]) @ before[:3, 2] > 0.9 * np.linalg.norm(tips[-1] - before[:3, 3])
    assert np.linalg.norm(np.diff(tips, axis=0), axis=1).max() * 100.0 < 1.1 * SPEED
    assert shares.max() <= 1.0
    np.testing.assert_allclose(target, end, atol=1e-6)
    text = shown.page.get_by_test_id('velocity').inner_text()
    assert re.match(r'at most \d+ % of its limit: joint\d', text), text
    assert shown.page.get_by_test_id('commands').locator('path').count() == 2 * (arm.n + 3)


def velocities(shown: ShownPanel) -> np.ndarray:
    return np.array([message.points[0].velocities for message in shown.commands])


def test_while_it_drives_the_page_says_what_the_stream_does_and_sends_no_targets(shown):
    status = shown.page.get_by_test_id('stream')
    assert status.filter(has_text='standing').count() or status.filter(has_text='commands_stopped').count()
    with shown.still():
        stamp = shown.panel._link.answers.stamp
    shown.page.wait_for_timeout(500)
    with shown.still():
        assert shown.panel._link.answers.stamp == stamp


def test_switched_off_the_node_has_no_stream_and_the_target_is_solved_from_where_the_arm_stands(shown):
    drive = shown.page_of(DrivePage)
    with shown.still():
        q = drive._commands.position
    shown.page.get_by_label('Drive by the gizmo').uncheck()
    shown.wait(lambda: rate_of(shown) == 0.0 and not drive.drives, 'no stream')
    shown.wait(lambda: not shown.panel._asking.waiting and shown.panel._link.answers.result, 'a result')
    with shown.still():
        np.testing.assert_allclose(shown.panel._problem.seed, q)
        assert shown.panel._link.answers.result['outcome'] == 'solved'
        np.testing.assert_allclose(shown.panel._scene._goal, q, atol=1e-3)
    shown.page.get_by_test_id('commands').wait_for(state='detached')
