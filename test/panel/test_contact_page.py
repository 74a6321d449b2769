"""Contact in a real browser, over a real node: obstacles are added and dragged, links that touch are red."""

from __future__ import annotations

import numpy as np
import pytest
from browser import need_browser
from ros_helpers import allow_lark

from bench.published_robots import UR5

need_browser()
from shown_panel import drag, shown_panel  # noqa: E402  (these import viser)

from ros_ik_pkg.ik import World, load_arm  # noqa: E402
from ros_ik_pkg.ik.world import Obstacle  # noqa: E402
from ros_ik_pkg.panel.pages.obstacles import GIZMO, SIZE  # noqa: E402

pytestmark = [allow_lark, pytest.mark.once]


@pytest.fixture(scope='module')
def shown(tmp_path_factory):
    log = tmp_path_factory.mktemp('node') / 'node.log'
    robot = ('-p', f'robot:={UR5[0]}', '-p', f'tip_frame:={UR5[2]}', '-p', f'srdf:={UR5[1]}')
    with shown_panel('test_contact_page', log, 18150, (1280, 720), *robot) as shown:
        shown.wait(lambda: shown.panel._arm.shaped and shown.panel._sync.ready, 'the UR5 with shapes')
        yield shown


def result(shown) -> dict[str, str]:
    return shown.panel._link.answers.result


def test_an_obstacle_at_the_target_turns_the_links_that_touch_red_and_the_status_names_them(shown):
    shown.press('Lecture notes')
    shown.wait(lambda: result(shown).get('outcome') == 'solved', 'a solution')
    with shown.still():
        assert shown.panel._scene.contact.links == ()
    shown.press('Box')
    shown.wait(lambda: result(shown).get('status') == 'collision' and shown.panel._scene.contact.links, 'red links')
    with shown.still():
        touching, red = result(shown)['touching'].split(', '), shown.panel._scene.contact.links
        q, target = shown.panel._scene._goal.copy(), shown.panel._problem.target[:3, 3].copy()
    assert set(red) == set(touching) & set(shown.panel._arm.frame_names) and red
    for name in touching:
        shown.page.get_by_test_id('node').filter(has_text=name).wait_for()
    shown.page.get_by_test_id('tip').filter(has_text=red[0]).wait_for()
    judge = load_arm(str(UR5[0]), None, UR5[2], srdf=str(UR5[1]))
    world = World(obstacles=(Obstacle('panel/1', 'box', (SIZE,) * 3, target_pose(target)),))
    contact = judge.contacts.look(q, world)
    assert contact.clearance < 0.0


def target_pose(position: np.ndarray) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = position
    return pose


def test_dragged_away_the_obstacle_lets_the_target_be_solved_and_nothing_is_red(shown):
    with shown.still():
        (item,) = shown.panel._obstacles._items.values()
        before = item.position.copy()
    start = before + 0.9 * GIZMO * np.array([0.0, 0.0, 1.0])
    drag(shown, start, start + np.array([0.0, 0.0, 0.35]))
    shown.wait(lambda: item.position[2] - before[2] > 0.2, 'the box higher')
    shown.wait(lambda: result(shown).get('outcome') == 'solved', 'a solution')
    shown.wait(lambda: shown.panel._scene.contact.links == (), 'nothing red')
    np.testing.assert_allclose(item.position[:2], before[:2], atol=5e-3)
    shown.page.get_by_test_id('node').filter(has_text='solved by').wait_for()


def test_removed_obstacles_are_gone_for_the_node_too(shown):
    shown.press('Ball')
    shown.wait(lambda: result(shown).get('status') == 'collision', 'contact')
    shown.press('Remove all')
    shown.wait(lambda: result(shown).get('outcome') == 'solved' and shown.panel._obstacles.empty, 'a solution')
