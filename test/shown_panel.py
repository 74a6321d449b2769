"""The panel in this process, over a real node, shown in a real browser: a test reads back what the scene was told."""

from __future__ import annotations

import contextlib
import io
import re
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pinocchio as pin
import viser
from browser import PAGE_TIMEOUT, open_page, running
from rclpy.executors import SingleThreadedExecutor
from ros_helpers import CALM_ARGUMENTS, TIMEOUT

from ros_ik_pkg.panel.pages.page import Page
from ros_ik_pkg.panel.panel import Panel
from ros_ik_pkg.panel.panel_node import TICK, spin_for
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.tools.processes import ros_node

AnyPage = TypeVar('AnyPage', bound=Page)
TOLERANCES = ('-p', 'position_tolerance:=1e-6', '-p', 'orientation_tolerance:=1e-6')


class ShownPanel:
    """A browser page, the panel behind it, and the panel's ROS node."""

    def __init__(self, page: Any, panel: Panel, lock: threading.Lock, node: Any) -> None:
        self.page, self.panel, self._lock, self.node = page, panel, lock, node
        self.traces: list[Any] = []

    def still(self) -> threading.Lock:
        """Return the lock that keeps the panel from ticking."""
        return self._lock

    def press(self, name: str) -> None:
        """Press the button with this text."""
        self.page.get_by_role('button', name=name, exact=True).click()

    def type_into_slider(self, label: str, value: object) -> None:
        """Type a value into the field beside a slider that is to be seen."""
        labels = self.page.locator('label').filter(has_text=re.compile(f'^{re.escape(label)}$'))
        row = labels.locator('xpath=ancestor::*[contains(@class, "mantine-Flex-root")][1]')
        field = row.locator('input[inputmode=decimal]').filter(visible=True).last
        field.fill(str(value))
        field.press('Enter')

    def open_folder(self, tab: str, folder: str) -> None:
        """Choose a tab, and open one of its folders unless it is open."""
        self.page.get_by_role('tab', name=tab, exact=True).click()
        self.page.get_by_text(folder, exact=True).first.click()

    def page_of(self, kind: type[AnyPage]) -> AnyPage:
        """Return the panel's page of this class."""
        (found,) = (page for page in self.panel._pages if isinstance(page, kind))
        return found

    def wait(self, condition: Callable[[], object], what: str, timeout: float = TIMEOUT) -> None:
        """Wait until a condition holds between two ticks."""
        deadline = time.monotonic() + timeout
        while True:
            with self._lock:
                if condition():
                    return
            assert time.monotonic() < deadline, f'never: {what}'
            self.page.wait_for_timeout(50)

    def close_warning(self) -> None:
        """Close what the page says about a graphics card that is a program."""
        close = self.page.locator('.mantine-Notification-closeButton')
        if close.count():
            close.first.click()

    def screenshot(self, folder: str | None, name: str) -> None:
        """Write the page to a file, if there is a folder; without a GPU a frame takes a second."""
        if folder:
            self.close_warning()
            self.page.wait_for_timeout(6e3)
            self.page.screenshot(path=Path(folder) / name, timeout=200e3)

    def iteration(self) -> int:
        """Return the iteration that the card is about, -1 if there is no card."""
        part = self.page.get_by_test_id('iterate')
        return int(part.get_attribute('data-iteration') or -1)

    def figures(self) -> dict[str, float]:
        """Return the figures of the card by name."""
        spans = self.page.get_by_test_id('iterate').locator('[data-figure]')
        return {span.get_attribute('data-figure'): float(span.inner_text()) for span in spans.all()}


@contextlib.contextmanager
def shown_panel(name: str, log: Path, port: int, size: tuple[int, int], *parameters: str) -> Iterator[ShownPanel]:
    """Run a node with these parameters and a panel for it, and open its page, once the first answer is there."""
    lock, stop = threading.Lock(), threading.Event()
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host='127.0.0.1', port=port, verbose=False)
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    arguments = ('ros_ik_pkg.ros.ik_node', '--ros-args', *CALM_ARGUMENTS, *TOLERANCES, *parameters)
    with running(log, *arguments), ros_node(name) as node:
        panel = Panel(server, node, topics.NODE_NAME)
        executor = SingleThreadedExecutor()
        executor.add_node(node)

        def serve() -> None:
            while not stop.is_set():
                spin_for(executor, TICK)
                with lock:
                    panel.tick()

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            with open_page(f'http://127.0.0.1:{server.get_port()}', *size) as page:
                page.get_by_test_id('comparison').locator('tr[data-method]').nth(4).wait_for(timeout=PAGE_TIMEOUT)
                yield ShownPanel(page, panel, lock, node)
        finally:
            stop.set()
            thread.join()
            with contextlib.redirect_stdout(io.StringIO()):
                server.stop()


def pixel_of(shown: ShownPanel, point: np.ndarray) -> tuple[float, float]:
    """Return where the page shows a point (3,) [m] of the base frame."""
    (client,) = shown.panel._server.get_clients().values()
    camera = client.camera
    x, y, z = pin.Quaternion(*camera.wxyz).matrix().T @ (point - camera.position)  # z ahead, y down
    box = shown.page.locator('canvas').last.bounding_box()
    scale = box['height'] / 2 / np.tan(camera.fov / 2) / z
    return box['x'] + box['width'] / 2 + scale * x, box['y'] + box['height'] / 2 + scale * y


def drag(shown: ShownPanel, start: np.ndarray, end: np.ndarray, steps: int = 8) -> None:
    """Drag what is at a point (3,) [m] of the scene to where another one is seen."""
    shown.close_warning()
    mouse = shown.page.mouse
    (x0, y0), (x1, y1) = pixel_of(shown, start), pixel_of(shown, end)
    mouse.move(x0 - 3, y0)
    shown.page.wait_for_timeout(800)  # the gizmo notices the pointer in a frame, and a frame takes long here
    mouse.move(x0, y0)
    shown.page.wait_for_timeout(800)
    mouse.down()
    shown.page.wait_for_timeout(300)
    for k in range(1, steps + 1):
        mouse.move(x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps)
        shown.page.wait_for_timeout(150)
    mouse.up()
