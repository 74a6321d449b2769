"""What every test run gets: a ROS domain of its own on this machine alone, and quick discovery."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import pytest

from ros_ik_pkg.tools.domain import own_domain

gc.disable()  # while tests are collected: it would scan the thousands of them again and again, to find nothing
ROOT = Path(__file__).resolve().parents[1]
# Begun first, so that no core waits for one of them at the end. With an empty cache the first compiles the solver for
# one chain, which the next four do not need, and the sixth that for two; the others load what these have compiled,
# and the last two compile in folders of their own.
LONG = (
    'project/test_complaints', 'ik/kernel/test_wide', 'project/test_extending', 'ros/servo/test_limiter',
    'ros/runtime/test_stop_flag', 'ik/test_tips', 'tools/test_torture', 'tools/test_programs', 'ros/test_node',
    'ik/step/test_methods', 'project/test_docs', 'ik/test_compilation', 'ik/kernel/test_compiled',
)  # fmt: skip


@pytest.fixture(scope='session', autouse=True)
def domain(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """Keep this run, and the processes it starts, apart from all other ROS programs."""
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    profiles, variable = ROOT / 'test' / 'fastdds.xml', 'FASTRTPS_DEFAULT_PROFILES_FILE'
    if has_fast_dds_3():
        os.environ.pop(variable, None)  # the user's would count, not the new one
        text = profiles.read_text().replace('heartbeatPeriod', 'heartbeat_period')
        profiles, variable = tmp_path_factory.mktemp('dds') / 'fastdds.xml', 'FASTDDS_DEFAULT_PROFILES_FILE'
        profiles.write_text(text)
    os.environ[variable] = str(profiles)
    with own_domain() as number:
        yield number


def has_fast_dds_3() -> bool:
    """Return whether ROS is newer than Jazzy, whose rclpy is 7."""
    try:
        return int(metadata.version('rclpy').partition('.')[0]) > 7
    except metadata.PackageNotFoundError:  # the numerics are tested without ROS too
        return False


@pytest.fixture(scope='session')
def root() -> Path:
    """Path of the repository."""
    return ROOT


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that makes test_panel.py write the pictures of the README."""
    parser.addoption('--screenshots', metavar='FOLDER', help='write screenshots of the panel there')


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the files that take longest first, then those that wait for processes, and the many short ones last."""
    places = {f'{name}.py': place for place, name in enumerate(LONG)}

    def place(item: pytest.Item) -> int:
        name = item.nodeid.partition('::')[0].removeprefix('test/')
        return places.get(name, len(LONG) + name.startswith('ik/'))

    items.sort(key=place)


def pytest_collection_finish() -> None:
    """Let the garbage collector begin, and leave alone what is there now."""
    gc.freeze()
    gc.enable()
