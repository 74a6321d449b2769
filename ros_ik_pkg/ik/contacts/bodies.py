"""The shapes of a robot and of the room, each with its cover and as coal's geometry."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ros_ik_pkg.ik.collision.cover import Cover, capsule_around, cover_points, sphere_around
from ros_ik_pkg.ik.contacts.coal_library import coal, convex
from ros_ik_pkg.ik.contacts.mesh_files import Hull, find_mesh, read_hulls, read_triangles
from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.shapes import Shape
from ros_ik_pkg.ik.model.tree import Tree

SIDES = 16  # of the prism around a cylinder
SIGNS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


@dataclass(frozen=True, eq=False)
class Piece:
    """A shape in the frame of the link or obstacle that it belongs to, or a convex part of a mesh."""

    owner: str
    shape: Shape
    hull: Hull | None = None  # of a part of a mesh
    path: Path | None = None

    @cached_property
    def cover(self) -> Cover:
        """Points and radii whose hull contains the shape, in the owner's frame [m]."""
        kind, size = self.shape.kind, self.shape.size
        if kind == 'mesh':
            assert self.hull is not None
            cover = cover_points(self.hull.corners * size).grown(self.hull.slack * float(np.abs(size).max()))
        elif kind == 'box':
            cover = cover_points(SIGNS * size)
        elif kind == 'cylinder':
            cover = cover_points(_prism(*size))
        else:
            ends = np.zeros((1, 3)) if kind == 'sphere' else np.outer([-0.5, 0.5], [0.0, 0.0, size[1]])
            cover = cover_points(ends).grown(float(size[0]))
        pose = self.shape.frame_from_shape
        return cover._replace(points=cover.points @ pose[:3, :3].T + pose[:3, 3])

    @cached_property
    def axes(self) -> np.ndarray:
        """Centre of a sphere and both ends of a capsule that contain the shape (3, 3), in the owner's frame [m]."""
        return np.array([self._ball[:3], self._capsule[:3], self._capsule[3:6]])

    @cached_property
    def radii(self) -> tuple[float, float]:
        """Radii of that sphere and that capsule [m]."""
        return self._ball[3] + self.cover.fine_radius, self._capsule[6] + self.cover.fine_radius

    @cached_property
    def _ball(self) -> np.ndarray:
        return sphere_around(self.cover.points)

    @cached_property
    def _capsule(self) -> np.ndarray:
        return capsule_around(self.cover.points)

    @cached_property
    def convex(self) -> Any:
        """The shape as coal's geometry, a part of a mesh as its convex hull."""
        kind, size = self.shape.kind, [float(value) for value in self.shape.size]
        if kind == 'box':
            return coal.Box(*size)
        if kind in ('sphere', 'capsule', 'cylinder'):
            return {'sphere': coal.Sphere, 'capsule': coal.Capsule, 'cylinder': coal.Cylinder}[kind](*size)
        assert self.hull is not None
        slack = self.hull.slack * float(np.abs(self.shape.size).max())
        return convex(self.hull.corners * self.shape.size, slack)

    @cached_property
    def mesh(self) -> Any:
        """The whole shape as coal's geometry, a mesh with its triangles as they are."""
        return self.convex if self.path is None else read_triangles(self.path, self.shape.size)


def _prism(radius: float, length: float) -> np.ndarray:
    """Return the corners (2 SIDES, 3) of a prism around a cylinder."""
    angles = np.arange(SIDES) * 2.0 * math.pi / SIDES
    ring = radius / math.cos(math.pi / SIDES) * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.vstack([np.column_stack([ring, np.full(SIDES, end)]) for end in (-0.5 * length, 0.5 * length)])


def load_pieces(tree: Tree, meshes: Iterable[Path]) -> tuple[tuple[Piece, ...], tuple[str, ...]]:
    """Load the shapes of all links, and a sentence for each that is left out."""
    pieces: list[Piece] = []
    warnings = list(tree.shape_faults)
    meshes = list(meshes)
    for link, shapes in tree.shapes.items():
        for shape in shapes:
            try:
                pieces += load_shape(link, shape, tree.folder, meshes)
            except ModelError as error:
                warnings.append(f'link {link!r}: {error}; left out')
    return tuple(pieces), tuple(warnings)


def load_shape(owner: str, shape: Shape, folder: Path | None = None, meshes: Iterable[Path] = ()) -> list[Piece]:
    """Load one shape, a mesh in parts; raises ModelError if the mesh cannot be read."""
    if shape.kind != 'mesh':
        return [Piece(owner, shape)]
    path = find_mesh(shape.file, folder, meshes)
    return [Piece(owner, shape, hull, path) for hull in read_hulls(path)]
