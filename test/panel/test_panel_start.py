"""scripts/panel from the command line: what cannot be served ends with a word and a code, never with a wait."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from ros_helpers import START_TIMEOUT, allow_lark

pytest.importorskip('viser', reason='viser is not installed: scripts/panel installs it')
pytestmark = [allow_lark, pytest.mark.once]

ROOT = Path(__file__).resolve().parents[2]


def run(module: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, '-m', f'ros_ik_pkg.panel.{module}', *arguments]
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=START_TIMEOUT)


def test_a_robot_that_the_node_does_not_know_ends_the_panel_too():
    done = run('start', '--robot', 'nope', '--port', '18110')
    assert done.returncode == 1
    assert "robot 'nope' is not known" in done.stderr.replace('"', "'")
    assert 'panel: the IK node ended by itself, with code 1' in done.stderr
    assert 'Traceback' not in done.stderr


@pytest.mark.parametrize('module', ['start', 'panel_node'])
@pytest.mark.parametrize('host', ['192.0.2.1', 'no such host'])
def test_an_address_of_another_machine_is_refused(module, host):
    done = run(module, '--host', host)
    assert done.returncode == 1 and 'Traceback' not in done.stderr
    assert f'panel: cannot serve on --host {host}: ' in done.stderr


@pytest.mark.parametrize('port', ['99999', '0', '-1', 'many'])
def test_a_port_that_no_server_can_have_is_refused(port):
    done = run('start', f'--port={port}')
    assert done.returncode == 2 and done.stdout == '' and 'Traceback' not in done.stderr
    assert f"'{port}' is not a port; expected 1 to 65535" in done.stderr


def test_a_node_by_a_name_that_is_none_is_refused():
    done = run('panel_node', '--node', 'no name', '--port', '18111')
    assert done.returncode == 1 and 'Traceback' not in done.stderr
    assert "panel: name of the IK node is 'no name'" in done.stderr
