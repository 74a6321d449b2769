"""Twist error between two poses, [p* - p ; log(R* R^T)], base axes [m, rad].

The logarithm goes through the unit quaternion (Shepperd 1978: divide by the largest component), which is
well conditioned from 0 to pi and tolerates rotations that are slightly off SO(3).
"""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import compiled, inlined

# atan(x) / x = 1 + A0 x^2 + A1 x^4 + ..., to the last place for x^2 below SMALL (angles below 0.14 rad)
SMALL = 0.005
A = (-1.0 / 3.0, 1.0 / 5.0, -1.0 / 7.0, 1.0 / 9.0, -1.0 / 11.0, 1.0 / 13.0)


def pose_matrix(px, py, pz, x, y, z, w):
    """Return the pose (4, 4) of a position [m] and a quaternion, which need not have unit length."""
    pose = np.zeros((4, 4))
    write_pose(pose, px, py, pz, x, y, z, w)
    return pose


@compiled
def write_pose(pose, px, py, pz, x, y, z, w):
    """Fill a zeroed (4, 4) matrix with the pose; see pose_matrix."""
    s = 2.0 / (w * w + x * x + y * y + z * z)
    xx, yy, zz, xy, xz, yz = s * x * x, s * y * y, s * z * z, s * x * y, s * x * z, s * y * z
    wx, wy, wz = s * w * x, s * w * y, s * w * z
    pose[0, 0], pose[0, 1], pose[0, 2], pose[0, 3] = 1.0 - yy - zz, xy - wz, xz + wy, px
    pose[1, 0], pose[1, 1], pose[1, 2], pose[1, 3] = xy + wz, 1.0 - xx - zz, yz - wx, py
    pose[2, 0], pose[2, 1], pose[2, 2], pose[2, 3] = xz - wy, yz + wx, 1.0 - xx - yy, pz
    pose[3, 3] = 1.0


@inlined
def quaternion(R):
    """Return (w, x, y, z), not normalised, of a rotation given row by row."""
    trace = R[0] + R[4] + R[8]
    if trace >= R[0] and trace >= R[4] and trace >= R[8]:
        return 1.0 + trace, R[7] - R[5], R[2] - R[6], R[3] - R[1]
    if R[0] >= R[4] and R[0] >= R[8]:
        return R[7] - R[5], 1.0 + R[0] - R[4] - R[8], R[1] + R[3], R[2] + R[6]
    if R[4] >= R[8]:
        return R[2] - R[6], R[1] + R[3], 1.0 - R[0] + R[4] - R[8], R[5] + R[7]
    return R[3] - R[1], R[2] + R[6], R[5] + R[7], 1.0 - R[0] - R[4] + R[8]


@inlined
def rotation_log(R):
    """Return the rotation vector (angle times axis) of R, its angle from 0 to pi [rad]."""
    w, x, y, z = quaternion(R)
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    square = x * x + y * y + z * z
    if square < SMALL * w * w:  # a third of the time, for the usual case
        t = square / (w * w)
        scale = (2.0 / w) * (1.0 + t * (A[0] + t * (A[1] + t * (A[2] + t * (A[3] + t * (A[4] + t * A[5]))))))
    else:
        sine = math.sqrt(square)
        scale = 2.0 * math.atan2(sine, w) / sine
    return scale * x, scale * y, scale * z


@inlined
def difference(A, B):
    """Return A B^T of two rotations given row by row."""
    return (
        A[0] * B[0] + A[1] * B[1] + A[2] * B[2],
        A[0] * B[3] + A[1] * B[4] + A[2] * B[5],
        A[0] * B[6] + A[1] * B[7] + A[2] * B[8],
        A[3] * B[0] + A[4] * B[1] + A[5] * B[2],
        A[3] * B[3] + A[4] * B[4] + A[5] * B[5],
        A[3] * B[6] + A[4] * B[7] + A[5] * B[8],
        A[6] * B[0] + A[7] * B[1] + A[8] * B[2],
        A[6] * B[3] + A[7] * B[4] + A[8] * B[5],
        A[6] * B[6] + A[7] * B[7] + A[8] * B[8],
    )


@inlined
def twist_error(target_R, target_p, R, p):
    """Return the six components of [p* - p ; log(R* R^T)]."""
    rx, ry, rz = rotation_log(difference(target_R, R))
    return target_p[0] - p[0], target_p[1] - p[1], target_p[2] - p[2], rx, ry, rz
