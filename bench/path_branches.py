"""All solutions of many poses by a closed form, in the environment of the peers: reads and writes files."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bench.peer_closed_forms import make_eaik, make_ssik
from bench.solver import Model, UnsupportedError

MOST = 512
DENSER = 4  # times as many samples of a redundant arm as ssik takes
EXACT = 1e-6  # largest component of the difference of two poses


def main() -> None:
    """Read a model (.json) and poses (.npy) (N, 4, 4); write branches (N, MOST, n), counts (N,) and seconds (.npz).

    Nothing leads past a pose without solutions, so the poses after one are left out.
    """
    library, model_file, source, target = sys.argv[1:]
    model = Model(**json.loads(Path(model_file).read_text()))
    try:
        solutions = {
            'eaik': eaik_solutions, 'ssik': ssik_solutions, 'ssik, denser': dense_ssik_solutions
        }[library](model)  # fmt: skip
    except UnsupportedError as error:
        sys.exit(f'{library} {error}')
    poses = np.load(source)
    branches, counts = np.zeros((len(poses), MOST, len(model.lower))), np.zeros(len(poses), np.int64)
    solutions(poses[0])
    began = time.process_time()
    for k, pose in enumerate(poses):
        found = solutions(pose)[:MOST]
        if not found:
            break
        branches[k, : len(found)], counts[k] = found, len(found)
    np.savez(target, branches=branches, counts=counts, seconds=time.process_time() - began)


def eaik_solutions(model: Model) -> Callable[[np.ndarray], list[Any]]:
    """Return what finds all branches of a pose, limits aside; those that are not exact are left out."""
    robot = make_eaik(model, {})['EAIK'].robot

    def solutions(pose: np.ndarray) -> list[Any]:
        return [q for q in robot.IK(pose).Q if np.abs(robot.fwdKin(np.asarray(q)) - pose).max() < EXACT]

    return solutions


def ssik_solutions(model: Model) -> Callable[[np.ndarray], list[Any]]:
    """Return what finds all solutions of a pose that ssik enumerates, within the limits."""
    module = make_ssik(model, {})['ssik'].module
    # Whole turns are counted by the judge.
    return lambda pose: [solution.q for solution in module.solve(pose, enumerate_windings=False)]


def dense_ssik_solutions(model: Model) -> Callable[[np.ndarray], list[Any]]:
    """Return what finds DENSER times as many solutions of a redundant arm; ssik has no option for that."""
    from ssik.solvers.seven_r import spherical_shoulder, srs

    module = make_ssik(model, {})['ssik'].module
    spherical_shoulder._SAMPLE_GRID *= DENSER
    if module.SOLVER_NAME == 'seven_r.srs':
        module._solver_solve = partial(srs.solve, swivel_samples=DENSER * srs._DEFAULT_SWIVEL_SAMPLES)
    # The compiled code has a fixed number of samples.
    return lambda pose: [solution.q for solution in module.solve(pose, enumerate_windings=False, native=False)]


if __name__ == '__main__':
    main()
