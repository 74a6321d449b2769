"""Mesh files: found by path or URI, read, and kept as the corners of the convex hulls of their parts."""

from __future__ import annotations

import hashlib
import math
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from zipfile import BadZipFile

import numpy as np

from ros_ik_pkg.ik.contacts.coal_library import coal, hull_of
from ros_ik_pkg.ik.contacts.mesh_parts import cut_into_parts
from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.kernel.cache_folder import CACHE_FOLDER
from ros_ik_pkg.ik.text import to_number

MOST_BYTES = 512 * 2**20
MOST_TRIANGLES = 20000  # of a mesh that is cut into parts; the points of larger ones are moved to a grid
GRID = 300  # cells along the longest side
STL_HEADER, STL_TRIANGLE = 84, 50  # bytes
FORMAT = 3  # version of the files in the cache folder
UNIT = re.compile(rb'<unit\b[^>]*\bmeter\s*=\s*["\']([^"\']*)["\']')
DAE_HEADER = 2**16  # bytes, in which a DAE has its unit


@dataclass(frozen=True, eq=False)
class Hull:
    """A convex body that contains a part of a mesh: the hull of `corners` (k, 3), rounded by `slack`; in the units of
    the mesh."""

    corners: np.ndarray
    slack: float


def find_mesh(uri: str, folder: Path | None, meshes: Iterable[Path]) -> Path:
    """Return the file of a mesh; raises ModelError with the places that were searched.

    A package:// URI is searched in the folders `meshes` (packages, or folders of packages), in the folders above the
    URDF, and in the sourced workspaces; a relative path beside the URDF and in `meshes`.
    """
    places = list(_places(uri, folder, [Path(place) for place in meshes]))
    for place in places:
        if place.is_file():
            return place
    looked = ', '.join(str(place) for place in places[:4])
    raise ModelError(f'mesh {uri!r} is not found{f": looked for {looked}" if looked else ""}')


def _places(uri: str, folder: Path | None, meshes: list[Path]) -> Iterator[Path]:
    """Yield where a mesh may be."""
    scheme, marked, rest = uri.partition('://')
    if not marked:
        path = Path(uri)
        yield from [path] if path.is_absolute() else [base / path for base in [*([folder] if folder else []), *meshes]]
    elif scheme == 'file':
        yield Path('/' + unquote(rest.partition('/')[2]))
    elif scheme == 'package':
        package, _, inside = rest.partition('/')
        for base in meshes:
            yield base / package / inside
            if base.name == package:
                yield base / inside
        for above in folder.parents if folder else ():
            if above.name == package:
                yield above / inside
            yield above / package / inside
        for prefix in filter(None, os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)):
            yield Path(prefix) / 'share' / package / inside
        for root in filter(None, os.environ.get('ROS_PACKAGE_PATH', '').split(os.pathsep)):
            yield Path(root) / package / inside


def read_hulls(path: Path) -> tuple[Hull, ...]:
    """Return convex bodies that contain the mesh of a file; they are cached by the content of the file.

    Raises ModelError if the file cannot be read, is too large, or contains no triangle.
    """
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise ModelError(f'mesh {str(path)!r} has {size} bytes; at most {MOST_BYTES} are read')
        with path.open('rb') as file:
            digest = hashlib.file_digest(file, 'sha256').hexdigest()[:24]
    except OSError as error:
        raise ModelError(f'mesh {str(path)!r} cannot be read: {error}') from error
    kept = None if CACHE_FOLDER is None else CACHE_FOLDER.parent / 'hulls' / f'{digest}-{FORMAT}.npz'
    try:
        if kept is not None and kept.is_file():
            with np.load(kept) as parts:
                return tuple(Hull(parts[name], float(parts['slack'])) for name in parts.files if name != 'slack')
    except (OSError, ValueError, KeyError, BadZipFile):
        pass  # broken: create it again
    hulls = make_hulls(_read_mesh(path), str(path))
    if kept is not None:
        _keep(kept, hulls)
    return hulls


def make_hulls(triangles: np.ndarray, what: str) -> tuple[Hull, ...]:
    """Return convex bodies that contain triangles (t, 3, 3)."""
    if len(triangles) == 0 or not np.all(np.isfinite(triangles)):
        raise ModelError(f'mesh {what!r} has {"no triangles" if len(triangles) == 0 else "points that are not finite"}')
    if len(triangles) > MOST_TRIANGLES:
        points, slack = _thin_out(triangles.reshape(-1, 3))
        return (Hull(hull_of(points), slack),)
    return tuple(Hull(hull_of(part), 0.0) for part in cut_into_parts(triangles))


def _thin_out(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Move points to the nearest corners of a grid; return the distinct ones, and how far a point may have moved."""
    lowest = points.min(axis=0)
    cell = float((points.max(axis=0) - lowest).max()) / GRID
    if cell == 0.0:
        return points[:1], 0.0
    places = np.rint((points - lowest) / cell).astype(np.int64)
    keys = np.unique((places[:, 0] * (GRID + 1) + places[:, 1]) * (GRID + 1) + places[:, 2])
    thin = np.column_stack([keys // (GRID + 1) ** 2, keys // (GRID + 1) % (GRID + 1), keys % (GRID + 1)])
    return lowest + cell * thin, 0.8661 * cell  # half the diagonal of a cell


def _read_mesh(path: Path) -> np.ndarray:
    """Read all triangles (t, 3, 3)."""
    if path.suffix.lower() == '.stl':
        content = np.fromfile(path, np.uint8)
        count = int(content[80:84].view('<u4')[0]) if len(content) >= STL_HEADER else 0
        if len(content) == STL_HEADER + STL_TRIANGLE * count:  # else it is text
            triangles = content[STL_HEADER:].reshape(count, STL_TRIANGLE)[:, 12:48]
            return np.ascontiguousarray(triangles).view('<f4').reshape(-1, 3, 3).astype(np.float64)
    mesh = read_triangles(path, np.ones(3))
    points = np.array(mesh.vertices())
    corners = [mesh.tri_indices(k) for k in range(mesh.num_tris)]
    return points[np.array([[corner[0], corner[1], corner[2]] for corner in corners], dtype=np.int64).reshape(-1, 3)]


def read_triangles(path: Path, scale: np.ndarray) -> Any:
    """Return a mesh with its own triangles, for coal; raises ModelError if coal cannot read it."""
    try:
        return coal.MeshLoader().load(str(path), scale * _unit_of(path))
    except Exception as error:
        raise ModelError(f'mesh {str(path)!r} cannot be read: {" ".join(str(error).split())}') from error


def _unit_of(path: Path) -> float:
    """Return the length [m] of the unit of a DAE, which RViz and Gazebo heed and coal does not; 1 for other files."""
    if path.suffix.lower() != '.dae':
        return 1.0
    with path.open('rb') as file:
        found = UNIT.search(file.read(DAE_HEADER))
    unit = to_number(found[1].decode(errors='replace')) if found else 1.0
    if not 0.0 < unit < math.inf:
        raise ModelError(f'its unit is {unit:g} m; expected a positive number')
    return unit


def _keep(path: Path, hulls: tuple[Hull, ...]) -> None:
    """Write hulls to the cache folder in one piece; errors are ignored."""
    unfinished = path.with_suffix(f'.{os.getpid()}.npz')
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        parts: dict[str, Any] = {f'part{k}': hull.corners for k, hull in enumerate(hulls)}
        np.savez(unfinished, slack=hulls[0].slack, **parts)
        unfinished.replace(path)
    except OSError:
        unfinished.unlink(missing_ok=True)
