"""The programs behind the scripts, each a process of its own, over DDS."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from ros_helpers import CALM_ARGUMENTS

from ros_ik_pkg.ik import METHODS
from ros_ik_pkg.ros.reply import Reply
from ros_ik_pkg.tools import demo
from ros_ik_pkg.tools.demo import REACHABLE

ROOT = Path(__file__).resolve().parents[2]
STAMP = Path(sys.prefix, 'ros_ik_pkg.stamp')
# The scripts of this folder would make an environment of another folder's scripts anew, under whoever uses it.
MADE_BY_THE_SCRIPTS = STAMP.exists() and STAMP.read_text().startswith(f'{ROOT} | ')
START_TIMEOUT = '900'  # s; the first start on a machine compiles
STOP_TIMEOUT = 60.0  # s; far beyond what it takes
ROS_ARGUMENTS = ['--ros-args', '-p', 'seed_source:=home', *CALM_ARGUMENTS]
NEAR_HOME = ['0.5', '0.15', '0.3', '0', '90', '0', '--degrees']


def run(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, '-m', f'ros_ik_pkg.tools.{program}', *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)


@pytest.fixture(scope='module')
def node() -> Iterator[subprocess.Popen[bytes]]:
    """The node as scripts/run starts it, or its module where this environment is not one of the scripts."""
    command = [ROOT / 'scripts' / 'run', '--robot=puma560', '--method', 'sdls', *ROS_ARGUMENTS]
    if not MADE_BY_THE_SCRIPTS:
        parameters = ['-p', 'robot:=puma560', '-p', 'method:=sdls']
        command = [sys.executable, '-m', 'ros_ik_pkg.ros.ik_node', *ROS_ARGUMENTS, *parameters]
    environment = {**os.environ, 'ROS_IK_VENV': sys.prefix}
    process = subprocess.Popen(command, cwd=ROOT, env=environment)
    run('send_target', *NEAR_HOME, '--timeout', START_TIMEOUT)
    yield process
    process.send_signal(signal.SIGINT)
    try:
        assert process.wait(STOP_TIMEOUT) == 0
    finally:
        process.kill()


def test_demo_finds_every_answer_right():
    done = run('demo')
    assert done.returncode == 0, done.stdout + done.stderr
    for method in METHODS:
        lines = re.findall(rf'^{method} .*$', done.stdout, re.MULTILINE)
        assert len(lines) == REACHABLE + 1
        assert sum(line.endswith('solved') for line in lines) == REACHABLE
        assert 'unreachable' in lines[-1]
    total = len(METHODS) * (REACHABLE + 1)
    assert f'{total} of {total} answers right' in done.stdout


def test_demo_asks_again_while_the_joints_come_late():
    class Client:
        asked = published = 0

        def publish_joints(self, positions):
            self.published += 1

        def solve(self, pose, timeout):
            self.asked += 1
            status = 'joint_states' if self.asked < 3 else 'unreachable'
            return Reply((0, 0), DiagnosticStatus(values=[KeyValue(key='status', value=status)]))

    client = Client()
    assert demo.ask(client, {}, np.eye(4)).figures['status'] == 'unreachable'
    assert client.asked == client.published == 3


def test_demo_says_what_is_wrong_with_a_robot():
    done = run('demo', '--robot', 'robby')
    assert done.returncode == 1
    assert 'robby' in done.stderr
    assert 'puma560' in done.stderr


def test_send_target_prints_result_and_joint_positions(node):
    done = run('send_target', *NEAR_HOME)
    assert done.returncode == 0, done.stdout + done.stderr
    assert 'method: sdls' in done.stdout
    assert re.search(r'^  joint6: -?\d\.\d{9}$', done.stdout, re.MULTILINE)


def test_send_target_ends_with_2_for_a_target_out_of_reach(node):
    done = run('send_target', '9', '0', '0', '0', '0', '0')
    assert done.returncode == 2
    assert 'status: unreachable' in done.stdout


def test_send_target_ends_with_2_and_the_reason_for_an_unknown_frame(node):
    done = run('send_target', *NEAR_HOME, '--frame', 'moon')
    assert done.returncode == 2
    assert 'moon' in done.stdout


def test_set_param_sets_for_the_next_target(node):
    done = run('set_param', 'method', 'dls')
    assert (done.returncode, done.stdout) == (0, "method = 'dls'\n"), done.stderr
    assert 'method: dls' in run('send_target', *NEAR_HOME).stdout


def test_set_param_takes_a_whole_number_where_a_number_is_meant(node):
    assert run('set_param', 'deadline', '1').stdout == 'deadline = 1.0\n'
    weights = run('set_param', 'task_weights', '[1, 1, 1, 1, 1, 0.5]')
    assert weights.returncode == 0, weights.stderr


def test_set_param_gives_the_reason_of_a_refusal(node):
    done = run('set_param', 'max_iterations', '-1')
    assert done.returncode == 1
    assert 'max_iterations' in done.stderr
    assert '-1' in done.stderr


def test_numbers_with_an_exponent_are_taken_as_they_are(node):
    done = run('set_param', 'position_tolerance', '1e-4')
    assert (done.returncode, done.stdout) == (0, 'position_tolerance = 0.0001\n'), done.stderr
    assert run('set_param', 'task_tolerances', '[0, 0, 1e-3, 0, 0, 0]').returncode == 0
    done = run('send_target', '0.5', '-1e-3', '3E-1', '0', '90', '-0', '--degrees', '--timeout', '60')
    assert done.returncode == 0, done.stdout + done.stderr
    assert run('set_param', 'task_tolerances', '[0, 0, 0, 0, 0, 0]').returncode == 0


@pytest.mark.parametrize(
    ('name', 'value', 'expected'),
    [
        ('deadline', '[1,', 'expected a number from 0 to 3600'),
        ('deadline', 'soon', "deadline = 'soon' is not allowed: expected a number from"),
        ('deadline', '', 'expected a number from'),
        ('deadline', 'true', 'expected a number from'),
        ('task_weights', '[1,', "task_weights = '[1,' is not allowed: expected 6 numbers"),
        ('task_weights', '{a: 1}', 'expected 6 numbers'),
        ('task_weights', '[1, a]', "task_weights = '[1, a]' is not allowed: expected 6 numbers"),
        ('task_weights', '[1, true, 1, 1, 1, 1]', 'expected 6 numbers'),
        ('max_iterations', '99999999999999999999', 'max_iterations = 1e+20 is not allowed: expected a whole number'),
        ('max_iterations', '1e3.5', "max_iterations = '1e3.5' is not allowed: expected a whole number"),
        ('max_iterations', '9' * 400, 'expected a whole number'),
        ('respect_limits', '{a: 1}', 'expected true or false'),
        ('compare', '[dls, 1]', 'expected a list of any of'),
        ('compare', '2020-01-01', 'expected a list of any of'),
    ],
)
def test_set_param_of_what_is_no_value_ends_with_what_was_got_and_expected(node, name, value, expected):
    done = run('set_param', name, value)
    assert done.returncode == 1 and done.stdout == ''
    assert done.stderr.startswith('set_param: ') and done.stderr.count('\n') == 1, done.stderr
    assert expected in done.stderr


@pytest.mark.parametrize('arguments', [['--timeout', '0'], ['--timeout', '-1e3'], ['--node', 'ik node']])
def test_send_target_says_what_is_wrong_with_an_argument(arguments):
    done = run('send_target', *NEAR_HOME, *arguments)
    assert done.returncode == 1
    assert re.match(r'send_target: (timeout|name of the IK node) is .*; expected', done.stderr), done.stderr


def test_set_param_lists_the_parameters_for_an_unknown_one(node):
    done = run('set_param', 'metod', 'dls')
    assert done.returncode == 1
    assert "no parameter 'metod'; did you mean method" in done.stderr
    assert 'dls.damping' in done.stderr


def test_without_a_node_the_programs_say_how_to_start_one():
    done = run('send_target', *NEAR_HOME, '--node', '/nobody', '--timeout', '1')
    assert done.returncode == 1
    assert 'no node /nobody' in done.stderr
    assert 'scripts/run' in done.stderr
