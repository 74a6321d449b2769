"""Our end of a worker process."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from bench.solver import Model
from bench.wire import receive, send

ROOT = Path(__file__).resolve().parents[1]


class WorkerError(Exception):
    """A worker ended or refused; the text is the reason."""


class WorkerProcess:
    """One library in a separate process, which lives for the whole run."""

    def __init__(self, library: str, python: str = sys.executable) -> None:
        self.library = library
        environment = {**os.environ, 'PYTHONPATH': str(ROOT), 'OMP_NUM_THREADS': '1', 'OPENBLAS_NUM_THREADS': '1'}
        self._process = subprocess.Popen(
            [python, '-P', '-W', 'ignore', '-m', 'bench.worker', library],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=None if library == 'ours' else subprocess.DEVNULL,
        )
        self._reply()

    def load(self, model: Model, options: dict[str, Any]) -> tuple[list[str], str]:
        """Load an arm; return the names of the solvers and the library's version."""
        header = self._ask({'request': 'load', 'model': asdict(model), 'options': options})[0]
        return header['solvers'], header['version']

    def forward(self, solver: str, q: np.ndarray) -> np.ndarray:
        """Return the poses (N, 4, 4) of configurations (N, n) by the library's forward kinematics."""
        return self._ask({'request': 'forward', 'solver': solver}, q)[1][0]

    def solve(self, solver: str, targets: np.ndarray, seeds: np.ndarray, warm: bool) -> tuple[np.ndarray, str]:
        """Return the rows of `time_calls` and the first exception's text."""
        header, (rows,) = self._ask({'request': 'solve', 'solver': solver, 'warm': warm}, targets, seeds)
        return rows, header['error']

    def close(self) -> None:
        """End the process."""
        self._process.stdin.close()
        try:
            self._process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()

    def _ask(self, header: dict[str, Any], *arrays: np.ndarray) -> tuple[dict[str, Any], list[np.ndarray]]:
        with suppress(BrokenPipeError):  # the missing reply is reported instead
            send(self._process.stdin, header, *arrays)
        return self._reply()

    def _reply(self) -> tuple[dict[str, Any], list[np.ndarray]]:
        message = receive(self._process.stdout)
        if message is None:
            raise WorkerError(f'{self.library} ended with exit code {self._process.wait()}')
        if 'failure' in message[0]:
            raise WorkerError(message[0]['failure'])
        return message
