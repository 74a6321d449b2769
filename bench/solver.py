"""Interface of the measured solvers, and timing of their calls."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np


@dataclass(frozen=True)
class Model:
    """An arm as plain data: nj joints that rotate about, or slide along, the z axis of their frame.

    `placements` (nj + 1, 12) are rotation and translation from the frame after one joint to the next, the last one
    leading to the tip; `urdf` is the path of the same arm as a file, from link 'base' to link 'tip'. `source` is what
    load_arm takes.
    """

    name: str
    source: str
    urdf: str
    placements: list[list[float]]
    prismatic: list[int]
    lower: list[float]
    upper: list[float]

    def transforms(self) -> np.ndarray:
        """Return the placements as (nj + 1, 4, 4)."""
        rows = np.array(self.placements)
        out = np.tile(np.eye(4), (len(rows), 1, 1))
        out[:, :3, :3], out[:, :3, 3] = rows[:, :9].reshape(-1, 3, 3), rows[:, 9:]
        return out


class Answer(NamedTuple):
    """Result of a library: joint positions, or None, and its own counts if it reports them."""

    q: np.ndarray | None
    iterations: float = np.nan
    attempts: float = np.nan


class UnsupportedError(Exception):
    """The library does not support this arm; the text is the reason."""


class Solver:
    """One library with one setting. Only `call` is timed; the two others translate."""

    def prepare(self, target: np.ndarray, seed: np.ndarray) -> tuple[Any, ...]:
        """Return the arguments of `call` for a target (4, 4) [m] and a seed (n,) [rad, m]."""
        return target, seed

    def call(self, *arguments: Any) -> Any:
        """Call the library once."""
        raise NotImplementedError

    def read(self, result: Any, seed: np.ndarray) -> Answer:
        """Convert the return value of `call`."""
        raise NotImplementedError

    def forward(self, q: np.ndarray) -> np.ndarray:
        """Return the (4, 4) pose of the tip by the library's own forward kinematics."""
        raise NotImplementedError


def time_calls(solver: Solver, targets: np.ndarray, seeds: np.ndarray, warm: bool) -> tuple[np.ndarray, str]:
    """Solve one by one; return rows of q, seconds, iterations, attempts, and the first exception's text.

    If `warm`, each solve starts from the previous solution, the first one from the first seed.
    """
    n, error = seeds.shape[1], ''
    out = np.full((len(targets), n + 3), np.nan)
    seed = seeds[0]
    for k, target in enumerate(targets):
        seed = seed if warm else seeds[k]
        arguments = solver.prepare(target, seed)
        began = time.perf_counter_ns()
        try:
            result = solver.call(*arguments)
        except Exception as problem:
            ended, answer = time.perf_counter_ns(), Answer(None)
            error = error or f'{type(problem).__name__}: {problem}'
        else:
            ended = time.perf_counter_ns()
            answer = solver.read(result, seed)
        if answer.q is not None:
            out[k, :n] = answer.q
            seed = out[k, :n].copy()
        out[k, n:] = 1e-9 * (ended - began), answer.iterations, answer.attempts
    return out, error
