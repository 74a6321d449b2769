"""coal, the collision library of Pinocchio, under whichever of its names is installed."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

THIN = 1e-4  # [m]
SIGN = (-1.0, 1.0)

try:
    coal: Any = import_module('coal')
except ImportError:  # before its release 3
    coal = import_module('hppfcl')


def points_of(corners: np.ndarray) -> Any:
    """Return points (k, 3) as coal takes them."""
    points = coal.StdVec_Vec3s()
    points.extend(list(np.ascontiguousarray(corners, dtype=np.float64)))
    return points


def convex(corners: np.ndarray) -> Any:
    """Return coal's convex hull of points (k, 3), with its faces; what spans no volume is made THIN thick."""
    try:
        return coal.Convex.convexHull(points_of(corners), True, 'Qt')
    except Exception:
        thick = (corners[:, None, :] + 0.5 * THIN * np.array([[x, y, z] for x in SIGN for y in SIGN for z in SIGN]))
        return coal.Convex.convexHull(points_of(thick.reshape(-1, 3)), True, 'Qt')


def hull_of(corners: np.ndarray) -> np.ndarray:
    """Return those of the points (k, 3) that are corners of their convex hull; all where they span no volume."""
    try:
        return np.array(coal.Convex.convexHull(points_of(corners), False, 'Qt').points())
    except Exception:  # flat: as good, only more
        return corners


def hull_volume(corners: np.ndarray) -> float:
    """Return the volume of the convex hull of points (k, 3); 0 where they span none."""
    try:
        return float(coal.Convex.convexHull(points_of(corners), True, 'Qt').computeVolume())
    except Exception:
        return 0.0
