"""A stand-in for tf2_ros, for machines that have ROS from wheels: tf2 has no wheels.

It has the names, signatures and exceptions of the real package that the IK node uses, and says what the real one says.
It is no replacement: transforms are not interpolated, nothing is forgotten, and as tf2_msgs is missing too,
/tf and /tf_static carry geometry_msgs/TransformStamped, one at a time.
"""

from __future__ import annotations

import time as clock
from collections import defaultdict

import numpy as np
import pinocchio as pin
from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time


class TransformException(Exception):
    """What can be wrong with a transform."""


class LookupException(TransformException):
    """A frame does not exist."""


class ConnectivityException(TransformException):
    """Two frames are not of one tree."""


class ExtrapolationException(TransformException):
    """A time is outside of what is known."""


class InvalidArgumentException(TransformException):
    """A name or a transform makes no sense."""


class Buffer:
    """Transforms by child frame and time [ns]; static ones hold for all times."""

    def __init__(self, cache_time: Duration | None = None, node: Node | None = None) -> None:
        self._parents: dict[str, str] = {}
        self._static: dict[str, pin.SE3] = {}
        self._moving: dict[str, dict[int, pin.SE3]] = defaultdict(dict)

    def set_transform(self, transform: TransformStamped, authority: str) -> None:
        """Keep a transform for its time."""
        stamp = Time.from_msg(transform.header.stamp).nanoseconds
        self._moving[transform.child_frame_id][stamp] = _placement(transform)
        self._parents[transform.child_frame_id] = transform.header.frame_id

    def set_transform_static(self, transform: TransformStamped, authority: str) -> None:
        """Keep a transform for all times."""
        self._static[transform.child_frame_id] = _placement(transform)
        self._parents[transform.child_frame_id] = transform.header.frame_id

    def can_transform(
        self, target_frame: str, source_frame: str, time: Time, timeout: Duration | None = None
    ) -> bool:
        """Wait for a transform, looking every 20 ms as the real one does."""
        deadline = clock.monotonic() + (timeout.nanoseconds / 1e9 if timeout else 0.0)
        while True:
            try:
                self._lookup(target_frame, source_frame, time.nanoseconds)
            except TransformException:
                if clock.monotonic() >= deadline:
                    return False
                clock.sleep(0.02)
            else:
                return True

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Time, timeout: Duration | None = None
    ) -> TransformStamped:
        """Return the transform that leads from coordinates in the source frame to those in the target frame."""
        self.can_transform(target_frame, source_frame, time, timeout)
        placement = self._lookup(target_frame, source_frame, time.nanoseconds)
        found = TransformStamped(child_frame_id=source_frame)
        found.header.frame_id, found.header.stamp = target_frame, time.to_msg()
        p, q = found.transform.translation, found.transform.rotation
        p.x, p.y, p.z, q.x, q.y, q.z, q.w = pin.SE3ToXYZQUAT(placement).tolist()
        return found

    def _lookup(self, target: str, source: str, stamp: int) -> pin.SE3:
        known = {*self._parents, *self._parents.values()}
        for role, frame in (('target_frame', target), ('source_frame', source)):
            if frame.startswith('/'):
                raise InvalidArgumentException(f'tf2 frame_ids cannot start with a "/" like: "{frame}"')
            if frame not in known:
                raise LookupException(f'"{frame}" passed to lookupTransform argument {role} does not exist. ')
        (target_root, root_from_target), (source_root, root_from_source) = (
            self._from_root(frame, stamp) for frame in (target, source)
        )
        if target_root != source_root:
            raise ConnectivityException(
                f"Could not find a connection between '{target}' and '{source}' because they are not part of the same "
                'tree.Tf has two or more unconnected trees.'
            )
        return root_from_target.actInv(root_from_source)

    def _from_root(self, frame: str, stamp: int) -> tuple[str, pin.SE3]:
        placement = pin.SE3.Identity()
        while frame in self._parents:
            placement = self._parent_from(frame, stamp) * placement
            frame = self._parents[frame]
        return frame, placement

    def _parent_from(self, frame: str, stamp: int) -> pin.SE3:
        if frame in self._static:
            return self._static[frame]
        times = np.array(sorted(self._moving[frame]))
        stamp = stamp or times[-1]
        if not times[0] <= stamp <= times[-1]:
            way = 'future' if stamp > times[-1] else 'past'
            raise ExtrapolationException(
                f'Lookup would require extrapolation into the {way}.  Requested time {stamp / 1e9:.6f} but the '
                f'{"latest" if way == "future" else "earliest"} data is at time {times[-(way == "future")] / 1e9:.6f}, '
                f'when looking up transform from frame [{frame}]'
            )
        return self._moving[frame][times[times <= stamp][-1]]


class TransformListener:
    """Fills a buffer from /tf and /tf_static."""

    def __init__(self, buffer: Buffer, node: Node, *, spin_thread: bool = False) -> None:
        latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        moving, static = buffer.set_transform, buffer.set_transform_static
        node.create_subscription(TransformStamped, '/tf', lambda message: moving(message, 'default_authority'), 100)
        node.create_subscription(
            TransformStamped, '/tf_static', lambda message: static(message, 'default_authority'), latched
        )


def _placement(transform: TransformStamped) -> pin.SE3:
    p, q = transform.transform.translation, transform.transform.rotation
    return pin.XYZQUATToSE3(np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w]))
