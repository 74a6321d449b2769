"""The panel in a real browser, over a real node: what the page shows is what the node says.

`scripts/test test/test_panel.py --screenshots docs` also writes the pictures of the README.
"""

from __future__ import annotations

import signal
import socket
import time
import types
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from browser import PAGE_TIMEOUT, START_TIMEOUT, address, need_browser, open_page, running
from rclpy.qos import QoSProfile
from ros_helpers import CALM_ARGUMENTS, TIMEOUT, Client, allow_lark

from ros_ik_pkg.ik import METHODS, load_arm
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.reply import values
from ros_ik_pkg.tools.processes import ros_node

need_browser()
from ros_ik_pkg.panel.answers import run_of  # noqa: E402  (these import viser)
from ros_ik_pkg.panel.drawing.arm_drawing import floor_of, size_of  # noqa: E402
from ros_ik_pkg.panel.drawing.camera import FIELD, FORWARD, RIGHT, UP, Camera  # noqa: E402
from ros_ik_pkg.panel.drawing.scene import GIZMO  # noqa: E402
from ros_ik_pkg.panel.markup.html import row_texts  # noqa: E402
from ros_ik_pkg.panel.presets import notes  # noqa: E402

pytestmark = [allow_lark, pytest.mark.once]
NODE = ('ros_ik_pkg.ros.ik_node', '--ros-args', '-p', 'max_iterations:=2000', '-p', 'position_tolerance:=1e-6',
        '-p', 'orientation_tolerance:=1e-6', *CALM_ARGUMENTS)  # fmt: skip

ROWS = """() => [...document.querySelectorAll('[data-testid=comparison] tr[data-method]')]
    .map(row => [...row.cells].map(cell => cell.innerText))"""


class Listener(Client):
    """Hears what the node says to the panel."""

    def __init__(self, node, name: str = topics.NODE_NAME) -> None:
        self.comparisons, self.results = [], []
        super().__init__(node, name)
        topic = topics.COMPARISON  # with a queue for those that come while the browser is waited for
        self.node.create_subscription(topic.type, topic.of(self.name), self.comparisons.append, QoSProfile(depth=1000))

    def _on_result(self, message) -> None:
        super()._on_result(message)
        self.results.append(values(message.status[0]))


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


@pytest.fixture(scope='module')
def node(tmp_path_factory):
    """The IK node as a process that a test may kill: a function that starts it again."""
    folder, processes = tmp_path_factory.mktemp('node'), []

    class Restartable:
        def start(self) -> None:
            context = running(folder / f'{len(processes)}.log', *NODE)
            processes.append((context, context.__enter__()))

        def kill(self) -> None:
            process = processes[-1][1]
            process.send_signal(signal.SIGKILL)
            process.wait()

    restartable = Restartable()
    restartable.start()
    yield restartable
    for context, _ in processes:
        context.__exit__(None, None, None)


@pytest.fixture(scope='module')
def listener(node):
    with ros_node('test_panel') as ros:
        client = Listener(ros)
        client.connect(START_TIMEOUT)
        yield client


@pytest.fixture(scope='module')
def page(node, listener, tmp_path_factory, request):
    log = tmp_path_factory.mktemp('panel') / 'panel.log'
    large = bool(request.config.getoption('--screenshots'))
    panel = running(log, 'ros_ik_pkg.panel.panel_node', '--port', str(free_port()))
    with panel, open_page(address(log), *((1600, 950) if large else (1280, 720))) as page:
        page.get_by_test_id('comparison').locator('tr[data-method]').nth(4).wait_for()
        yield page


@pytest.fixture
def screenshot(page, request):
    """A function that writes the page to a file, where --screenshots asks for it."""
    folder = request.config.getoption('--screenshots')

    def write(name: str) -> None:
        if folder:
            close_warning(page)
            page.wait_for_timeout(15e3)  # the software renderer draws a frame in a second, and the arm moves for many
            page.screenshot(path=Path(folder) / name, timeout=200e3)

    return write


def rows(page) -> dict[str, list[str]]:
    """Return what the table shows, by method."""
    texts = page.evaluate(ROWS)  # at once: the table may be written anew at any time
    return {text[0]: text[1:] for text in texts}


def told_by(comparison) -> dict[str, list[str]]:
    """Return what the table must show of a message on ~/comparison."""
    runs = [run_of(values(status)) for status in comparison.status]
    return {run.method: list(row_texts(run)[1:]) for run in runs}


def wait_for_text(page, name: str, text: str, timeout: float = PAGE_TIMEOUT) -> str:
    """Wait until a part of the page holds a text, and return all of it."""
    part = page.get_by_test_id(name)
    part.filter(has_text=text).wait_for(timeout=timeout)
    return part.inner_text()


def wait_for_rows(page, wanted: Callable[[dict[str, list[str]]], object]) -> None:
    """Wait until the table is as wanted: the parts of a page change one after the other."""
    deadline = time.monotonic() + TIMEOUT
    while not wanted(shown := rows(page)):
        assert time.monotonic() < deadline, shown
        page.wait_for_timeout(50)


def close_warning(page) -> None:
    """Close what the page says about a graphics card that is a program, where it still stands before the arm."""
    close = page.locator('.mantine-Notification-closeButton')
    if close.count():
        close.first.click()


def press(page, name: str) -> None:
    page.get_by_role('button', name=name, exact=True).click()


def test_the_page_shows_the_five_methods_with_the_numbers_of_the_node(page, listener, screenshot):
    listener.comparisons.clear()
    press(page, 'Lecture notes')
    listener.wait_for(lambda: listener.comparisons and rows(page) == told_by(listener.comparisons[-1]), 'equal tables')
    assert list(rows(page)) == list(METHODS)  # with times in microseconds, which are never the same twice
    screenshot('panel.png')


def test_a_target_typed_into_a_field_is_solved(page, listener):
    press(page, 'Lecture notes')
    field = page.get_by_label('x y z [m]').first
    field.fill('0.35')
    field.press('Enter')
    listener.wait_for(lambda: listener.results and abs(tip_x(listener) - 0.35) < 1e-3, 'a solution there')
    assert '0.350' in wait_for_text(page, 'tip', '0.350')


def tip_x(listener) -> float:
    """Return where the newest solution puts the tip."""
    if not listener.solutions:
        return float('nan')
    newest = max(listener.solutions)
    return float(load_arm('puma560').forward(listener.solutions[newest][-1].position)[0, 3])


WATCH = """() => {
    const element = document.querySelector('[data-testid=comparison]').closest('.ik').parentElement;
    const rows = () => [...element.querySelectorAll('tr[data-method]')]
        .map(row => [...row.cells].map(cell => cell.innerText));
    const shown = [], began = performance.now();
    let frames = 0, last = JSON.stringify(rows());
    const watch = new MutationObserver(() => {
        const table = rows(), text = JSON.stringify(table);
        if (text !== last) shown.push(table);
        last = text;
    });
    watch.observe(element, {childList: true, subtree: true, characterData: true});
    const count = () => { frames += 1; window.counter = requestAnimationFrame(count); };
    count();
    window.stopped = () => {
        watch.disconnect();
        cancelAnimationFrame(window.counter);
        cancelAnimationFrame(window.drag);
        return [frames, shown, (performance.now() - began) / 1000];
    };
}"""
# A pointer that moves once a frame, which is how often a browser tells a page of a mouse; a move that comes from here
# waits for the page to answer, which is slower.
DRAG = """([x, y]) => {
    const canvas = document.elementFromPoint(x, y), began = performance.now();
    const move = () => {
        const angle = (performance.now() - began) / 1000;
        canvas.dispatchEvent(new PointerEvent('pointermove', {
            bubbles: true, pointerId: 1, pointerType: 'mouse', isPrimary: true, buttons: 1,
            clientX: x + 40 * Math.sin(angle), clientY: y + 20 * Math.sin(2 * angle),
        }));
        window.drag = requestAnimationFrame(move);
    };
    move();
}"""
DRAG_TIME = 8.0  # s


def handle_of_the_gizmo(page) -> tuple[float, float]:
    """Return the pixel of an arrow at the target, that of the axis z, as the page shows it after *Lecture notes*."""
    problem = notes(load_arm('puma560'))
    size, place = size_of(problem.arm), types.SimpleNamespace()
    camera = Camera(types.SimpleNamespace(initial_camera=place, get_clients=dict))
    camera.begin(size, floor_of(problem.arm))
    camera.follow(problem.target[:3, 3])
    seen = problem.target[:3, 3] + 0.9 * GIZMO * size * problem.target[:3, 2] - place.position
    box = page.locator('canvas').last.bounding_box()
    pixels = box['height'] / 2 / np.tan(FIELD / 2) / (seen @ FORWARD)
    return box['x'] + box['width'] / 2 + pixels * (seen @ RIGHT), box['y'] + box['height'] / 2 - pixels * (seen @ UP)


def test_while_the_target_is_dragged_the_table_follows_the_node_to_the_last_target(page, listener, capsys):
    press(page, 'Lecture notes')
    same = lambda: listener.comparisons and rows(page) == told_by(listener.comparisons[-1])  # noqa: E731
    wait_for_text(page, 'tip', '0.400')
    listener.wait_for(same, 'equal tables')
    close_warning(page)
    x, y = handle_of_the_gizmo(page)
    page.mouse.move(x, y)
    page.wait_for_timeout(1e3)  # the arm arrives, and the arrow notices the pointer
    page.mouse.down()
    page.evaluate(WATCH)
    before = len(listener.comparisons)
    page.evaluate(DRAG, [x, y])
    page.wait_for_timeout(1e3 * DRAG_TIME)
    frames, shown, seconds = page.evaluate('stopped()')
    page.mouse.up()
    listener.wait_for(same, 'equal tables')
    published = [told_by(comparison) for comparison in listener.comparisons[before - 1 :]]
    tables = [{row[0]: row[1:] for row in table} for table in shown]
    assert tables and all(table in published for table in tables), 'the page shows what the node never said'
    assert page.get_by_label('x y z [m]').first.input_value() != '0.4'
    with capsys.disabled():
        rates = f'{len(tables) / seconds:.1f} tables and {frames / seconds:.1f} frames a second'
        print(f'\ndragged for {seconds:.1f} s: {rates}, {len(published)} comparisons published')


def test_at_the_singular_wrist_the_page_says_in_words_how_pinv_failed(page, screenshot):
    press(page, 'Wrist singular')
    words = wait_for_text(page, 'words', 'pinv diverged')
    assert 'smallest singular value' in words and 'converged' in words
    wait_for_rows(page, lambda rows: rows['pinv'][-1] == 'diverged')
    screenshot('panel_singular.png')


def test_out_of_reach_the_page_says_so_and_no_method_converges(page):
    press(page, 'Unreachable')
    assert 'out of reach' in wait_for_text(page, 'node', 'out of reach')
    wait_for_rows(page, lambda rows: rows and 'converged' not in {row[-1] for row in rows.values()})


def test_the_method_of_the_node_is_switched_from_the_page(page, listener):
    press(page, 'Lecture notes')
    page.get_by_role('tab', name='Parameters').click()
    page.get_by_label('Node solves by').click()
    page.get_by_role('option', name='sdls', exact=True).click()
    listener.results.clear()
    listener.wait_for(lambda: listener.results and listener.results[-1]['method'] == 'sdls', 'a result of sdls')
    assert 'solved by sdls' in wait_for_text(page, 'node', 'sdls')
    assert listener.parameter('method') == 'sdls'


def test_methods_are_switched_off_on_the_page(page):
    page.get_by_role('tab', name='Parameters').click()
    page.get_by_label('transpose', exact=True).uncheck()
    page.get_by_test_id('comparison').locator('tr[data-method=transpose]').wait_for(state='detached')
    wait_for_rows(page, lambda rows: list(rows) == [method for method in METHODS if method != 'transpose'])
    page.get_by_label('transpose', exact=True).check()
    page.get_by_test_id('comparison').locator('tr[data-method=transpose]').wait_for()


def test_a_dark_page_is_dark(page, screenshot):
    page.get_by_role('tab', name='Parameters').click()
    page.get_by_label('Dark page').check()
    page.locator('[data-mantine-color-scheme=dark]').first.wait_for(state='attached')
    page.get_by_role('tab', name='Task').click()
    press(page, 'Arm stretched out')
    screenshot('panel_dark.png')
    page.get_by_role('tab', name='Parameters').click()
    page.get_by_label('Dark page').uncheck()


def test_another_robot_gets_sliders_of_its_own(page, listener):
    page.get_by_role('tab', name='Task').click()
    page.get_by_label('Robot').click()
    page.get_by_role('option', name='panda', exact=True).click()
    page.get_by_text('joint7', exact=True).wait_for()
    listener.wait_for(lambda: listener.parameter('robot') == 'panda', 'the node with the panda')
    wait_for_text(page, 'node', 'solved')


def test_a_killed_node_is_missed_and_found_again_with_the_parameters_of_the_page(page, node, listener):
    node.kill()
    wait_for_text(page, 'node', 'no IK node')
    node.start()
    wait_for_text(page, 'node', 'solved by sdls', 1e3 * START_TIMEOUT)
    listener.connect(timeout=TIMEOUT)
    assert listener.parameter('robot') == 'panda'
    assert listener.parameter('max_iterations') == 2000
