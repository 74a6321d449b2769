"""Paths in files: rows of a .csv, or a list of mappings in a .yaml, each with a position and a rotation; some have a
time, or are the middle of an arc."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pinocchio
import yaml

from ros_ik_pkg.ik.text import suggest, to_number

POSITION = ('x', 'y', 'z')  # m
ANGLES = ('roll', 'pitch', 'yaw')  # about fixed axes
QUATERNION = ('qx', 'qy', 'qz', 'qw')
TIME = 'time'  # s
VIA = 'via'  # whether the row is the middle of an arc
YES, NO = ('1', 'true', 'yes'), ('', '0', 'false', 'no')
COLUMNS = (*POSITION, *ANGLES, *QUATERNION, TIME, VIA)


class PathFile(NamedTuple):
    """A path as solve_path takes it."""

    poses: np.ndarray  # (N, 4, 4) [m]
    times: np.ndarray | None  # (N,) [s], None if the file has none
    vias: tuple[int, ...]  # poses in the middle of an arc


def read_path_file(path: Path, degrees: bool = False) -> PathFile:
    """Return the path of a file; raise ValueError that names the row."""
    rows = _read_yaml(path) if path.suffix in ('.yaml', '.yml') else _read_csv(path)
    poses = np.array([_pose(row, k, degrees) for k, row in enumerate(rows)]).reshape(-1, 4, 4)
    timed = [TIME in row for row in rows]
    if any(timed) and not all(timed):
        raise ValueError(f'row {timed.index(False)} has no time, others have')
    times = np.array([_number(row, TIME, k) for k, row in enumerate(rows)]) if any(timed) else None
    return PathFile(poses, times, tuple(k for k, row in enumerate(rows) if _is_via(row, k)))


def _read_csv(path: Path) -> list[Mapping[str, Any]]:
    with path.open(newline='') as file:
        return [{name.strip(): text for name, text in row.items() if name is not None and text is not None}
                for row in csv.DictReader(file)]  # fmt: skip


def _read_yaml(path: Path) -> list[Mapping[str, Any]]:
    try:
        rows = yaml.safe_load(path.read_text())
    except yaml.YAMLError as error:
        raise ValueError(f'no YAML: {error}') from None
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise ValueError('expected a list of mappings such as {x: 0.5, y: 0, z: 0.3, roll: 0, pitch: 1.57, yaw: 0}')
    return rows


def _pose(row: Mapping[str, Any], k: int, degrees: bool) -> np.ndarray:
    """Return the pose of a row (4, 4)."""
    for name in row:
        if name not in COLUMNS:
            raise ValueError(f'row {k}: {name!r} is not known; {suggest(str(name), COLUMNS)}')
    position = np.array([_number(row, name, k) for name in POSITION])
    if any(name in row for name in QUATERNION):
        quaternion = np.array([_number(row, name, k) for name in QUATERNION])
        norm = np.linalg.norm(quaternion)
        if abs(norm - 1.0) > 0.01:
            raise ValueError(f'row {k}: the quaternion has norm {norm:.4g}; expected 1')
        return pinocchio.XYZQUATToSE3(np.concatenate([position, quaternion / norm])).homogeneous
    angles = np.array([_number(row, name, k) for name in ANGLES])
    rotation = pinocchio.rpy.rpyToMatrix(np.radians(angles) if degrees else angles)
    return pinocchio.SE3(rotation, position).homogeneous


def _is_via(row: Mapping[str, Any], k: int) -> bool:
    """Return whether a row is the middle of an arc."""
    text = str(row.get(VIA, '')).strip().lower()
    if text not in (*YES, *NO):
        raise ValueError(f'row {k}: via is {row[VIA]!r}; expected 1 for the middle of an arc, else 0')
    return text in YES


def _number(row: Mapping[str, Any], name: str, k: int) -> float:
    """Return a finite number of a row."""
    if name not in row:
        raise ValueError(f'row {k} has no {name}; expected {", ".join(POSITION)} with {", ".join(ANGLES)} or '
                         f'{", ".join(QUATERNION)}')
    value = to_number(str(row[name]))
    if not math.isfinite(value):
        raise ValueError(f'row {k}: {name} is {row[name]!r}; expected a finite number')
    return value
