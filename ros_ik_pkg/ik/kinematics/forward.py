"""Forward kinematics and the geometric Jacobian of one chain, in one pass.

A chain is a Geometry: constant placements between joints whose motion axis is local z, joint kinds, and
the map from the variables q to joint values (mimic joints).
A frame is held as its three axes and its origin, tuples of three numbers.
"""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import compiled, inlined, kernel
from ros_ik_pkg.ik.kernel.data_layout import joints_size, make_joints, unpack_model
from ros_ik_pkg.ik.kernel.linalg import fill
from ros_ik_pkg.ik.kernel.sincos import sincos_all


@inlined
def walk(geometry, q, joints):
    """Return rotation (nine numbers, row by row) and position of the tip; write axes and joint values to `joints`."""
    count, rows = len(geometry.prismatic), geometry.placements
    for i in range(count):
        joints.values[i] = geometry.multiplier[i] * q[int(geometry.variable[i])] + geometry.offset[i]
    for i in range(count, len(joints.values)):
        joints.values[i] = 0.0
    sincos_all(joints.values, joints.sines, joints.cosines)
    x, y, z, p = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    for i in range(count):
        prismatic = geometry.prismatic[i] != 0.0
        s, c = (0.0, 1.0) if prismatic else (joints.sines[i], joints.cosines[i])
        p = beyond(p, x, y, z, rows, i)
        # Rotate the placement by the joint first: this takes one product off the serial dependency chain.
        x, y, z = (
            combine(x, y, z, rows[i, 0] * c + rows[i, 1] * s, rows[i, 3] * c + rows[i, 4] * s,
                    rows[i, 6] * c + rows[i, 7] * s),
            combine(x, y, z, rows[i, 1] * c - rows[i, 0] * s, rows[i, 4] * c - rows[i, 3] * s,
                    rows[i, 7] * c - rows[i, 6] * s),
            combine(x, y, z, rows[i, 2], rows[i, 5], rows[i, 8]),
        )  # fmt: skip
        joints.axes[i, 0], joints.axes[i, 1], joints.axes[i, 2] = z
        joints.axes[i, 3], joints.axes[i, 4], joints.axes[i, 5] = p
        if prismatic:
            p = plus_times(p, z, joints.values[i])
    p = beyond(p, x, y, z, rows, count)
    a, b, c = (
        combine(x, y, z, rows[count, 0], rows[count, 3], rows[count, 6]),
        combine(x, y, z, rows[count, 1], rows[count, 4], rows[count, 7]),
        combine(x, y, z, rows[count, 2], rows[count, 5], rows[count, 8]),
    )
    return (a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2]), p


@inlined
def combine(x, y, z, a, b, c):
    """Return x a + y b + z c of three vectors."""
    return (
        x[0] * a + y[0] * b + z[0] * c,
        x[1] * a + y[1] * b + z[1] * c,
        x[2] * a + y[2] * b + z[2] * c,
    )


@inlined
def plus_times(p, x, a):
    """Return p + x a of two vectors."""
    return p[0] + x[0] * a, p[1] + x[1] * a, p[2] + x[2] * a


@inlined
def beyond(p, x, y, z, rows, k):
    """Return p moved by the translation of placement k, from the frame with the axes x, y, z."""
    return plus_times(plus_times(plus_times(p, x, rows[k, 9]), y, rows[k, 10]), z, rows[k, 11])


@inlined
def fill_columns(geometry, axes, p, columns):
    """Write the Jacobian's columns [z x (p - p_i) ; z] or [z ; 0] as rows of `columns` (n, 6)."""
    # Where the joints are the variables, in order, each column is written once. Else joints may share a variable, and
    # their columns add up, or a variable may belong to the chain of another tip.
    once = len(geometry.prismatic) == len(columns)
    for i in range(len(columns) if once else 0):
        once = once and geometry.variable[i] == i
    for v in range(0 if once else len(columns)):
        fill(columns[v], 0.0)
    for i in range(len(geometry.prismatic)):
        v, m = int(geometry.variable[i]), geometry.multiplier[i]
        x, y, z = m * axes[i, 0], m * axes[i, 1], m * axes[i, 2]
        if geometry.prismatic[i]:
            a, b, c, d, e, f = x, y, z, 0.0, 0.0, 0.0
        else:
            dx, dy, dz = p[0] - axes[i, 3], p[1] - axes[i, 4], p[2] - axes[i, 5]
            a, b, c, d, e, f = y * dz - z * dy, z * dx - x * dz, x * dy - y * dx, x, y, z
        if not once:
            a, b, c = columns[v, 0] + a, columns[v, 1] + b, columns[v, 2] + c
            d, e, f = columns[v, 3] + d, columns[v, 4] + e, columns[v, 5] + f
        columns[v, 0], columns[v, 1], columns[v, 2], columns[v, 3], columns[v, 4], columns[v, 5] = a, b, c, d, e, f


@compiled
def forward_kinematics(model, q, base_from_tip):
    """Write rotation and position of the tip in the base frame [m] to a (4, 4) pose; `model` is what pack_model packed.

    Creating the array in compiled code would take half a microsecond more, and give it a dtype of its own.
    """
    _write_pose(model, q, np.empty(joints_size(model)), base_from_tip)


@kernel
def _write_pose(model, q, memory, base_from_tip):
    """Write rotation and position of the tip."""
    geometry, _, _ = unpack_model(model)
    R, p = walk(geometry, q, make_joints(model, memory))
    for i in range(3):
        base_from_tip[i, 3] = p[i]
        for j in range(3):
            base_from_tip[i, j] = R[3 * i + j]


@compiled
def geometric_jacobian(model, q):
    """Return the (6, n) geometric Jacobian of the tip, linear rows first, in base axes."""
    columns = np.empty((len(q), 6))
    _write_columns(model, q, np.empty(joints_size(model)), columns)
    return columns.T.copy()


@kernel
def _write_columns(model, q, memory, columns):
    """Write the Jacobian by columns."""
    geometry, _, _ = unpack_model(model)
    joints = make_joints(model, memory)
    _, p = walk(geometry, q, joints)
    fill_columns(geometry, joints.axes, p, columns)
