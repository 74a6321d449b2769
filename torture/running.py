"""The node under test as a process: started with any environment, watched through /proc, killed if wanted."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from bench.process import ROOT

START_TIMEOUT = 900.0  # s; two first starts at once compile on every core, for minutes on a busy machine
STOP_TIMEOUT = 20.0  # s
PAGE = os.sysconf('SC_PAGE_SIZE')
NODE = 'ros_ik_pkg.ros.ik_node'
COUNTED_NODE, LOCALIZED_NODE = 'torture.counted_node', 'torture.localized_node'
COUNTS_FILE = 'ROS_IK_TORTURE_COUNTS'  # variable of the environment
TARGETS, JOINT_STATES = range(2)  # places in the file of counts


@dataclass(frozen=True)
class Usage:
    """Resources of a process at one time."""

    memory: float  # MB resident
    files: int
    threads: int


def map_counts(path: str | os.PathLike[str], mode: Literal['r+', 'w+']) -> np.ndarray:
    """Map the counts of a COUNTED_NODE to memory, (2,)."""
    return np.memmap(path, np.int64, mode, shape=2)


class RunningNode:
    """An IK node in a separate process, with its output in a log file."""

    def __init__(
        self, log: Path, words: Sequence[str] = (), before: Sequence[str] = (), program: str = NODE, **environment: str
    ) -> None:
        self.log = log
        counts = log.with_suffix('.counts')
        self._counts = map_counts(counts, 'w+')
        self._environment = {**os.environ, 'PYTHONPATH': str(ROOT), COUNTS_FILE: str(counts), **environment}
        self._command = [*before, sys.executable, '-m', program, '--ros-args', *words]
        self.start()

    def start(self) -> None:
        """Start the process, also after a kill; the log is truncated."""
        with self.log.open('wb') as output:
            self.process = subprocess.Popen(
                self._command, env=self._environment, cwd=ROOT, stdout=output, stderr=subprocess.STDOUT,
                start_new_session=True,
            )  # fmt: skip

    def wait_until_ready(self) -> float:
        """Wait until the node logs that it is ready; return the time [s]. Raises RuntimeError."""
        began = time.monotonic()
        while 'ready: ' not in self.said():
            if not self.alive or time.monotonic() > began + START_TIMEOUT:
                raise RuntimeError(f'the node did not start: {self.said()[-2000:]}')
            time.sleep(0.05)
        return time.monotonic() - began

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self.process.poll() is None

    def said(self) -> str:
        """Return the log so far."""
        return self.log.read_text(errors='replace')

    def lines(self) -> int:
        """Return how many lines the log has so far."""
        return self.said().count('\n')

    def usage(self) -> Usage:
        """Return the resources of the process from /proc."""
        proc = Path(f'/proc/{self.process.pid}')  # also behind `unshare` and `ip netns exec`, which become the node
        pages = int((proc / 'statm').read_text().split()[1])
        return Usage(pages * PAGE / 2**20, len(os.listdir(proc / 'fd')), len(os.listdir(proc / 'task')))

    def taken(self) -> tuple[int, int]:
        """Return how many targets and joint states a COUNTED_NODE has taken so far."""
        return int(self._counts[TARGETS]), int(self._counts[JOINT_STATES])

    def kill(self) -> None:
        """End the process as a crash would."""
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def stop(self) -> int:
        """Stop the process as Ctrl-C does; return its exit code, or that of a kill if it hangs."""
        if self.alive:
            os.killpg(self.process.pid, signal.SIGINT)
        try:
            return self.process.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            self.kill()
            return self.process.wait()

    def fault(self) -> str:
        """Return the fault of the process; empty if there is none."""
        if not self.alive:
            return f'the node ended with {self.process.returncode}: {self.said()[-500:]}'
        return f'in the log: {self.said()[-500:]}' if 'Traceback' in self.said() else ''


@contextlib.contextmanager
def running_node(*words: str, program: str = NODE, **environment: str) -> Iterator[RunningNode]:
    """Run a node that is ready, and stop it in the end; it must end by itself, with 0."""
    with tempfile.TemporaryDirectory(prefix='ros_ik_pkg_torture_') as folder:
        node = RunningNode(Path(folder, 'log'), words, program=program, **environment)
        try:
            node.wait_until_ready()
            yield node
        finally:
            code = node.stop()
        if code:
            raise RuntimeError(f'the node ended with {code}: {node.said()[-2000:]}')
