"""Forward kinematics and the geometric Jacobian of one chain, in one pass.

A chain is a Geometry: constant placements between joints whose motion axis is local z, joint kinds, and
the map from the variables q to joint values (mimic joints).
Rotations are tuples of nine numbers, row by row: they stay in registers, arrays would not.
"""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik.compiled import compiled, inlined, kernel
from ros_ik_pkg.ik.records import count_joints, unpack_model
from ros_ik_pkg.ik.sincos import sincos


@inlined
def turn_about_z(R, angle):
    """Return R Rz(angle)."""
    s, c = sincos(angle)
    return (
        R[0] * c + R[1] * s, R[1] * c - R[0] * s, R[2],
        R[3] * c + R[4] * s, R[4] * c - R[3] * s, R[5],
        R[6] * c + R[7] * s, R[7] * c - R[6] * s, R[8],
    )  # fmt: skip


@inlined
def place(R, p, rows, k):
    """Return rotation and position of (R, p) followed by the constant placement in row k."""
    x, y, z = rows[k, 9], rows[k, 10], rows[k, 11]
    moved = (
        p[0] + R[0] * x + R[1] * y + R[2] * z,
        p[1] + R[3] * x + R[4] * y + R[5] * z,
        p[2] + R[6] * x + R[7] * y + R[8] * z,
    )
    turned = (
        R[0] * rows[k, 0] + R[1] * rows[k, 3] + R[2] * rows[k, 6],
        R[0] * rows[k, 1] + R[1] * rows[k, 4] + R[2] * rows[k, 7],
        R[0] * rows[k, 2] + R[1] * rows[k, 5] + R[2] * rows[k, 8],
        R[3] * rows[k, 0] + R[4] * rows[k, 3] + R[5] * rows[k, 6],
        R[3] * rows[k, 1] + R[4] * rows[k, 4] + R[5] * rows[k, 7],
        R[3] * rows[k, 2] + R[4] * rows[k, 5] + R[5] * rows[k, 8],
        R[6] * rows[k, 0] + R[7] * rows[k, 3] + R[8] * rows[k, 6],
        R[6] * rows[k, 1] + R[7] * rows[k, 4] + R[8] * rows[k, 7],
        R[6] * rows[k, 2] + R[7] * rows[k, 5] + R[8] * rows[k, 8],
    )
    return turned, moved


@inlined
def walk(geometry, q, axes):
    """Return rotation and position of the tip; write axis z_i and a point p_i of every joint to `axes` (nj, 6)."""
    R = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    p = (0.0, 0.0, 0.0)
    joints = len(geometry.prismatic)
    for i in range(joints):
        R, p = place(R, p, geometry.placements, i)
        axes[i, 0], axes[i, 1], axes[i, 2] = R[2], R[5], R[8]
        axes[i, 3], axes[i, 4], axes[i, 5] = p
        value = geometry.multiplier[i] * q[int(geometry.variable[i])] + geometry.offset[i]
        if geometry.prismatic[i]:
            p = (p[0] + value * R[2], p[1] + value * R[5], p[2] + value * R[8])
        else:
            R = turn_about_z(R, value)
    return place(R, p, geometry.placements, joints)


@inlined
def fill_columns(geometry, axes, p, columns):
    """Write the Jacobian's columns [z x (p - p_i) ; z] or [z ; 0] as rows of `columns` (n, 6)."""
    columns[:] = 0.0
    for i in range(len(geometry.prismatic)):
        v, m = int(geometry.variable[i]), geometry.multiplier[i]
        x, y, z = m * axes[i, 0], m * axes[i, 1], m * axes[i, 2]
        if geometry.prismatic[i]:
            columns[v, 0] += x
            columns[v, 1] += y
            columns[v, 2] += z
        else:
            dx, dy, dz = p[0] - axes[i, 3], p[1] - axes[i, 4], p[2] - axes[i, 5]
            columns[v, 0] += y * dz - z * dy
            columns[v, 1] += z * dx - x * dz
            columns[v, 2] += x * dy - y * dx
            columns[v, 3] += x
            columns[v, 4] += y
            columns[v, 5] += z


@compiled
def forward_kinematics(model, q):
    """Return the (4, 4) pose of the tip in the base frame [m]; `model` is what pack_model packed."""
    base_from_tip = np.eye(4)
    _write_pose(model, q, np.empty((count_joints(model, len(q)), 6)), base_from_tip)
    return base_from_tip


@kernel
def _write_pose(model, q, axes, base_from_tip):
    """Write rotation and position of the tip."""
    geometry, _ = unpack_model(model, len(q))
    R, p = walk(geometry, q, axes)
    for i in range(3):
        base_from_tip[i, 3] = p[i]
        for j in range(3):
            base_from_tip[i, j] = R[3 * i + j]


@compiled
def geometric_jacobian(model, q):
    """Return the (6, n) geometric Jacobian of the tip, linear rows first, in base axes."""
    columns = np.empty((len(q), 6))
    _write_columns(model, q, np.empty((count_joints(model, len(q)), 6)), columns)
    return columns.T.copy()


@kernel
def _write_columns(model, q, axes, columns):
    """Write the Jacobian by columns."""
    geometry, _ = unpack_model(model, len(q))
    _, p = walk(geometry, q, axes)
    fill_columns(geometry, axes, p, columns)
