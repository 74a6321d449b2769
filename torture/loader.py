"""A process that loads robot files, so that one which would take all time or memory can be seen and ended."""

from __future__ import annotations

import contextlib
import json
import os
import re
import resource
import select
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.process import ROOT
from ros_ik_pkg.ik import ModelError, load_arm
from torture.place import names_a_place
from torture.plan import unless

MOST_MEMORY = 800  # MB that loading may add
HANG = 20.0  # s, for one file; the largest that is read has 32 MB
START = 120.0  # s
CRASH = 1.0  # s, between the end of the output of a process and its own
LONGEST_ERROR = 2000  # characters
SHOWN = 2000  # characters of a file
HIGH_WATER = re.compile(r'VmHWM:\s+(\d+) kB')
PAGE = os.sysconf('SC_PAGE_SIZE')


@dataclass(frozen=True)
class Loaded:
    """Outcome of a file: 'loaded', 'refused' or an error; CPU time [s]; and the fault, if any."""

    outcome: str
    seconds: float
    fault: str


class Loader:
    """Our end of the process; after a hang or a crash there is a new one."""

    peak = 0.0  # MB that loading has added at most

    def __enter__(self) -> Loader:
        """Start the process."""
        self._start()
        return self

    def __exit__(self, *_: object) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()

    def _start(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, '-m', 'torture.loader'], env={**os.environ, 'PYTHONPATH': str(ROOT)}, cwd=ROOT,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
        if not self._answer(START):
            raise RuntimeError('the process that loads files did not start')

    def load(self, path: Path) -> Loaded:
        """Load a file."""
        with contextlib.suppress(BrokenPipeError):  # the missing reply is reported instead
            self._process.stdin.write(f'{path}\n'.encode())
            self._process.stdin.flush()
        line = self._answer(HANG)
        if line:
            answer = json.loads(line)
            self.peak = max(self.peak, answer.pop('peak'))
            return Loaded(**answer)
        try:
            fault = f'the process ended with {self._process.wait(CRASH)}'
        except subprocess.TimeoutExpired:
            fault = f'not done after {HANG:g} s'
        self.__exit__()
        self._start()
        return Loaded('ended', HANG, f'{fault}: {_shown(path)}')

    def _answer(self, timeout: float) -> bytes:
        """Return the next line, or an empty text after the timeout."""
        readable = select.select([self._process.stdout], [], [], timeout)[0]
        return self._process.stdout.readline() if readable else b''


def main() -> None:
    """Load one file after the other, with no more memory than it should take."""
    before = _memory()
    most = _address_space() + MOST_MEMORY * 2**20
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    print('ready', flush=True)
    for line in sys.stdin:
        outcome, seconds, fault = load(Path(line.rstrip('\n')))
        answer = {'outcome': outcome, 'seconds': seconds, 'fault': fault, 'peak': _memory() - before}
        print(json.dumps(answer), flush=True)


def load(path: Path) -> tuple[str, float, str]:
    """Load a file and use it; return the outcome, the CPU time [s] and the fault."""
    began = time.thread_time()
    try:
        arm = load_arm(path)
        fault = unless(bool(np.isfinite(arm.forward(arm.home)).all()), 'the kinematics is not finite')
        return 'loaded', time.thread_time() - began, fault and f'{fault}: {_shown(path)}'
    except ModelError as error:
        return 'refused', time.thread_time() - began, _badly_said(path, str(error))
    except Exception as error:  # MemoryError too, beyond the bound
        return 'raised', time.thread_time() - began, f'{type(error).__name__}: {error}: {_shown(path)}'


def _badly_said(path: Path, error: str) -> str:
    """Return the fault of an error message: it must be short and name the file or robot and the place in it."""
    if not error.startswith((f'{path}: ', "robot '", 'robot "')) and 'no regular file' not in error:
        return f'an error that does not name the file: {error[:500]}'
    text = path.read_text(errors='replace') if path.is_file() else ''
    if not names_a_place(error.removeprefix(f'{path}: '), text):
        return f'an error that names no place: {error[:500]}; {_shown(path)}'
    return unless(len(error) < LONGEST_ERROR, f'an error of {len(error)} characters: {error[:200]}')


def _shown(path: Path) -> str:
    return repr(path.read_bytes()[:SHOWN])


def _memory() -> float:
    """Return the largest resident memory of this process so far [MB]; getrusage has that of its parent in it."""
    return int(HIGH_WATER.search(Path('/proc/self/status').read_text())[1]) / 1024


def _address_space() -> int:
    """Return the size of the address space of this process [bytes]."""
    return int(Path('/proc/self/statm').read_text().split()[0]) * PAGE


if __name__ == '__main__':
    main()
