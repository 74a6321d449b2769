"""The folder *Reach* in a real browser, over a real node: the cubes are the node's, and a click sends the arm there.

`scripts/test test/panel/test_reach_page.py --screenshots docs` also writes the picture of the documentation.
"""

from __future__ import annotations

import numpy as np
import pytest
from browser import need_browser
from ros_helpers import START_TIMEOUT, allow_lark

need_browser()
from shown_panel import pixel_of, shown_panel  # noqa: E402  (these import viser)

from ros_ik_pkg.panel.pages.reach import ReachPage  # noqa: E402

pytestmark = [allow_lark, pytest.mark.once]


@pytest.fixture(scope='module')
def shown(tmp_path_factory):
    log = tmp_path_factory.mktemp('node') / 'node.log'
    with shown_panel('test_reach_page', log, 18140, (1280, 720), '-p', 'robot:=panda') as shown:
        shown.wait(lambda: shown.panel._arm.name == 'panda', 'the Panda')
        shown.open_folder('Motion', 'Reach')
        yield shown


def test_the_map_of_the_node_is_drawn_and_cut_and_a_click_sends_the_arm_there(shown, request):
    reach = shown.page_of(ReachPage)
    shown.press('Map the reach')
    shown.page.get_by_test_id('reach').filter(has_text='mapping what panda reaches').wait_for()
    shown.wait(lambda: reach._known, 'the map', START_TIMEOUT)
    shown.page.get_by_test_id('reach').filter(has_text='positions, from red').wait_for()
    assert len(reach._drawing.positions) == len(reach._positions) > 1000
    shown.type_into_slider('Cut at y [m]', 0.0)
    shown.wait(lambda: reach._cut == 0.0, 'a cut')
    with shown.still():
        cubes = reach._drawing.positions
        assert 0 < len(cubes) < len(reach._positions) and cubes[:, 1].min() >= 0.0
        front = np.flatnonzero(reach._positions[:, 1] == cubes[:, 1].min())
        # In the middle of the cut, where no cube and no arm is before it.
        wanted = front[np.argmin(np.linalg.norm(reach._positions[front] - [0.35, 0.0, 0.75], axis=1))]
        place = reach._positions[wanted]
    shown.screenshot(request.config.getoption('--screenshots'), 'panel_reach.png')
    shown.close_warning()
    shown.page.mouse.click(*pixel_of(shown, place))
    shown.wait(lambda: reach._clicked >= 0, 'a click')
    with shown.still():
        clicked = reach._positions[reach._clicked]
        assert np.linalg.norm(clicked - place) < 1.5 * reach._edge / 0.45
    shown.wait(lambda: not shown.panel._asking.waiting and shown.panel._link.answers.result, 'a result')
    with shown.still():
        assert shown.panel._link.answers.result['outcome'] == 'solved'
        tip = shown.panel._arm.forward(shown.panel._scene._goal)[:3, 3]
        assert np.abs(tip - clicked).max() <= 0.5 * reach._edge / 0.45 + 1e-3
    shown.page.get_by_test_id('reach').filter(has_text='% of the rotations').wait_for()
    by_share = reach._drawing._cubes.batched_colors
    reach._choice.value = 'smallest singular value'
    reach.colour_by('smallest singular value')
    shown.page.get_by_test_id('reach').filter(has_text='smallest singular value. Click one').wait_for()
    assert not np.array_equal(reach._drawing._cubes.batched_colors, by_share)
    shown.page.get_by_label('Show it').uncheck()
    shown.wait(lambda: not len(reach._drawing.positions), 'nothing drawn')
