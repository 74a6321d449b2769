"""Obstacles and held objects from MoveIt's messages.

Only the fields are read, so nothing here imports moveit_msgs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from geometry_msgs.msg import Pose
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Header

from ros_ik_pkg.ik import ArgumentError, Obstacle
from ros_ik_pkg.ik.kinematics.pose_error import pose_matrix
from ros_ik_pkg.ik.text import shorten, suggest
from ros_ik_pkg.ik.world import MOST_OBSTACLES
from ros_ik_pkg.ros.input.obstacle_markers import Place, moved
from ros_ik_pkg.ros.input.refusal import RefusedError

ADD, REMOVE, APPEND, MOVE = (bytes([value]) for value in range(4))


class SceneObjects:
    """The objects of MoveIt's planning scene, each until it is removed.

    An object with a mesh, plane, cone or prism is refused with a reason.
    """

    def __init__(self) -> None:
        self._room: dict[str, tuple[Obstacle, ...]] = {}
        self._held: dict[str, tuple[Obstacle, ...]] = {}

    def current(self) -> tuple[Obstacle, ...]:
        """Return all obstacles, including held ones."""
        return tuple(part for parts in (*self._room.values(), *self._held.values()) for part in parts)

    def move(self, base_from_old: np.ndarray) -> None:
        """Leave all objects where they are in another base frame, in which the old one has this pose (4, 4)."""
        self._room = {name: tuple(moved(part, base_from_old) for part in parts) for name, parts in self._room.items()}

    def take(
        self, message: Any, place: Place, links: Collection[str], tips: Collection[str] = ()
    ) -> list[str]:
        """Take a PlanningScene, CollisionObject or AttachedCollisionObject of moveit_msgs; return why objects are
        ignored. `links` are those of the robot, `tips` the frames that move with its tip."""
        if hasattr(message, 'link_name'):
            return self._guard(message.object.id, self._take_held, message, place, links)
        if hasattr(message, 'primitives'):
            return self._guard(message.id, self._take_object, message, place, tips)
        return self._take_scene(message, place, links, tips)

    def _take_scene(self, message: Any, place: Place, links: Collection[str], tips: Collection[str]) -> list[str]:
        """Take a whole scene or a difference."""
        if not message.is_diff:
            self._room.clear()
        if not (message.is_diff or message.robot_state.is_diff):
            self._held.clear()
        return [
            reason
            for item in (*message.world.collision_objects, *message.robot_state.attached_collision_objects)
            for reason in self.take(item, place, links, tips)
        ]

    @staticmethod
    def _guard(name: str, take: Callable[..., None], *arguments: Any) -> list[str]:
        """Take an object; return why it is ignored, if it is."""
        try:
            take(*arguments)
        except (ArgumentError, RefusedError) as error:
            return [shorten(f'object {name!r}: {error}', 300)]
        return []

    def _take_object(self, message: Any, place: Place, tips: Collection[str]) -> None:
        name, operation = message.id, _operation(message)
        if operation == REMOVE:
            if not name:
                self._room.clear()
            self._room.pop(name, None)
            return
        if name in self._held:
            raise ArgumentError('it is held; let go of it first')
        if operation == MOVE:
            raise ArgumentError('operation MOVE; expected ADD with the whole object')
        if (frame := message.header.frame_id.removeprefix('/')) in tips:
            raise ArgumentError(f'frame {frame!r} moves with the tip; send an AttachedCollisionObject for an object in '
                                'the hand, or another frame')
        before = self._room.get(name, ()) if operation == APPEND else ()
        shapes = tuple(_parts(message, place(message.header), len(before)))
        self._room[name] = (*before, *self._check_count(shapes))

    def _take_held(self, message: Any, place: Place, links: Collection[str]) -> None:
        """Attach or release an object; a released object stays in the room where it is, as in MoveIt."""
        item, link = message.object, message.link_name
        if _operation(item) == REMOVE:
            for name in [item.id] if item.id else list(self._held):
                parts = self._held.get(name, ())
                self._room |= {name: tuple(
                    replace(part, pose=place(Header(frame_id=part.link)) @ part.pose, link='', touches=())
                    for part in parts
                )} if parts else {}
                self._held.pop(name, None)
            return
        if item.header.frame_id not in ('', link):
            raise ArgumentError(f'frame {item.header.frame_id!r}; a held object has the frame of its link {link!r}')
        if link not in links:
            raise ArgumentError(f'link_name {link!r} does not exist; {suggest(link, links)}')
        touches = tuple(name for name in message.touch_links if name in links and name != link)
        self._held[item.id] = self._check_count(tuple(_parts(item, np.eye(4), 0, link, touches)))
        self._room.pop(item.id, None)  # it was taken up

    def _check_count(self, shapes: tuple[Obstacle, ...]) -> tuple[Obstacle, ...]:
        if len(self.current()) + len(shapes) > MOST_OBSTACLES:
            raise ArgumentError(f'more than {MOST_OBSTACLES} obstacles')
        return shapes


def _operation(message: Any) -> bytes:
    """Return the operation of an object, a byte of the four."""
    if message.operation not in (ADD, REMOVE, APPEND, MOVE):
        raise ArgumentError(f'operation {message.operation!r}; expected ADD, REMOVE or APPEND')
    return message.operation


def _parts(
    message: Any, base_from_frame: np.ndarray, first: int, link: str = '', touches: tuple[str, ...] = ()
) -> Iterator[Obstacle]:
    """Yield the primitives of an object, numbered from `first` on; raises ArgumentError."""
    if message.meshes or message.planes:
        raise ArgumentError('has a mesh or a plane; expected boxes, spheres and cylinders')
    if not message.primitives or len(message.primitives) != len(message.primitive_poses):
        raise ArgumentError(f'has {len(message.primitives)} primitives and {len(message.primitive_poses)} poses; '
                            'expected as many of both, one at least')
    base_from_object = base_from_frame @ _pose(message.pose, zero_is_identity=True)
    for number, (primitive, pose) in enumerate(zip(message.primitives, message.primitive_poses), first):
        kind, size = _shape(primitive)
        name = f'object {message.id}' + (f' {number}' if number else '')
        yield Obstacle(name, kind, size, base_from_object @ _pose(pose), link, touches)


def _shape(primitive: SolidPrimitive) -> tuple[str, tuple[float, ...]]:
    """Return kind and size of a primitive as Obstacle has them [m]; raises ArgumentError."""
    size = tuple(primitive.dimensions)
    if primitive.type == SolidPrimitive.BOX and len(size) == 3:
        return 'box', size
    if primitive.type == SolidPrimitive.SPHERE and len(size) == 1:
        return 'sphere', size
    if primitive.type == SolidPrimitive.CYLINDER and len(size) == 2:
        return 'cylinder', (size[1], size[0])
    raise ArgumentError(f'primitive of type {primitive.type} with {len(size)} dimensions; expected a box with 3, a '
                        'sphere with 1 or a cylinder with 2')


def _pose(pose: Pose, zero_is_identity: bool = False) -> np.ndarray:
    """Return a pose as a matrix (4, 4); raises ArgumentError. An object's own pose may be left at zero."""
    p, q = pose.position, pose.orientation
    norm = math.hypot(q.x, q.y, q.z, q.w)
    if zero_is_identity and norm == 0.0:
        q, norm = type(q)(w=1.0), 1.0
    if not abs(norm - 1.0) < 0.01 or not all(map(math.isfinite, (p.x, p.y, p.z))):
        raise ArgumentError(f'pose of norm {norm:.3g} at {[p.x, p.y, p.z]}; expected finite numbers, a unit quaternion')
    return pose_matrix(p.x, p.y, p.z, q.x, q.y, q.z, q.w)
