"""A process that runs one library; requests and replies use its standard streams (see wire.py)."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from importlib import import_module
from importlib.metadata import version
from typing import Any, BinaryIO

import numpy as np

from bench.solver import Model, Solver, UnsupportedError, time_calls
from bench.wire import receive, send

# Library -> the module and the function that makes its solvers, the distribution whose version counts.
LIBRARIES = {
    'ours': ('bench.ours', 'make_ours', 'numba'),
    'rtb': ('bench.peer_solvers', 'make_rtb', 'roboticstoolbox-python'),
    'trac_ik': ('bench.peer_solvers', 'make_trac_ik', 'pytracik'),
    'optik': ('bench.peer_solvers', 'make_optik', 'optik-py'),
    'pinocchio': ('bench.peer_solvers', 'make_pinocchio', 'pin'),
    'ssik': ('bench.peer_closed_forms', 'make_ssik', 'ssik'),
    'eaik': ('bench.peer_closed_forms', 'make_eaik', 'eaik'),
}


class Worker:
    """Answers requests: load an arm, forward kinematics, timed solves."""

    def __init__(self, library: str) -> None:
        module, function, distribution = LIBRARIES[library]
        self.make: Callable[..., dict[str, Solver]] = getattr(import_module(module), function)
        self.version = version(distribution)
        self.solvers: dict[str, Solver] = {}

    def load(self, model: dict[str, Any], options: dict[str, Any]) -> tuple[Any, ...]:
        """Make the solvers for an arm; answer with their names."""
        self.solvers = self.make(Model(**model), options)
        return {'solvers': list(self.solvers), 'version': self.version},

    def forward(self, q: np.ndarray, solver: str) -> tuple[Any, ...]:
        """Answer with the poses of configurations."""
        return {}, np.array([self.solvers[solver].forward(row) for row in q])

    def solve(self, targets: np.ndarray, seeds: np.ndarray, solver: str, warm: bool) -> tuple[Any, ...]:
        """Answer with the timed solves."""
        rows, error = time_calls(self.solvers[solver], targets, seeds, warm)
        return {'error': error}, rows


def main() -> None:
    """Serve until the other side closes the stream."""
    requests, replies = private_streams()
    try:
        worker = Worker(sys.argv[1])
    except Exception as problem:
        return send(replies, {'failure': f'{type(problem).__name__}: {problem}'})
    send(replies, {})
    while (message := receive(requests)) is not None:
        header, arrays = message
        try:
            send(replies, *getattr(worker, header.pop('request'))(*arrays, **header))
        except UnsupportedError as problem:
            send(replies, {'failure': str(problem)})
        except Exception as problem:
            send(replies, {'failure': f'{type(problem).__name__}: {problem}'})
    return None


def private_streams() -> tuple[BinaryIO, BinaryIO]:
    """Reserve the standard streams for messages: output of libraries goes to standard error."""
    requests, replies = os.fdopen(os.dup(0), 'rb'), os.fdopen(os.dup(1), 'wb')
    os.dup2(2, 1)
    return requests, replies


if __name__ == '__main__':
    main()
