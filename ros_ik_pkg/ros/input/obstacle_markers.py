"""Obstacles from markers, in the base frame: added, changed and deleted."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from ros_ik_pkg.ik import ArgumentError, Obstacle
from ros_ik_pkg.ik.kinematics.pose_error import pose_matrix
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ik.world import MOST_OBSTACLES
from ros_ik_pkg.ros.input.refusal import RefusedError

KINDS = {Marker.CUBE: 'box', Marker.SPHERE: 'sphere', Marker.CYLINDER: 'cylinder'}
Place = Callable[[Header], np.ndarray]  # pose (4, 4) of a header's frame in the base frame; may refuse


class ObstacleMarkers:
    """The obstacles that markers have added, each until it is deleted or its lifetime ends."""

    def __init__(self) -> None:
        self._obstacles: dict[tuple[str, int], tuple[Obstacle, float]] = {}  # and when it ends [s, monotonic]

    def take(
        self, message: MarkerArray, place: Place, links: Collection[str] = (), tips: Collection[str] = ()
    ) -> list[str]:
        """Apply all valid markers of a message; return why the others are ignored.

        A marker that is locked to the frame of one of `links` is attached to it; others stay where their frame is now.
        For one in a frame of `tips` that would hardly be meant.
        """
        reasons = []
        for marker in message.markers:
            key = marker.ns, marker.id
            try:
                if marker.action == Marker.DELETEALL:
                    self._obstacles.clear()
                elif marker.action == Marker.DELETE:
                    self._obstacles.pop(key, None)
                elif marker.action == Marker.ADD:
                    if key not in self._obstacles and len(self._obstacles) >= MOST_OBSTACLES:
                        raise ArgumentError(f'there are {MOST_OBSTACLES} obstacles already')
                    link = _link_of(marker, links, tips)
                    frame = np.eye(4) if link else place(marker.header)
                    self._obstacles[key] = read_marker(marker, frame, link), _end_of(marker)
                else:
                    raise ArgumentError(f'action {marker.action}; expected ADD, DELETE or DELETEALL')
            except (ArgumentError, RefusedError) as error:
                reasons.append(shorten(f'marker {marker.ns}/{marker.id}: {error}', 300))
        return reasons

    def move(self, base_from_old: np.ndarray) -> None:
        """Leave all obstacles where they are in another base frame, in which the old one has this pose (4, 4)."""
        self._obstacles = {key: (moved(obstacle, base_from_old), end)
                           for key, (obstacle, end) in self._obstacles.items()}

    def current(self) -> tuple[Obstacle, ...]:
        """Return the obstacles whose lifetime has not ended."""
        now = time.monotonic()
        for key in [key for key, (_, end) in self._obstacles.items() if end < now]:
            del self._obstacles[key]
        return tuple(obstacle for obstacle, _ in self._obstacles.values())


def moved(obstacle: Obstacle, base_from_old: np.ndarray) -> Obstacle:
    """Return an obstacle in another base frame; one that is attached stays as it is."""
    return obstacle if obstacle.link else replace(obstacle, pose=base_from_old @ obstacle.shape.frame_from_shape)


def _link_of(marker: Marker, links: Collection[str], tips: Collection[str]) -> str:
    """Return the link that a marker is attached to, empty if it stands in the room."""
    frame = marker.header.frame_id.removeprefix('/')
    if marker.frame_locked and frame in links:
        return frame
    if frame in tips:
        raise ArgumentError(f'frame {frame!r} moves with the tip; for an object in the hand, set frame_locked and the '
                            'frame of a link, for one in the room, a frame that stands')
    return ''


def read_marker(marker: Marker, base_from_frame: np.ndarray, link: str = '') -> Obstacle:
    """Return the obstacle of a marker; spheres and cylinders that are not round count with their largest diameter.

    base_from_frame: pose (4, 4) of the marker's frame in the base frame, or in `link`, which it is attached to.

    Raises ArgumentError if the marker is not an obstacle.
    """
    kind = KINDS.get(marker.type)
    if kind is None:
        raise ArgumentError(f'type {marker.type}; expected CUBE, SPHERE or CYLINDER')
    x, y, z = marker.scale.x, marker.scale.y, marker.scale.z
    if not all(0.0 < size < math.inf for size in (x, y, z)):
        raise ArgumentError(f'scale {[x, y, z]}; expected three numbers above 0')
    p, q = marker.pose.position, marker.pose.orientation
    norm = math.hypot(q.x, q.y, q.z, q.w)
    if not abs(norm - 1.0) < 0.01 or not all(map(math.isfinite, (p.x, p.y, p.z))):
        raise ArgumentError(f'pose of norm {norm:.3g} at {[p.x, p.y, p.z]}; expected finite numbers, a unit quaternion')
    sizes = {'box': (x, y, z), 'sphere': (0.5 * max(x, y, z),), 'cylinder': (0.5 * max(x, y), z)}
    pose = base_from_frame @ pose_matrix(p.x, p.y, p.z, q.x, q.y, q.z, q.w)
    return Obstacle(f'{marker.ns}/{marker.id}', kind, sizes[kind], pose, link)


def _end_of(marker: Marker) -> float:
    """Return when the lifetime of a marker ends [s, monotonic]; 0 is none."""
    lifetime = marker.lifetime.sec + 1e-9 * marker.lifetime.nanosec
    return time.monotonic() + lifetime if lifetime > 0.0 else math.inf
