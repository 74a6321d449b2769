"""The wheel is small, has what PyPI shows, and works in an environment that holds nothing else, without ROS."""

from __future__ import annotations

import email
import os
import shutil
import subprocess
import sys
import zipfile
from email.message import Message
from pathlib import Path

import pytest

pytestmark = [pytest.mark.once, pytest.mark.workspace]

NAME = 'ros_ik_pkg'
ROOT = Path(__file__).resolve().parents[2]
BUILT = ('.git', '.venv*', '.*_cache', '.hypothesis', 'build', 'install', 'log', '__pycache__', '*.egg-info')
MOST_BYTES = 1e6
SOLVE = """
import sys
from ros_ik_pkg.ik import load_arm, solve
import ros_ik_pkg.compare.command
arm = load_arm('ur5')
solution = solve(arm, arm.forward(arm.home + 0.3), seed=arm.home)
print(solution.converged, solution.position_error < 1e-5, *(set(sys.modules) & {'rclpy', 'matplotlib', 'viser'}))
"""


@pytest.fixture(scope='module')
def wheel(tmp_path_factory) -> Path:
    """The wheel that is made from the source distribution, as PyPI's users get it."""
    folder = tmp_path_factory.mktemp('wheel')
    shutil.copytree(ROOT, folder / 'source', ignore=shutil.ignore_patterns(*BUILT))
    build = f'import sys; from setuptools import build_meta; build_meta.build_sdist({str(folder)!r})'
    subprocess.run([sys.executable, '-c', build], cwd=folder / 'source', check=True, capture_output=True)
    (source,) = folder.glob('*.tar.gz')
    pip = [sys.executable, '-m', 'pip', 'wheel', '--quiet', '--no-deps', '--no-build-isolation']
    subprocess.run([*pip, '--wheel-dir', str(folder), str(source)], check=True)
    (made,) = folder.glob('*.whl')
    return made


@pytest.fixture(scope='module')
def environment(wheel, tmp_path_factory) -> Path:
    """The folder of programs of an environment that holds the wheel and what it requires."""
    folder = tmp_path_factory.mktemp('empty')
    subprocess.run([sys.executable, '-m', 'venv', str(folder)], check=True)
    subprocess.run([folder / 'bin' / 'pip', 'install', '--quiet', str(wheel)], check=True)
    return folder / 'bin'


@pytest.fixture(scope='module')
def metadata(wheel) -> Message:
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith('.dist-info/METADATA'))
        return email.message_from_bytes(archive.read(name))


def run(bin_folder: Path, *command: str) -> subprocess.CompletedProcess[str]:
    """Run a program of the environment away from this repository and from ROS."""
    kept = {name: os.environ[name] for name in ('HOME', 'NUMBA_CACHE_DIR', 'XDG_CACHE_HOME') if name in os.environ}
    environment = {'PATH': '/usr/bin:/bin', **kept}
    words = [bin_folder / command[0], *command[1:]]
    return subprocess.run(words, cwd=bin_folder, env=environment, capture_output=True, text=True, check=False)


def test_the_wheel_is_under_a_megabyte_and_for_every_platform(wheel):
    assert wheel.stat().st_size < MOST_BYTES
    assert wheel.name.endswith('-py3-none-any.whl')


def test_the_metadata_has_what_pypi_shows(metadata):
    assert metadata['Requires-Python'] == '>=3.11'
    assert metadata['Description-Content-Type'] == 'text/markdown'
    assert metadata.get_payload().startswith('# ros_ik_pkg')
    assert {'ros', 'kilted', 'panel', 'plot', 'collision', 'path', 'servo'} <= set(metadata.get_all('Provides-Extra'))
    for field in ('Summary', 'License', 'Keywords', 'Classifier'):
        assert metadata[field]


def test_the_wheel_solves_in_an_environment_without_ros(environment):
    done = run(environment, 'python', '-c', SOLVE)
    assert done.stdout.split() == ['True', 'True'], done.stderr


def test_programs_that_need_no_ros_run_there(environment):
    done = run(environment, 'compare', '--robot', 'puma560', '--methods', 'dls')
    assert done.returncode == 0 and 'dls' in done.stdout, done.stderr
    assert not any(run(environment, program, '--help').returncode for program in ('compile', 'reach'))


def test_programs_that_need_ros_say_where_it_comes_from(environment):
    for program in ('ik_node', 'demo', 'send_target', 'send_path', 'set_param', 'teleop', 'panel'):
        done = run(environment, program, '--help')
        assert done.returncode == 1
        assert "pip install 'ros_ik_pkg[ros]'" in done.stderr.splitlines()[-1], program
