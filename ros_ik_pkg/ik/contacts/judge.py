"""The exact check of a configuration: Pinocchio's forward kinematics and coal's distances, no code of the solver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik.contacts.bodies import Piece
from ros_ik_pkg.ik.contacts.coal_library import ask_anew, coal, geometry_object
from ros_ik_pkg.ik.model.pinocchio_model import frame_id
from ros_ik_pkg.ik.model.tree import Tree
from ros_ik_pkg.ik.world import World

FLOOR = 'floor'
SURE = 1e-5  # [m] distance that counts as clear; coal's tolerance is 1e-6 m


@dataclass(frozen=True)
class Contact:
    """The two things that are nearest to each other at a configuration.

    Attributes
    ----------
    clearance : float
        Their distance [m]; minus the depth if they overlap; inf if nothing can touch.
    links : tuple of str
        Names of the two: links, obstacles, or 'floor'; empty if nothing can touch.
    points : (2, 3) array
        A point of each in the base frame [m], nearest to the other.

    """

    clearance: float
    links: tuple[str, ...]
    points: np.ndarray

    @property
    def touches(self) -> bool:
        """Whether they touch."""
        return self.clearance <= 0.0


class Judge:
    """The check by coal of one robot in one world. Threads may share it; they take turns."""

    def __init__(
        self, tree: Tree, model: pin.Model, base: str, pieces: Sequence[Piece], pairs: Sequence[tuple[int, int]],
        grounded: Sequence[int], world: World, meshes: bool,
    ) -> None:
        """Set up the pairs of pieces, and the pieces that must stay above the floor. Pieces of an obstacle are placed
        by the obstacle's pose."""
        self._model, self._data, self._lock = model, model.createData(), Lock()
        self._base = frame_id(tree, base)
        self._geometry = pin.GeometryModel()
        obstacles = {obstacle.name: obstacle for obstacle in world.obstacles}
        self._names = [piece.owner for piece in pieces]
        for number, piece in enumerate(pieces):
            obstacle = obstacles.get(piece.owner)
            link = piece.owner if obstacle is None else obstacle.link or base
            self._add(f'{number} {piece.owner}', frame_id(tree, link), piece.shape.frame_from_shape,
                      piece.mesh if meshes else piece.convex)
        for one, other in pairs:
            self._geometry.addCollisionPair(pin.CollisionPair(one, other))
        if world.floor is not None and grounded:
            floor = self._add(FLOOR, self._base, np.eye(4), coal.Halfspace(np.array([0.0, 0.0, 1.0]), world.floor))
            self._names.append(FLOOR)
            for number in grounded:
                self._geometry.addCollisionPair(pin.CollisionPair(number, floor))
        self._placed = self._geometry.createData()
        ask_anew(self._placed)
        self._margin: float | None = None

    def _add(self, name: str, frame: int, placement: np.ndarray, geometry: Any) -> int:
        """Add a shape that is fixed to a frame; return its number."""
        return self._geometry.addGeometryObject(geometry_object(name, self._model, frame, placement, geometry))

    def clear(self, values: np.ndarray, margin: float) -> bool:
        """Return whether all pairs are further apart than `margin` [m] plus SURE at these values of all joints of the
        model."""
        with self._lock:
            if margin != self._margin:
                self._margin = margin
                for request in self._placed.collisionRequests:
                    request.security_margin = margin + SURE
            return not pin.computeCollisions(
                self._model, self._data, self._geometry, self._placed, np.asarray(values, dtype=np.float64), True)

    def nearest(self, values: np.ndarray) -> Contact:
        """Return the two that are nearest to each other at these values of all joints of the model."""
        with self._lock:
            if len(self._geometry.collisionPairs) == 0:
                return Contact(np.inf, (), np.zeros((2, 3)))
            q = np.asarray(values, dtype=np.float64)
            pin.computeDistances(self._model, self._data, self._geometry, self._placed, q)
            pin.updateFramePlacements(self._model, self._data)
            results = self._placed.distanceResults
            best = min(range(len(results)), key=lambda k: results[k].min_distance)
            pair, found = self._geometry.collisionPairs[best], results[best]
            root_from_base = self._data.oMf[self._base]
            points = [root_from_base.actInv(point) for point in (found.getNearestPoint1(), found.getNearestPoint2())]
            return Contact(float(found.min_distance), (self._names[pair.first], self._names[pair.second]),
                           np.array(points))
