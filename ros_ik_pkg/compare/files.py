"""Write comparisons to files: CSV with one row per iterate, JSON with everything."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ros_ik_pkg.compare.problem import Problem, as_typed, numbers_of
from ros_ik_pkg.compare.runs import MethodRun
from ros_ik_pkg.ik import OPTIONS, TRACE_COLUMNS, SolveOptions

FIGURES = ('iterations', 'position_error', 'orientation_error', 'time', 'sigma_min', 'joints_at_limits')
COUNTS = ('attempt', 'iteration', 'joints_at_limits')


def write_csv(path: Path, problem: Problem, runs: Sequence[MethodRun]) -> None:
    """Write every iterate of every run: method, status, trace columns, tip [m], joints [rad, m]."""
    with path.open('w', newline='') as file:
        writer = csv.writer(file)
        writer.writerow(['method', 'status', *TRACE_COLUMNS, 'tip_x', 'tip_y', 'tip_z', *problem.arm.joint_names])
        for run in runs:
            writer.writerows([run.method, run.status.label, *row] for row in _rows(run))


def _rows(run: MethodRun) -> Iterator[list[float]]:
    """Yield the rows of a run, with counts as integers."""
    counts = [TRACE_COLUMNS.index(name) for name in COUNTS]
    trace = run.iterates
    for row in np.hstack([trace.rows, trace.tip_positions, trace.joint_positions]).tolist():
        for k in counts:
            row[k] = int(row[k])
        yield row


def write_json(
    path: Path, problem: Problem, runs: Sequence[MethodRun], options: SolveOptions, robot: str
) -> None:
    """Write the problem and all runs; numbers that are not finite become null, which JSON requires.

    `arguments` are the arguments of the command, with angles in degrees, so that the comparison can be repeated.
    """
    document = {
        'robot': problem.arm.name,
        'joint_names': problem.arm.joint_names,
        'seed': problem.seed.tolist(),
        'target': problem.target.tolist(),
        'arguments': {
            'robot': robot,
            'seed': as_typed(problem.arm, problem.seed).tolist(),
            'target': numbers_of(problem.target).tolist(),
            'methods': [run.method for run in runs],
        },
        'options': {option.name: getattr(options, option.name) for option in OPTIONS},
        'columns': TRACE_COLUMNS,
        'methods': {run.method: _document(run) for run in runs},
    }
    path.write_text(json.dumps(_finite(document), indent=1, allow_nan=False) + '\n')


def _document(run: MethodRun) -> dict[str, Any]:
    trace = run.iterates
    return {
        'status': run.status.label,
        **{name: getattr(run, name) for name in FIGURES},
        'trace': trace.rows.tolist(),
        'tip_positions': trace.tip_positions.tolist(),
        'joint_positions': trace.joint_positions.tolist(),
    }


def _finite(value: Any) -> Any:
    """Return a document with None for inf and NaN, and lists for arrays."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _finite(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
