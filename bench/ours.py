"""Our methods as measured solvers: the public Python call with its default search."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from bench.bare_arm import bare_arm
from bench.solver import Answer, Model, Solver
from ros_ik_pkg.ik import METHODS, Solution, SolveOptions, solve, warm_up
from ros_ik_pkg.ik.arm import Arm


class Ours(Solver):
    """`solve` with one method."""

    def __init__(self, arm: Arm, options: SolveOptions) -> None:
        self.arm, self.options = arm, options

    def call(self, target: np.ndarray, seed: np.ndarray) -> Solution:
        return solve(self.arm, target, seed, self.options)

    def read(self, result: Solution, seed: np.ndarray) -> Answer:
        return Answer(result.q if result.converged else None, result.iterations, result.attempts)

    def forward(self, q: np.ndarray) -> np.ndarray:
        return self.arm.forward(q)


def make_ours(model: Model, options: dict[str, Any]) -> dict[str, Solver]:
    """Return a solver for every method; `options` are those of SolveOptions that are not the default."""
    warm_up(lambda text: None)
    arm, options = bare_arm(model.source), SolveOptions(**options)
    return {method: Ours(arm, replace(options, method=method)) for method in METHODS}
