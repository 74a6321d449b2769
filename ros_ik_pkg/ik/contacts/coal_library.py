"""coal, the collision library of Pinocchio, under the name that is installed: coal or hppfcl."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pinocchio as pin

THIN = 1e-4  # [m]
SIGN = (-1.0, 1.0)


class _Hppfcl:
    """hppfcl, as coal was called before its release 3, by coal's names: types that end in 3s ended in 3f."""

    def __init__(self) -> None:
        self._library = import_module('hppfcl')

    def __getattr__(self, name: str) -> Any:
        return getattr(self._library, f'{name[:-1]}f' if name.endswith('3s') else name)


try:
    coal: Any = import_module('coal')
except ImportError:
    coal = _Hppfcl()


def geometry_object(name: str, model: pin.Model, frame: int, placement: np.ndarray, shape: Any) -> pin.GeometryObject:
    """Return a shape of coal at a placement (4, 4) in a frame of a model, as the installed Pinocchio makes it."""
    held = model.frames[frame]
    placed = held.placement * pin.SE3(placement)
    if hasattr(held, 'parentJoint'):
        return pin.GeometryObject(name, held.parentJoint, frame, placed, shape)
    return pin.GeometryObject(name, frame, held.parent, shape, placed)  # before its release 3


def ask_anew(placed: pin.GeometryData) -> None:
    """Let Pinocchio's requests to coal start afresh for each configuration, and compute the depth.

    By default they start GJK from the result of the last configuration and compute no depth. Then coal misses
    contacts, some 5 cm deep, and its results depend on earlier requests.
    """
    for requests, make in ((placed.collisionRequests, coal.CollisionRequest),
                           (placed.distanceRequests, coal.DistanceRequest)):
        for k in range(len(requests)):
            requests[k] = make()


def points_of(corners: np.ndarray) -> Any:
    """Return points (k, 3) as coal takes them."""
    points = coal.StdVec_Vec3s()
    points.extend(list(np.ascontiguousarray(corners, dtype=np.float64)))
    return points


def convex(corners: np.ndarray, slack: float = 0.0) -> Any:
    """Return coal's convex hull of points (k, 3), with its faces, rounded by `slack` [m].

    Points that span no volume are made THIN thick. Before its release 3, coal cannot round; then a cube is added.
    """
    if slack > 0.0 and not hasattr(coal.Convex, 'setSweptSphereRadius'):
        return convex(_thickened(corners, slack))
    try:
        body = coal.Convex.convexHull(points_of(corners), True, 'Qt')
    except Exception:
        body = coal.Convex.convexHull(points_of(_thickened(corners, 0.5 * THIN)), True, 'Qt')
    if slack > 0.0:
        body.setSweptSphereRadius(slack)
    return body


def _thickened(corners: np.ndarray, half: float) -> np.ndarray:
    """Return the corners of cubes of this half edge [m] around points (k, 3), (8 k, 3)."""
    cube = np.array([[x, y, z] for x in SIGN for y in SIGN for z in SIGN])
    return (corners[:, None, :] + half * cube).reshape(-1, 3)


def hull_of(corners: np.ndarray) -> np.ndarray:
    """Return those of the points (k, 3) that are corners of their convex hull; all if they span no volume."""
    try:
        return np.array(coal.Convex.convexHull(points_of(corners), False, 'Qt').points())
    except Exception:  # flat: all points serve too
        return corners


def hull_volume(corners: np.ndarray) -> float:
    """Return the volume of the convex hull of points (k, 3); 0 if they span none."""
    try:
        return float(coal.Convex.convexHull(points_of(corners), True, 'Qt').computeVolume())
    except Exception:
        return 0.0
