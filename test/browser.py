"""For tests in a real browser: Chromium of the system, driven by Playwright, and the panel as a process."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
BROWSERS = ('chromium', 'chromium-browser', 'google-chrome')
FLAGS = (
    '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync',
    '--disable-gpu-compositing',  # twice the frames where the graphics card is a program: the page around needs none
)  # fmt: skip
START_TIMEOUT = 900.0  # s; the first start on a machine compiles, a busy one for minutes
PAGE_TIMEOUT = 120e3  # ms; without a graphics card two cores draw a frame in a second, where nothing else is to do
STOP_TIMEOUT = 60.0  # s; far beyond what it takes


def need_browser() -> None:
    """Skip the test where there is no browser, no Playwright or no viser; fail where they are required."""
    missing = [name for name in ('viser', 'playwright') if not _is_installed(name)]
    if not any(map(shutil.which, BROWSERS)):
        missing.append('a chromium in the PATH')
    if missing:
        text = f'no {", ".join(missing)}; scripts/test --all and apt install chromium bring them'
        assert os.environ.get('ROS_IK_BROWSER') != 'required', text
        pytest.skip(text, allow_module_level=True)


def _is_installed(name: str) -> bool:
    from importlib.util import find_spec

    return find_spec(name) is not None


@contextlib.contextmanager
def open_page(url: str, width: int = 1280, height: int = 800) -> Iterator:
    """Open a page in a headless browser of its own."""
    from playwright.sync_api import sync_playwright

    executable = next(filter(None, map(shutil.which, BROWSERS)))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable, args=FLAGS)
        page = browser.new_page(viewport={'width': width, 'height': height})
        page.set_default_timeout(PAGE_TIMEOUT)
        page.goto(url)
        yield page
        browser.close()


@contextlib.contextmanager
def running(log: Path, module: str, *arguments: str) -> Iterator[subprocess.Popen]:
    """Run a module of the package as a process; it must end on Ctrl-C, with code 0, unless it is killed before."""
    with log.open('wb') as output:
        process = subprocess.Popen(
            [sys.executable, '-m', module, *arguments], cwd=ROOT, stdout=output, stderr=subprocess.STDOUT
        )
        try:
            yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                try:
                    assert process.wait(STOP_TIMEOUT) == 0, log.read_text()
                finally:
                    process.kill()


def address(log: Path) -> str:
    """Wait until the panel prints where it is."""
    deadline = time.monotonic() + START_TIMEOUT
    while not (found := re.search(r'open (http://\S+) ', log.read_text())):
        assert time.monotonic() < deadline, log.read_text()
        time.sleep(0.05)
    return found[1]
