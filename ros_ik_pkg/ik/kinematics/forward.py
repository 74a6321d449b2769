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
from ros_ik_pkg.ik.kernel.vectors import plus_times


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
        x, y, z = turned(x, y, z, rows, i, c, s)
        joints.axes[i, 0], joints.axes[i, 1], joints.axes[i, 2] = z
        joints.axes[i, 3], joints.axes[i, 4], joints.axes[i, 5] = p
        if prismatic:
            p = plus_times(p, z, joints.values[i])
    return tip_of(p, x, y, z, rows, count)


@inlined
def turned(x, y, z, rows, k, cosine, sine):
    """Return the axes of the frame after placement k, from the axes x, y, z, and a turn about the last of them."""
    # The placement is turned first: this takes one product off the serial dependency chain.
    return (
        combine(x, y, z, rows[k, 0] * cosine + rows[k, 1] * sine, rows[k, 3] * cosine + rows[k, 4] * sine,
                rows[k, 6] * cosine + rows[k, 7] * sine),
        combine(x, y, z, rows[k, 1] * cosine - rows[k, 0] * sine, rows[k, 4] * cosine - rows[k, 3] * sine,
                rows[k, 7] * cosine - rows[k, 6] * sine),
        combine(x, y, z, rows[k, 2], rows[k, 5], rows[k, 8]),
    )  # fmt: skip


@inlined
def tip_of(p, x, y, z, rows, k):
    """Return rotation (nine numbers, row by row) and position of the frame after placement k, the last one, from the
    frame with the axes x, y, z at p."""
    p = beyond(p, x, y, z, rows, k)
    a, b, c = (
        combine(x, y, z, rows[k, 0], rows[k, 3], rows[k, 6]),
        combine(x, y, z, rows[k, 1], rows[k, 4], rows[k, 7]),
        combine(x, y, z, rows[k, 2], rows[k, 5], rows[k, 8]),
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
