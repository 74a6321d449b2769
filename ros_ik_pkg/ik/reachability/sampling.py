"""Poses of random configurations, cell by cell, compiled."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik.collision.obstruction import make_obstruction, obstruction_size, touches
from ros_ik_pkg.ik.kernel.compiled import compiled, inlined, kernel
from ros_ik_pkg.ik.kernel.data_layout import joints_size, make_joints, unpack_model
from ros_ik_pkg.ik.kernel.linalg import assign, svd
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.kinematics.forward import fill_columns, walk
from ros_ik_pkg.ik.reachability.cells import position_cell, rotation_cell

UNKNOWN = -1
GOLDEN = np.uint64(0x9E3779B97F4A7C15)
MIX_1, MIX_2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
S30, S27, S31, S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
TO_UNIT = 2.0**-53


@inlined
def uniform(count):
    """Return a number in [0, 1) that depends on `count` (uint64) alone (SplitMix64, Steele 2014).

    So a sample can be made again from its number, on any thread.
    """
    z = count * GOLDEN
    z = (z ^ (z >> S30)) * MIX_1
    z = (z ^ (z >> S27)) * MIX_2
    return np.float64((z ^ (z >> S31)) >> S11) * TO_UNIT


@inlined
def write_sample(number, lower, spans, q):
    """Write the configuration with this number, uniform between the limits."""
    for i in range(len(q)):
        q[i] = lower[i] + spans[i] * uniform(np.uint64(number * len(q) + i + 1))


@compiled
def mark_samples(model, lower, spans, corner, step, shape, parts, first, count, margin, found):
    """Write to `found` (cells,) the number of the first sample, from `first` to `first + count - 1`, that reaches a
    cell clear of contact, if the cell is UNKNOWN there.

    `model` is a packed arm, with a packed scene behind it if contact counts; margin [m].
    """
    memory = np.empty(joints_size(model) + obstruction_size(model))
    _mark(model, lower, spans, corner, step, shape, parts, first, count, margin, memory, np.empty((0, 0)), found,
          np.empty(len(lower)))  # fmt: skip


@kernel
def _mark(model, lower, spans, corner, step, shape, parts, first, count, margin, memory, none, found, q):
    """Implement `mark_samples`."""
    geometry, _, _ = unpack_model(model)
    joints = make_joints(model, memory)
    size = joints_size(model)
    obstruction = make_obstruction(model, shaped(memory, size, (len(memory) - size,)), none, none)
    for number in range(first, first + count):
        write_sample(number, lower, spans, q)
        cell = _cell_of(geometry, joints, q, corner, step, shape, parts)
        if cell >= 0 and found[cell] == UNKNOWN and not touches(obstruction, margin, q):
            found[cell] = number


@inlined
def _cell_of(geometry, joints, q, corner, step, shape, parts):
    """Return the cell of the tip's pose at q, -1 outside the grid."""
    R, p = walk(geometry, q, joints)
    return cell_of_pose(R, p, corner, step, shape, parts)


@inlined
def cell_of_pose(R, p, corner, step, shape, parts):
    """Return the cell of a pose, -1 outside the grid."""
    place = position_cell(p, corner, step, shape)
    return place * 4 * parts * parts * parts + rotation_cell(R, parts) if place >= 0 else -1


@compiled
def samples(numbers, lower, spans):
    """Return the configurations (k, n) with these numbers (k,)."""
    q = np.empty((len(numbers), len(lower)))
    _write_samples(numbers, lower, spans, q)
    return q


@kernel
def _write_samples(numbers, lower, spans, q):
    """Write the configurations."""
    for k in range(len(numbers)):
        write_sample(numbers[k], lower, spans, q[k])


@compiled
def look_at(model, configurations, corner, step, shape, parts):
    """Return the cells (k,) of configurations (k, n), -1 outside the grid, and the smallest singular values (k,) of
    their Jacobians."""
    cells, sigmas = np.empty(len(configurations), np.int64), np.empty(len(configurations))
    n = configurations.shape[1]
    _look_at(model, configurations, corner, step, shape, parts, np.empty(joints_size(model)), np.empty(n),
             np.empty((n, 6)), np.empty((6, 6)), np.empty((6, n)), np.empty(6), cells, sigmas)  # fmt: skip
    return cells, sigmas


@kernel
def _look_at(model, configurations, corner, step, shape, parts, memory, q, columns, U, W, sigma, cells, sigmas):
    """Implement `look_at`."""
    geometry, _, _ = unpack_model(model)
    joints = make_joints(model, memory)
    for k in range(len(configurations)):
        assign(q, configurations[k])
        R, p = walk(geometry, q, joints)
        cells[k] = cell_of_pose(R, p, corner, step, shape, parts)
        fill_columns(geometry, joints.axes, p, columns)
        svd(columns, U, W, sigma)
        sigmas[k] = sigma[min(len(q), 6) - 1]
