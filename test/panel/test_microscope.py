"""The microscope in a real browser, over a real node: what is clicked moves the arm, and what is shown is true.

The panel runs in this process, so that the test can read back what the scene was told. `scripts/test
test/panel/test_microscope.py --screenshots docs` also writes the pictures of the lessons.
"""

from __future__ import annotations

import re
import time

import numpy as np
import pinocchio as pin
import pytest
from browser import need_browser
from numerics import pinocchio_tip
from rclpy.qos import QoSProfile
from ros_helpers import TIMEOUT, allow_lark

from ros_ik_pkg.ik import METHODS, TRACE_COLUMNS, load_arm
from ros_ik_pkg.ros.interface import topics

need_browser()
from shown_panel import ShownPanel, shown_panel  # noqa: E402  (these import viser)

from ros_ik_pkg.compare.lessons import LESSONS, lesson  # noqa: E402
from ros_ik_pkg.panel.markup.texts import all_texts  # noqa: E402

pytestmark = [allow_lark, pytest.mark.once]
JOINT_ARROWS = 6


@pytest.fixture(scope='module')
def shown(tmp_path_factory, request):
    size = (1600, 950) if request.config.getoption('--screenshots') else (1280, 720)
    log = tmp_path_factory.mktemp('node') / 'node.log'
    with shown_panel('test_microscope', log, 18110, size, '-p', 'max_iterations:=2000') as page:
        topic, page.traces = topics.TRACE, []
        page.node.create_subscription(topic.type, topic.of('/ik_node'), page.traces.append, QoSProfile(depth=100))
        page.press('Lecture notes')
        page.wait(lambda: len(page.panel._link.answers.runs) == len(METHODS) and page.traces, 'traces')
        yield page


def row(shown: ShownPanel, method: str, iteration: int) -> dict[str, float]:
    """Return a row of the newest trace of a compared method, as the node published it."""
    label = f'rows method={method} run=comparison stamp={shown.panel._link.answers.stamp}'
    message = [trace for trace in shown.traces if trace.layout.dim[0].label == label][-1]
    matrix = np.array(message.data).reshape(message.layout.dim[0].size, -1)
    values = matrix[iteration]
    return dict(zip(TRACE_COLUMNS, values)) | {'q': values[len(TRACE_COLUMNS) :]}


def choose_lesson(shown: ShownPanel, name: str, language: str = 'en') -> None:
    """Press the button of a lesson and wait until its descent is looked into."""
    item = lesson(name)
    shown.page.get_by_role('tab', name={'en': 'Lessons', 'pl': 'Lekcje'}[language]).click()
    shown.press(item.title[language])
    same = lambda: shown.panel._lesson is item and shown.panel._sync.ready and not shown.panel._asking.waiting  # noqa: E731
    shown.wait(same, f'lesson {name}')
    methods = set(item.methods)
    shown.wait(lambda: set(shown.panel._link.answers.curves) == methods and shown.panel._link.answers.compared, 'runs')
    shown.page.get_by_role('tab', name={'en': 'Iteration', 'pl': 'Iteracja'}[language]).click()
    shown.page.get_by_test_id('iterate').locator('.card').wait_for()


def test_the_slider_moves_the_arm_to_the_joints_of_the_iterate_and_the_card_has_the_numbers_of_the_trace(shown):
    choose_lesson(shown, 'wrist')
    shown.page.get_by_label('Look into').click()
    shown.page.get_by_role('option', name='sdls', exact=True).click()
    shown.wait(lambda: shown.panel._readings.microscope.shown_method == 'sdls', 'sdls')
    for k in (0, 3, 7):
        shown.type_into_slider('Iteration', k)
        shown.wait(lambda k=k: shown.panel._readings.microscope.row == k, f'row {k}')
        shown.page.locator(f'[data-testid=iterate][data-iteration="{k}"]').wait_for()
        with shown.still():
            values = row(shown, 'sdls', k)
            np.testing.assert_allclose(shown.panel._scene._shown, values['q'])
            tip = shown.panel._scene._tip.position
        np.testing.assert_allclose(tip, pinocchio_tip(load_arm('puma560'), values['q'])[:3, 3], atol=1e-9)
        figures = shown.figures()
        for name in ('position_error', 'orientation_error', 'step_norm'):
            assert figures[name] == pytest.approx(values[name], rel=2e-3, abs=1e-9), name


def test_the_arrows_at_the_tip_are_the_columns_of_pinocchio_s_jacobian(shown):
    choose_lesson(shown, 'wrist')
    with shown.still():
        drawing, q = shown.panel._scene.iterate, shown.panel._scene._shown.copy()
        linear, angular = drawing.linear.points, drawing.angular.points
    arm = load_arm('puma560')
    jacobian = pinocchio_jacobian(arm, q)
    arrows = linear[:, 1] - linear[:, 0]
    longest = np.linalg.norm(jacobian[:3], axis=0).max()
    columns = [column for column in jacobian[:3].T if np.linalg.norm(column) > 1e-3 * longest]
    assert len(arrows) >= len(columns) > 2
    scale = np.linalg.norm(arrows, axis=1).max() / longest
    for column in columns:
        assert np.abs(arrows - scale * column).max(axis=1).min() < 1e-4
    directions = angular[:, 1] - angular[:, 0]
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    np.testing.assert_allclose(directions, jacobian[3:].T, atol=1e-3)
    np.testing.assert_allclose(linear[0, 0], pinocchio_tip(arm, q)[:3, 3], atol=1e-5)


def pinocchio_jacobian(arm, q: np.ndarray) -> np.ndarray:
    """Return the Jacobian (6, n) of the tip in base axes by Pinocchio; the arm's joints are all of its model's."""
    data = arm.model.createData()
    frame = arm.model.getFrameId(arm.tip_frame)
    return pin.computeFrameJacobian(arm.model, data, q, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)


def test_keys_step_and_play_and_the_plots_carry_the_cursor(shown):
    choose_lesson(shown, 'quadratic')
    shown.page.get_by_role('tab', name='Methods').click()
    shown.page.locator('[data-testid=plots] .cursor').first.wait_for(state='attached')
    shown.page.get_by_role('tab', name='Iteration').click()
    microscope = shown.panel._readings.microscope
    before = microscope.row
    shown.page.locator('canvas').last.click(position={'x': 20, 'y': 300})
    shown.page.keyboard.press('n')
    shown.wait(lambda: microscope.row == before + 1, 'the next iteration')
    shown.page.keyboard.press('b')
    shown.wait(lambda: microscope.row == before, 'the iteration before')
    shown.press('Play ▶')
    last = len(shown.panel._link.answers.curves['pinv'].iteration) - 1
    shown.wait(lambda: microscope.row == last and not microscope._playing, 'the end')


def test_a_change_of_damping_shows_in_the_chart_at_once(shown):
    choose_lesson(shown, 'residual')
    table = shown.page.get_by_test_id('directions')
    before = table.inner_text()
    shown.page.get_by_role('tab', name='Parameters').click()
    shown.type_into_slider('dls', 0.1)
    shown.wait(lambda: shown.panel._sync.parameters.shown['dls.damping'] == 0.1, 'another damping')
    deadline = time.monotonic() + TIMEOUT
    while table.inner_text() == before:
        assert time.monotonic() < deadline
        shown.page.wait_for_timeout(50)


@pytest.mark.parametrize('name', [item.name for item in LESSONS])
def test_a_lesson_shows_its_phenomenon_on_the_page(shown, name, request):
    choose_lesson(shown, name)
    item = lesson(name)
    assert item.text['en'] in ' '.join(shown.page.get_by_test_id('lesson').inner_text().split())
    with shown.still():
        runs = dict(shown.panel._link.answers.runs)
        values = shown.panel._sync.parameters.node
    assert {name: values[name] for name in item.values() if name in values} == {
        name: value for name, value in item.values().items() if name in values
    }
    labels = {method: run.status.label for method, run in runs.items()}
    expected = {
        'quadratic': labels.get('pinv') == 'converged' and runs['pinv'].iterations < 10,
        'wrist': labels.get('pinv') == 'diverged' and labels.get('dls') == 'converged',
        'oscillation': labels.get('transpose') == 'oscillating',
        'stagnation': labels.get('transpose') == labels.get('sdls') == 'stalled',
        'branch': set(labels.values()) == {'converged'},
        'residual': labels.get('dls') == 'max_iterations' and labels.get('adaptive_dls') == 'converged',
        'redundancy': set(labels.values()) == {'converged'},
    }
    assert expected[name], labels
    shown.screenshot(request.config.getoption('--screenshots'), f'lesson_{name}.png')


def test_the_language_switch_leaves_no_english_text_behind(shown):
    choose_lesson(shown, 'wrist')
    shown.page.get_by_role('tab', name='Parameters').click()
    shown.page.get_by_label('Language').click()
    shown.page.get_by_role('option', name='Polski').click()
    shown.page.get_by_role('tab', name='Zadanie').wait_for()
    shown.wait(lambda: shown.panel._texts.language == 'pl', 'Polish')
    english = {text for text in all_texts('en') if len(text) > 4 and '{' not in text}
    english |= {item.text['en'] for item in LESSONS} | {item.title['en'] for item in LESSONS}
    for tab in ('Zadanie', 'Ruch', 'Lekcje', 'Parametry'):
        shown.page.get_by_role('tab', name=tab).click()
        for other in ('Metody', 'Iteracja'):
            shown.page.get_by_role('tab', name=other).click()
            shown.page.wait_for_timeout(300)
            text = ' '.join(shown.page.locator('body').inner_text().split())
            left = [entry for entry in english if re.search(rf'(?<!\w){re.escape(entry)}(?!\w)', text)]
            assert not left, left
    shown.page.get_by_role('tab', name='Parametry').click()
    shown.page.get_by_label('Język').click()
    shown.page.get_by_role('option', name='English').click()
    shown.page.get_by_role('tab', name='Task').wait_for()


def test_after_another_robot_the_arm_stands_where_its_joints_say(shown):
    choose_lesson(shown, 'redundancy')
    choose_lesson(shown, 'residual')
    with shown.still():
        frames, q = shown.panel._scene._body._frames, shown.panel._scene._shown
        names = {frame.name for frame in frames}
    assert shown.panel._arm.name == 'puma560' and len(q) == JOINT_ARROWS
    assert all(name.startswith(f'/arm{shown.panel._scene._arms}/') for name in names)
