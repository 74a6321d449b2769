"""World: what stands around an arm, what it holds, and where the joints outside its chain are."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ros_ik_pkg.ik.exceptions import ArgumentError, ModelError
from ros_ik_pkg.ik.model.shapes import Shape
from ros_ik_pkg.ik.text import list_names

MOST_OBSTACLES = 2000
ROTATION_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A box, sphere, cylinder or capsule that stands in the base frame, or is attached to a link.

    Attributes
    ----------
    name : str
    kind : str
        'box' (three edge lengths), 'sphere' (radius), 'cylinder' or 'capsule' (radius, length along z).
    size : array
        [m]
    pose : (4, 4) array or pinocchio.SE3
        Pose of its middle in the base frame; if it is attached, in the link's frame.
    link : str
        Link that it is attached to; none for an obstacle of the room.
    touches : tuple of str
        Links besides that one that it may touch, such as the fingers that hold it.

    Raises ArgumentError if the size or the pose is invalid.

    """

    name: str
    kind: str
    size: Any
    pose: Any = field(default_factory=lambda: np.eye(4))
    link: str = ''
    touches: tuple[str, ...] = ()
    shape: Shape = field(init=False, repr=False)

    def __post_init__(self) -> None:
        try:
            if self.kind == 'mesh':
                raise ModelError('is a mesh; expected box, sphere, cylinder or capsule')
            size, pose = np.array(self.size, dtype=np.float64), getattr(self.pose, 'homogeneous', self.pose)
            object.__setattr__(self, 'shape', Shape(self.kind, size, _check_pose(pose)))
        except (ModelError, TypeError, ValueError) as error:
            raise ArgumentError(f'obstacle {self.name!r}: {error}') from error


@dataclass(frozen=True, eq=False)
class World:
    """What an arm must not touch. It does not change: make a new World for a changed room.

    Attributes
    ----------
    floor : float or None
        Height of a floor in the base frame [m], its normal along z; everything below counts as floor.
    obstacles : tuple of Obstacle
    positions : mapping of str to float
        Positions of joints outside the chain by name [rad, m]; others stand at rest.

    Raises ArgumentError if the floor is not finite or names occur twice.

    """

    floor: float | None = None
    obstacles: tuple[Obstacle, ...] = ()
    positions: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.floor is not None and not math.isfinite(self.floor):
            raise ArgumentError(f'floor is {self.floor!r}; expected a height [m] or None')
        obstacles = _check_obstacles(self.obstacles)
        object.__setattr__(self, 'obstacles', obstacles)
        wrong = [name for name, value in self.positions.items() if not math.isfinite(value)]
        if wrong:
            raise ArgumentError(f'position of joint {list_names(wrong)} is not finite')


def _check_obstacles(obstacles: Iterable[Obstacle]) -> tuple[Obstacle, ...]:
    """Return the obstacles as a tuple, or raise ArgumentError if there are too many or names occur twice."""
    obstacles = tuple(obstacles)
    if len(obstacles) > MOST_OBSTACLES:
        raise ArgumentError(f'{len(obstacles)} obstacles; at most {MOST_OBSTACLES}')
    names = [obstacle.name for obstacle in obstacles]
    twice = {name for name in names if names.count(name) > 1} if len(set(names)) < len(names) else set()
    if twice:
        raise ArgumentError(f'obstacle name used more than once: {list_names(sorted(twice))}')
    return obstacles


def _check_pose(pose: Any) -> np.ndarray:
    """Return a valid pose (4, 4), or raise ArgumentError."""
    matrix = np.array(pose, dtype=np.float64)
    if matrix.shape != (4, 4) or not np.all(np.isfinite(matrix)):
        raise ArgumentError('its pose is not a finite (4, 4) matrix')
    rotation = matrix[:3, :3]
    turned = np.abs(rotation @ rotation.T - np.eye(3)).max() < ROTATION_TOLERANCE and np.linalg.det(rotation) > 0.0
    if not turned or np.any(matrix[3] != (0.0, 0.0, 0.0, 1.0)):
        raise ArgumentError('its pose has no right-handed rotation, or another last row than 0 0 0 1')
    return matrix
