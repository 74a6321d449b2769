"""Signals and the end of the launcher stop a program once, cleanly, however often they come."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ros_ik_pkg.ros.runtime.stop_flag import LAUNCHER_VARIABLE

ROOT = Path(__file__).resolve().parents[3]
TIMEOUT = 60.0  # s
NODE = """
import os, time
from ros_ik_pkg.ros.runtime.stop_flag import StopFlag

class SlowToFree:  # stands for what a node frees while the interpreter ends
    def __del__(self, write=os.write, sleep=time.sleep):
        write(1, b'ending\\n')
        sleep(0.5)

flag = StopFlag()
slow = SlowToFree()
try:
    print('starting', flush=True)
    {start}
    flag.spinning = True
    while not flag.stopped:
        time.sleep(0.02)
except KeyboardInterrupt:
    pass
finally:
    print('stopping', flush=True)
    time.sleep(0.3)
"""


def program(start: str = 'pass', **environment: str) -> subprocess.Popen:
    """Return a process that starts, spins until it is stopped, and takes a while to stop."""
    return subprocess.Popen(
        [sys.executable, '-c', NODE.format(start=start)],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, **environment},
    )  # fmt: skip


def wait_for(process: subprocess.Popen, word: str) -> None:
    while line := process.stdout.readline():
        if line.strip() == word:
            return
    raise AssertionError(f'no {word}: {process.stderr.read()}')


@pytest.mark.parametrize('start', ['pass', 'time.sleep(30)'], ids=['spinning', 'starting'])
@pytest.mark.parametrize('second', ['stopping', 'ending'])
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_second_signal_does_not_break_into_the_shutdown(start, second, number):
    with program(start) as process:
        wait_for(process, 'starting')
        time.sleep(0.1)
        process.send_signal(number)
        wait_for(process, second)
        process.send_signal(number)
        assert process.wait(TIMEOUT) == 0
        assert process.stderr.read() == ''


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGKILL])
def test_a_program_ends_when_its_launcher_has_ended(number):
    with subprocess.Popen(['sleep', '60']) as launcher, program(**{LAUNCHER_VARIABLE: str(launcher.pid)}) as process:
        wait_for(process, 'starting')
        launcher.send_signal(number)
        launcher.wait()
        assert process.wait(TIMEOUT) == 0
        assert process.stderr.read() == ''


def test_a_program_that_was_not_launched_goes_on_until_a_signal():
    with program(**{LAUNCHER_VARIABLE: '0'}) as process:
        wait_for(process, 'starting')
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(0.5)
        process.terminate()
        assert process.wait(TIMEOUT) == 0
