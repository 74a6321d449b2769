"""The folder *Path* in a real browser, over a real node: what is drawn there is what the node answered.

`scripts/test test/panel/test_path_page.py --screenshots docs` also writes the picture of the documentation.
"""

from __future__ import annotations

import itertools

import numpy as np
import pinocchio as pin
import pytest
from browser import need_browser
from ros_helpers import START_TIMEOUT, allow_lark

need_browser()
from shown_panel import ShownPanel, drag, shown_panel  # noqa: E402  (these import viser)

from ros_ik_pkg.ik import load_arm  # noqa: E402
from ros_ik_pkg.panel.drawing.arm_drawing import size_of  # noqa: E402
from ros_ik_pkg.panel.drawing.path_drawing import GIZMO  # noqa: E402
from ros_ik_pkg.panel.motion import SAMPLES  # noqa: E402
from ros_ik_pkg.panel.pages.path import PathPage  # noqa: E402

pytestmark = [allow_lark, pytest.mark.once]
DOWN = np.array([-0.05, 0.0, -0.15])  # m: away from the edge of the reach


@pytest.fixture(scope='module')
def shown(tmp_path_factory, request):
    log = tmp_path_factory.mktemp('node') / 'node.log'
    with shown_panel('test_path_page', log, 18120, (1280, 720), '-p', 'robot:=ur5') as shown:
        shown.wait(lambda: shown.panel._arm.name == 'ur5', 'the UR5')
        shown.open_folder('Motion', 'Path')
        yield shown


def lay_out(shown: ShownPanel, *offsets: np.ndarray) -> PathPage:
    """Press *Add* for each pose, and move it by an offset (3,) [m]."""
    path = shown.page_of(PathPage)
    shown.press('Clear')
    shown.wait(lambda: not path._poses, 'no poses')
    for k, offset in enumerate(offsets):
        shown.press('Add')
        shown.wait(lambda k=k: len(path._poses) == k + 1, f'{k + 1} poses')
        with shown.still():
            pose = path._poses[k].copy()
            pose[:3, 3] += offset
            path.move(k, pose)
            path.choose(k)
    return path


def solve(shown: ShownPanel, path: PathPage, outcome: str) -> dict[str, str]:
    shown.press('Solve the path')
    shown.wait(lambda: path._result, 'a result', START_TIMEOUT)
    assert path._result['outcome'] == outcome, path._result
    return path._result


def test_a_pose_is_dragged_by_its_arrow_added_and_deleted(shown):
    path = lay_out(shown, DOWN, np.array([-0.15, 0.1, -0.4]))  # clear of the target's arrows
    with shown.still():
        before, arm = path._poses[1].copy(), shown.panel._arm
    start = before[:3, 3] + 0.9 * GIZMO * size_of(arm) * before[:3, 2]
    drag(shown, start, start + 0.1 * before[:3, 2])
    shown.wait(lambda: np.linalg.norm(path._poses[1][:3, 3] - before[:3, 3]) > 0.03, 'another pose')
    with shown.still():
        moved = path._poses[1][:3, 3] - before[:3, 3]
        np.testing.assert_allclose(path._drawing.places, [pose[:3, 3] for pose in path._poses], atol=1e-6)
    np.testing.assert_allclose(np.cross(moved, before[:3, 2]), 0.0, atol=2e-3)  # along its axis
    shown.press('Delete')
    shown.wait(lambda: len(path._poses) == 1 and path._chosen == 0, 'one pose')


def test_a_path_is_solved_drawn_over_time_and_played(shown, request):
    path = lay_out(shown, DOWN, 1.2 * DOWN, DOWN)
    solve(shown, path, 'solved')
    shown.wait(lambda: path._motion, 'a motion')
    shown.page.get_by_test_id('path').filter(has_text='Solved whole').wait_for()
    arm, judge = shown.panel._arm, load_arm('ur5')
    shown.page.get_by_test_id('motion').wait_for()
    strips = shown.page.get_by_test_id('motion').locator('.strip')
    assert strips.count() == arm.n + 1
    titles = shown.page.get_by_test_id('motion').locator('span[title]').all()
    for joint, title in enumerate(titles[: arm.n]):
        text = title.get_attribute('title')
        q = path._motion.sampled[:, joint]
        assert text.startswith(arm.joint_names[joint]) and f'{q.min():.3g} … {q.max():.3g}' in text
        assert f'{judge.lower[joint]:.3g} and {judge.upper[joint]:.3g}' in text
    data, tip = judge.model.createData(), judge.model.getFrameId(judge.tip_frame)
    for k in (0, SAMPLES // 2, SAMPLES - 1):
        jacobian = pin.computeFrameJacobian(judge.model, data, path._motion.sampled[k], tip)
        assert path._motion.sigma_min[k] == pytest.approx(np.linalg.svd(jacobian, compute_uv=False)[-1], abs=1e-9)
    middle = round(0.5 * path._motion.duration, 2)
    shown.type_into_slider('Time [s]', middle)
    shown.wait(lambda: path._time == middle, 'the middle')
    with shown.still():
        np.testing.assert_allclose(shown.panel._scene._shown, path._motion.at(middle))
        tip_shown = np.array(shown.panel._scene._tip.position)
    places = np.array([pose[:3, 3] for pose in path._poses])
    assert distance_from_line(places, tip_shown) < 1e-3
    shown.page.get_by_test_id('moment').filter(has_text=f'{middle:.2f} s: sigma_min').wait_for()
    shown.screenshot(request.config.getoption('--screenshots'), 'panel_path.png')
    shown.press('Play ▶')
    shown.wait(lambda: path._time == path._motion.duration and not path._playing, 'the end')
    with shown.still():
        np.testing.assert_allclose(shown.panel._scene._shown, path._motion.positions[-1])


def distance_from_line(corners: np.ndarray, point: np.ndarray) -> float:
    """Return the distance [m] of a point (3,) from the line through corners (k, 3)."""
    best = np.inf
    for a, b in itertools.pairwise(corners):
        share = np.clip((point - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        best = min(best, float(np.linalg.norm(a + share * (b - a) - point)))
    return best


def test_where_and_why_a_path_breaks_is_said_and_marked_on_its_line(shown):
    path = lay_out(shown, DOWN, np.array([0.3, 0.9, 0.0]))
    result = solve(shown, path, 'partial')
    text = shown.page.get_by_test_id('path').filter(has_text='out of reach').inner_text()
    assert 'from pose 0 to 1' in text and f'as far as pose {float(result["reached_pose"]):.3g}' in text
    shown.wait(lambda: any(line.name.endswith('/break') for line in path._drawing._lines), 'the red cube')
    with shown.still():
        (cube,) = (line for line in path._drawing._lines if line.name.endswith('/break'))
        expected = path._position(float(result['reached_pose']))
        np.testing.assert_allclose(cube.position, expected, atol=2e-3)
        assert path._motion is None and path._slider.disabled
    shown.page.get_by_test_id('motion').wait_for(state='detached')


def test_a_change_of_branch_is_said_and_marked_where_the_joints_leave_the_path(shown):
    poses = winding(shown.panel._arm)
    path = lay_out(shown, *(DOWN for _ in poses))
    with shown.still():
        for k, pose in enumerate(poses):
            path.move(k, pose)
            path.choose(k)
    field = shown.page.get_by_label('Branch changes')
    field.fill('5')
    field.press('Enter')
    shown.wait(lambda: shown.panel._sync.parameters.node.get('path.max_reconfigurations') == 5, 'five allowed')
    result = solve(shown, path, 'solved')
    count = int(result['reconfigurations'])
    assert count > 0
    shown.wait(lambda: path._motion, 'a motion')
    shown.page.get_by_test_id('path').filter(has_text='leave the path at pose').wait_for()
    bands = shown.page.get_by_test_id('motion').locator('rect.off')
    bands.first.wait_for(state='attached')
    assert bands.count() == count * (shown.panel._arm.n + 1)
    with shown.still():
        marks = [line for line in path._drawing._lines if 'reconfigured' in line.name]
        assert len(marks) == count
        for begin, end in path._motion.reconfigurations:  # the tip is back at the same place
            tips = [shown.panel._arm.forward(path._motion.at(time))[:3, 3] for time in (begin, end)]
            np.testing.assert_allclose(*tips, atol=1e-3)
            assert min(np.linalg.norm(mark.position - tips[0]) for mark in marks) < 2e-3


def winding(arm) -> list[np.ndarray]:
    """Return poses at one place that turn by more in all than the range of the last joint, which must wind back."""
    first = arm.forward(np.array([0.3, -1.2, 1.5, 0.2, 0.9, 0.1]))
    turns = np.arange(0.0, arm.upper[-1] - arm.lower[-1] + 2.0, 1.5)
    poses = [first.copy() for _ in turns]
    for pose, turn in zip(poses, turns):
        pose[:3, :3] = first[:3, :3] @ pin.utils.rotate('z', turn)
    return poses
