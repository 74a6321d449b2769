"""Our end of a process that sends (`sender.py`)."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from bench.process import ROOT

JOINT_RATE = 1000.0  # Hz
REACHED = 0.9  # share of a rate below which it was not tried
LONG = 1e9  # s, until the order to stop
AT_ONCE = 1e9  # Hz
TIMEOUT = 60.0  # s to start, and to stop


@dataclass(frozen=True)
class Sent:
    """Numbers of sent messages; `last`: the stamp [ns] of the last target of each client."""

    targets: int
    joint_states: int
    seconds: float
    last: dict[int, int]

    def figure(self) -> str:
        """Say how much, and how fast."""
        return (
            f'{self.targets} sent at {self.targets / self.seconds:.0f} Hz, '
            f'joint states at {self.joint_states / self.seconds:.0f}'
        )

    def too_slow(self, rate: float, joint_rate: float = JOINT_RATE) -> str:
        """Return which rate [Hz] was not reached; empty if both were."""
        figures = {'targets': (self.targets, rate), 'joint states': (self.joint_states, joint_rate)}
        slow = [f'{what} at {count / self.seconds:.0f} Hz instead of {wanted:g}'
                for what, (count, wanted) in figures.items() if count < REACHED * wanted * self.seconds]  # fmt: skip
        return f'not tried: {", ".join(slow)}' if slow else ''


class Sender:
    """Sends the waypoints of a seed to the nodes of these full names, as the clients from `first_client` on."""

    def __init__(self, robot: str, seed: int, names: Sequence[str], first_client: int = 0) -> None:
        self._process = subprocess.Popen(
            [sys.executable, '-m', 'torture.sender', robot, str(seed), str(first_client), *names],
            env={**os.environ, 'PYTHONPATH': str(ROOT)}, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
        self._sent: Sent | None = None
        self._read(TIMEOUT)  # that it is ready

    def __enter__(self) -> Sender:
        """Return the sender; the end of the `with` ends the process."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()

    def begin(
        self, rate: float, seconds: float = LONG, joint_rate: float = JOINT_RATE, count: int | None = None
    ) -> None:
        """Start to send at these rates [Hz], for a duration [s] or a number of targets."""
        order = {'rate': rate, 'seconds': seconds, 'joint_rate': joint_rate, **({'count': count} if count else {})}
        self._sent = None
        self._write(json.dumps(order))

    def end(self) -> Sent:
        """Stop sending; return what was sent."""
        if not self.finished():
            self._write('end')
            self._sent = self._take(self._read(TIMEOUT))
        return self._sent

    def finished(self) -> bool:
        """Whether all was sent that should be."""
        if self._sent is None and self._readable(0.0):
            self._sent = self._take(self._read(0.0))
        return self._sent is not None

    def _write(self, line: str) -> None:
        self._process.stdin.write(f'{line}\n'.encode())
        self._process.stdin.flush()

    def _readable(self, timeout: float) -> bool:
        return bool(select.select([self._process.stdout], [], [], timeout)[0])

    def _read(self, timeout: float) -> Any:
        """Return the next reply; raises RuntimeError after the timeout."""
        line = self._process.stdout.readline() if self._readable(timeout) else b''
        if not line:
            raise RuntimeError('the process that sends does not answer')
        return json.loads(line)

    @staticmethod
    def _take(answer: dict[str, Any]) -> Sent:
        return Sent(**{**answer, 'last': {int(client): stamp for client, stamp in answer['last'].items()}})
