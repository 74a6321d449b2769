"""Comparisons as files: CSV with one row for each iterate, JSON with everything."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ros_ik_pkg.compare.problem import Problem
from ros_ik_pkg.compare.runs import MethodRun
from ros_ik_pkg.ik import TRACE_COLUMNS

FIGURES = ('iterations', 'position_error', 'orientation_error', 'time', 'sigma_min')


def write_csv(path: Path, problem: Problem, runs: Sequence[MethodRun]) -> None:
    """Write every iterate of every run: method, the columns of the trace, the tip [m], the joints [rad, m]."""
    with path.open('w', newline='') as file:
        writer = csv.writer(file)
        writer.writerow(['method', *TRACE_COLUMNS, 'tip_x', 'tip_y', 'tip_z', *problem.arm.joint_names])
        for run in runs:
            writer.writerows([run.method, *row] for row in _rows(run))


def _rows(run: MethodRun) -> list[list[float]]:
    return np.hstack([run.trace.rows, run.trace.tip_positions, run.trace.joint_positions]).tolist()


def write_json(path: Path, problem: Problem, runs: Sequence[MethodRun]) -> None:
    """Write the problem and all runs; numbers that are not finite become null, as JSON asks."""
    document = {
        'robot': problem.arm.name,
        'joint_names': problem.arm.joint_names,
        'seed': problem.seed.tolist(),
        'target': problem.target.tolist(),
        'columns': TRACE_COLUMNS,
        'methods': {run.method: _document(run) for run in runs},
    }
    path.write_text(json.dumps(_finite(document), indent=1, allow_nan=False) + '\n')


def _document(run: MethodRun) -> dict[str, Any]:
    trace = run.trace
    return {
        'status': run.status.label,
        **{name: getattr(run, name) for name in FIGURES},
        'trace': trace.rows.tolist(),
        'tip_positions': trace.tip_positions.tolist(),
        'joint_positions': trace.joint_positions.tolist(),
    }


def _finite(value: Any) -> Any:
    """Return a document with null in place of inf and NaN."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
