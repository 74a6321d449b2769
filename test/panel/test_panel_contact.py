"""Contact on the page, without a browser: obstacles that are added and dragged, links that turn red."""

from __future__ import annotations

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from ros_helpers import allow_lark
from visualization_msgs.msg import Marker

from bench.published_robots import UR5
from ros_ik_pkg.ik import ArgumentError, Status
from ros_ik_pkg.ros.output.statuses import key_values
from ros_ik_pkg.tools.processes import ros_node

viser = pytest.importorskip('viser', reason='viser is not installed: scripts/panel installs it')
from test_panel_logic import NODE, MadeUpNode, panel_on, ticks  # noqa: E402

from ros_ik_pkg.panel.pages.obstacles import BALL, BOX, MOST, NONE, SIZE, Obstacles  # noqa: E402

pytestmark = [allow_lark, pytest.mark.once]
SHAPED = {**NODE, 'robot': str(UR5[0]), 'tip_frame': UR5[2], 'srdf': str(UR5[1])}


class ListeningNode(MadeUpNode):
    """Keeps the obstacles that it hears of, and can fail by contact."""

    def __init__(self, values) -> None:
        super().__init__(values)
        self.obstacles = []

    def publish_obstacles(self, message) -> None:
        self.obstacles.append(message.markers)

    def fail_by_contact(self, q, links) -> None:
        figures = {'outcome': 'failed', 'status': Status.COLLISION.label, 'published': 'nothing', 'clearance': -0.01,
                   'touching': ', '.join(links), 'least_bad': ' '.join(map(str, q))}  # fmt: skip
        result = DiagnosticArray(status=[DiagnosticStatus(message='they touch', values=key_values(figures))])
        result.header.stamp.sec = len(self.targets)
        self.answers.take_result(result)


@pytest.fixture(scope='module')
def server():
    server = viser.ViserServer(port=0, verbose=False)
    yield server
    server.stop()


@pytest.fixture(scope='module')
def ros():
    with ros_node('test_panel_contact') as node:
        yield node


@pytest.fixture
def panel(server, ros, monkeypatch):
    panel = panel_on(ListeningNode(SHAPED), server, ros, monkeypatch)
    ticks(panel)
    return panel


def test_an_obstacle_stands_at_the_target_and_the_target_is_asked_again(panel):
    target, asked = panel._problem.target[:3, 3], len(panel._link.targets)
    panel._link.say('solved', 'converged', np.zeros(6))
    panel._link.compare()
    panel._events.put(lambda: panel.choose_obstacle(BOX))
    ticks(panel)
    first, box = panel._link.obstacles[-1]
    assert first.action == Marker.DELETEALL and box.type == Marker.CUBE and box.scale.x == SIZE
    np.testing.assert_allclose([box.pose.position.x, box.pose.position.y, box.pose.position.z], target)
    assert len(panel._link.targets) == asked + 1


def test_links_that_touch_are_red_at_the_least_bad_configuration_and_named(panel):
    q = np.array([0.1, -1.0, 1.0, 0.2, 0.3, 0.4])
    panel._link.fail_by_contact(q, ('forearm_link', 'panel/1'))
    ticks(panel)
    assert panel._scene.contact.links == ('forearm_link',)
    assert np.array_equal(panel._scene._goal, q) and panel._scene._body.visible
    assert 'forearm_link' in panel._readings._status.content and 'panel/1' in panel._readings._status.content
    (frame,) = panel._scene.contact._frames
    expected = panel._arm.base_from_frame('forearm_link', dict(zip(panel._arm.joint_names, q)))
    np.testing.assert_allclose(frame.position, expected[:3, 3], atol=1e-9)


def test_nothing_is_red_once_there_is_a_solution(panel):
    panel._link.fail_by_contact(np.zeros(6), ('forearm_link', 'base_link'))
    ticks(panel)
    assert panel._scene.contact.links
    panel._scene.contact.hide()
    assert panel._scene.contact.links == ()


def test_a_robot_without_shapes_says_that_obstacles_do_not_count(server, ros, monkeypatch):
    panel = panel_on(ListeningNode(NODE), server, ros, monkeypatch)
    ticks(panel)
    said = []
    panel._readings.show_notice = said.append
    panel.choose_obstacle(BALL)
    assert 'no shapes' in said[0]


def test_dragging_moves_the_marker_and_what_makes_no_sense_is_refused(server):
    changes = []
    obstacles = Obstacles(server.scene, lambda call: call(), lambda: changes.append(1))
    obstacles.choose(BALL, np.array([0.1, 0.2, 0.3]))
    obstacles.move(1, np.array([0.4, 0.5, 0.6]), np.array([0.0, 2.0, 0.0, 0.0]))
    ball = obstacles.message().markers[1]
    assert (ball.type, ball.pose.position.y, ball.pose.orientation.x) == (Marker.SPHERE, 0.5, 1.0)
    with pytest.raises(ArgumentError, match='not finite'):
        obstacles.move(1, np.array([np.nan, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    with pytest.raises(ArgumentError, match='no obstacle'):
        obstacles.choose('Teapot', np.zeros(3))
    assert len(changes) == 2
    obstacles.choose(NONE, np.zeros(3))
    assert obstacles.empty and len(obstacles.message().markers) == 1
    for _ in range(MOST):
        obstacles.choose(BOX, np.zeros(3))
    with pytest.raises(ArgumentError, match='already'):
        obstacles.choose(BOX, np.zeros(3))
