"""Poses and transforms from messages to arrays."""

from __future__ import annotations

import math

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Transform

from ros_ik_pkg.ik.kinematics.pose_error import pose_matrix
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.input.target import Target

QUATERNION_SLACK = 0.01  # norms further from 1 than this are refused; nearer ones are normalised
QUATERNION_ROUNDING = 1e-6  # normalised without a note
MAX_DISTANCE = 1e6  # m; further off, a millimetre is lost in the rounding


def target_pose(target: Target) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the pose (4, 4) [m] in the frame of the target, and notes on what was corrected.

    Raises RefusedError on numbers that are not finite, positions beyond MAX_DISTANCE and quaternions whose
    norm is further than QUATERNION_SLACK from 1.
    """
    position, quaternion = target.position, target.orientation
    norm = math.hypot(*quaternion)
    # NaN fails every comparison.
    good = abs(norm - 1.0) <= QUATERNION_ROUNDING and math.hypot(*position) <= MAX_DISTANCE
    return pose_matrix(*position, *quaternion), () if good else _mended(position, quaternion, norm)


def _mended(position: tuple[float, ...], quaternion: tuple[float, ...], norm: float) -> tuple[str, ...]:
    """Return notes on what is corrected in a pose that is slightly off; raise RefusedError if it is not a pose."""
    for name, values in (('position', position), ('orientation', quaternion)):
        if not all(map(math.isfinite, values)):
            raise RefusedError('not_finite', f'target {name} is {list(values)}; expected finite numbers')
    if max(map(abs, position)) > MAX_DISTANCE:
        raise RefusedError('position', f'target position {list(position)} is beyond {MAX_DISTANCE:g} m')
    if abs(norm - 1.0) > QUATERNION_SLACK:
        raise RefusedError(
            'quaternion',
            f'target orientation has norm {norm:.6g}; expected a unit quaternion x y z w, '
            f'its norm within {QUATERNION_SLACK} of 1',
        )
    return () if abs(norm - 1.0) <= QUATERNION_ROUNDING else (f'quaternion of norm {norm:.6g} normalised',)


def transform_matrix(transform: Transform) -> np.ndarray:
    """Return a transform as a matrix (4, 4) [m]; TF has already checked its numbers."""
    p, q = transform.translation, transform.rotation
    return pose_matrix(p.x, p.y, p.z, q.x, q.y, q.z, q.w)


def stamp_text(stamp: Time) -> str:
    """Return a stamp [s] as text with all its digits."""
    return f'{stamp.sec}.{stamp.nanosec:09d}'
