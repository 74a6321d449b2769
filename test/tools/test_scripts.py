"""The scripts do what their help says, and the environment that they share survives accidents."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from ros_ik_pkg.methods import METHODS
from ros_ik_pkg.tools import demo, path, send_path, send_target, set_param, teleop

pytestmark = pytest.mark.once

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = sorted(path.name for path in (ROOT / 'scripts').iterdir() if os.access(path, os.X_OK))
PROGRAMS = {
    'demo': demo, 'path': path, 'send_path': send_path, 'send_target': send_target, 'set_param': set_param,
    'teleop': teleop,
}  # fmt: skip
BARE = {'PATH': '/usr/bin:/bin', 'HOME': '/nonexistent'}

# Stands for an interpreter: makes environments whose pip keeps a record, and waits until a file is gone.
FAKE_PYTHON = """#!/bin/sh
case "$1 $2" in
"-m venv") mkdir -p "$3/bin" && cp "$0" "$3/bin/python" ;;
"-m pip") echo installed >>"$RECORD"; while [ -e "$PIP_WAITS_FOR" ]; do sleep 0.02; done ;;
"- "*) cat >/dev/null; echo "$0" ;;
esac
"""

SCRIPT = """#!/bin/bash
set -euo pipefail
. "${0%/*}/_env.sh"
use_python "$@"
echo "$python"
"""


@pytest.mark.parametrize('script', SCRIPTS)
def test_help_comes_at_once_and_without_an_environment(script, tmp_path):
    environment = {**BARE, 'ROS_IK_VENV': str(tmp_path / 'venv')}
    shown = subprocess.check_output([ROOT / 'scripts' / script, '--help'], env=environment, text=True)
    assert f'scripts/{script}' in shown
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize('name', PROGRAMS)
def test_help_of_a_script_names_every_option_of_its_program(name):
    options = set(re.findall(r'--[a-z-]+', PROGRAMS[name].arguments().format_help())) - {'--help'}
    assert options <= set(re.findall(r'--[a-z-]+', (ROOT / 'scripts' / name).read_text()))


@pytest.mark.parametrize('script', ['bench', 'compare', 'run'])
def test_help_of_a_script_names_the_methods_of_the_table(script):
    text = (ROOT / 'scripts' / script).read_text()
    (line,) = re.findall(r'^#   --methods?\b(?! transpose\|)(.*transpose.*)$', text, re.MULTILINE)
    assert [word for word in re.findall(r'\w+', line) if word in METHODS or word.endswith('dls')] == list(METHODS)


def test_run_refuses_an_argument_it_does_not_know():
    command = [ROOT / 'scripts' / 'run', '--speed', '3']
    done = subprocess.run(command, env=BARE, capture_output=True, text=True)
    assert done.returncode == 1
    assert "unknown argument '--speed'" in done.stderr


@pytest.mark.parametrize('option', ['--robot', '--method', '--params-file'])
def test_run_says_that_an_option_needs_a_value(option):
    done = subprocess.run([ROOT / 'scripts' / 'run', option], env=BARE, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (1, f'ros_ik_pkg: {option} needs a value\n')


@pytest.mark.parametrize('given', [['--robot='], ['--robot', '']])
def test_run_takes_an_empty_robot(given, tmp_path):
    shutil.copy(ROOT / 'scripts' / 'run', tmp_path)
    (tmp_path / '_env.sh').write_text('help_if_asked() { :; }\nuse_python() { python=echo; }\n')
    done = subprocess.run([tmp_path / 'run', *given], env=BARE, capture_output=True, text=True)
    assert done.stdout == "-m ros_ik_pkg.ros.ik_node --ros-args -p robot:='' --\n", done.stderr


class Setup:
    """A copy of the scripts' environment code, set up with a fake interpreter."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.record = folder / 'record'
        self.hold = folder / 'hold'
        self.venv = folder / 'repo' / '.venv'
        (folder / 'repo' / 'scripts').mkdir(parents=True)
        shutil.copy(ROOT / 'setup.cfg', folder / 'repo')
        shutil.copy(ROOT / 'scripts' / '_env.sh', folder / 'repo' / 'scripts')
        self.interpreter = self.program('interpreter', FAKE_PYTHON)
        self.script = self.program('repo/scripts/use', SCRIPT)

    def program(self, name: str, text: str) -> Path:
        path = self.folder / name
        path.parent.mkdir(exist_ok=True, parents=True)
        path.write_text(text)
        path.chmod(0o755)
        return path

    def start(self, *extras: str, **environment: str) -> subprocess.Popen[str]:
        chosen = {'ROS_IK_PYTHON': str(self.interpreter), 'RECORD': str(self.record)}
        return subprocess.Popen(
            [self.script, *extras],
            env={**BARE, **chosen, **environment},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def run(self, *extras: str, **environment: str) -> subprocess.CompletedProcess[str]:
        process = self.start(*extras, **environment)
        out, err = process.communicate()
        return subprocess.CompletedProcess(process.args, process.returncode, out, err)

    @property
    def installs(self) -> int:
        return len(self.record.read_text().splitlines()) if self.record.exists() else 0


@pytest.fixture
def setup(tmp_path) -> Setup:
    return Setup(tmp_path)


def test_environment_is_made_once(setup):
    first, second = setup.run('ros'), setup.run('ros')
    assert first.stdout.strip() == second.stdout.strip() == str(setup.venv / 'bin' / 'python')
    assert setup.installs == 1
    assert second.stderr == ''


def test_an_extra_is_added_to_the_environment_that_is_there(setup):
    setup.run('ros')
    (setup.venv / 'kept').touch()
    setup.run('ros', 'plot')
    setup.run('plot')
    assert setup.installs == 2
    assert (setup.venv / 'kept').exists()


def test_two_set_ups_at_once_make_one_environment(setup):
    setup.hold.touch()
    first = setup.start('ros', PIP_WAITS_FOR=str(setup.hold))
    assert 'making' in first.stderr.readline()
    assert 'installing' in first.stderr.readline()
    second = setup.start('ros')
    assert 'waiting for another run' in second.stderr.readline()
    setup.hold.unlink()
    outputs = [process.communicate() for process in (first, second)]
    assert [first.returncode, second.returncode] == [0, 0], outputs
    assert setup.installs == 1


def test_an_interrupted_set_up_starts_afresh(setup):
    setup.hold.touch()
    process = setup.start('ros', PIP_WAITS_FOR=str(setup.hold))
    assert 'making' in process.stderr.readline()
    assert 'installing' in process.stderr.readline()
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    (setup.venv / 'half').touch()
    assert setup.run('ros').returncode == 0
    assert not (setup.venv / 'half').exists()


def test_a_broken_environment_is_made_again(setup):
    setup.run('ros')
    (setup.venv / 'bin' / 'python').unlink()
    assert setup.run('ros').returncode == 0
    assert (setup.venv / 'bin' / 'python').exists()


def test_changed_requirements_are_installed(setup):
    setup.run('ros')
    with (setup.folder / 'repo' / 'setup.cfg').open('a') as file:
        file.write('\n')
    setup.run('ros')
    assert setup.installs == 2


def test_another_interpreter_gets_an_environment_of_its_own_making(setup):
    setup.run('ros')
    (setup.venv / 'old').touch()
    other = setup.program('other/interpreter', FAKE_PYTHON)
    setup.run('ros', ROS_IK_PYTHON=str(other))
    assert not (setup.venv / 'old').exists()


def test_a_folder_that_is_no_environment_is_not_deleted(setup):
    folder = setup.folder / 'home'
    folder.mkdir()
    (folder / 'thesis.tex').write_text('years of work')
    done = setup.run('ros', ROS_IK_VENV=str(folder))
    assert done.returncode == 1 and 'is no Python environment' in done.stderr
    assert (folder / 'thesis.tex').exists()


def test_the_environment_of_another_clone_is_not_deleted(setup, tmp_path):
    setup.run('ros')
    (setup.venv / 'kept').touch()
    other = Setup(tmp_path / 'other')
    done = other.run('ros', ROS_IK_VENV=str(setup.venv))
    assert done.returncode == 1 and f'belongs to {setup.folder / "repo"}' in done.stderr
    assert (setup.venv / 'kept').exists()


def test_another_distribution_gets_an_environment_of_its_own_making(setup):
    setup.run('ros')
    (setup.venv / 'old').touch()
    setup.run('ros', ROS_IK_DISTRO='kilted')
    assert not (setup.venv / 'old').exists()


@pytest.mark.parametrize(('distro', 'other'), [('jazzy', 'kilted'), ('kilted', 'jazzy')])
def test_the_wheels_of_ros_are_those_of_the_distribution(setup, distro, other):
    (setup.venv / 'bin').mkdir(parents=True)
    (setup.venv / 'bin' / 'python').symlink_to(sys.executable)
    setup.script.write_text(SCRIPT.replace('use_python "$@"', 'requirements ros; exit'))
    listed = setup.run(ROS_IK_DISTRO=distro).stdout
    assert f'ros-{distro}-rclpy' in listed and other not in listed


def test_a_distribution_without_wheels_is_refused(setup):
    done = setup.run('ros', ROS_IK_DISTRO='humble')
    assert done.returncode == 1 and 'jazzy and kilted have' in done.stderr


def test_a_failed_installation_shows_what_pip_said(setup):
    setup.interpreter.write_text(FAKE_PYTHON.replace('echo installed', 'echo no such package; exit 1; echo'))
    done = setup.run('ros')
    assert done.returncode == 1
    assert 'no such package' in done.stderr
    assert 'pip could not install' in done.stderr


def test_an_interpreter_that_does_not_run_is_passed_over(setup):
    shims = setup.program('shims/python3.12', '#!/bin/sh\nexit 127\n').parent
    (shims / 'python3').symlink_to(sys.executable)
    version = '.'.join(map(str, sys.version_info[:2]))
    setup.script.write_text(SCRIPT.replace('use_python "$@"', f'python=$(find_python {version})'))
    found = setup.run(PATH=f'{shims}:{BARE["PATH"]}')
    assert Path(found.stdout.strip()).name.startswith('python'), found.stderr


def test_without_a_fitting_python_the_message_says_what_to_do(setup):
    tools = setup.folder / 'tools'
    tools.mkdir()
    for name in ('bash', 'dirname', 'realpath', 'cksum', 'grep', 'flock', 'mkdir', 'env'):
        (tools / name).symlink_to(shutil.which(name))
    done = setup.run('ros', ROS_IK_PYTHON='', PATH=str(tools))
    assert done.returncode == 1
    assert 'no Python 3.12 or 3.11' in done.stderr
    assert 'ROS_IK_PYTHON' in done.stderr
