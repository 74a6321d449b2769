"""Steps into a cell: from a configuration beside it, each towards the pose of the cell that is nearest, compiled.

Random configurations miss cells of which the arm reaches only a thin corner. Damped least squares (Wampler 1986,
Nakamura and Hanafusa 1986) goes there: its target is no pose but a whole cell, so it stops at the first pose inside.
"""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.collision.obstruction import make_obstruction, obstruction_size, touches
from ros_ik_pkg.ik.kernel.compiled import compiled, inlined, kernel
from ros_ik_pkg.ik.kernel.data_layout import joints_size, make_joints, unpack_model
from ros_ik_pkg.ik.kernel.linalg import assign, factor, gram, substitute
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.kinematics.forward import fill_columns, walk
from ros_ik_pkg.ik.kinematics.pose_error import quaternion
from ros_ik_pkg.ik.reachability.cells import QUARTER
from ros_ik_pkg.ik.reachability.sampling import cell_of_pose

STEPS = 24
SLACK = 1e-3  # of a cell's width: how far inside its border the nearest pose is
DAMPING = 0.01  # square of the damping, of errors in widths of a cell
LONGEST = 0.6  # rad, m: step of a joint
SLOW = 0.99  # of the least error so far: what falls less leads nowhere


@inlined
def inside(value, low, width):
    """Return the number nearest to `value` that is inside a range."""
    return min(max(value, low + SLACK * width), low + (1.0 - SLACK) * width)


@inlined
def inside_part(tangent, part, parts):
    """Return the tangent nearest to `tangent` that is in one of the parts from -45 to 45 degrees."""
    width = 2.0 * QUARTER / parts
    return math.tan(inside(math.atan(tangent), part * width - QUARTER, width))


@inlined
def turn_into(R, cell, parts):
    """Return the rotation vector [rad], about, from R to the nearest rotation of a cell: right in direction, and within
    a tenth up to 60 degrees."""
    w, x, y, z = quaternion(R)
    square = parts * parts
    face, i, j, k = cell // (square * parts), cell // square % parts, cell // parts % parts, cell % parts
    largest, a, b, c = w, x, y, z
    if face == 1:
        largest, a, b, c = x, w, y, z
    elif face == 2:
        largest, a, b, c = y, w, x, z
    elif face == 3:
        largest, a, b, c = z, w, x, y
    if largest == 0.0:
        largest = 1e-12
    a, b, c = inside_part(a / largest, i, parts), inside_part(b / largest, j, parts), inside_part(c / largest, k, parts)
    tw, tx, ty, tz = 1.0, a, b, c
    if face == 1:
        tw, tx, ty, tz = a, 1.0, b, c
    elif face == 2:
        tw, tx, ty, tz = a, b, 1.0, c
    elif face == 3:
        tw, tx, ty, tz = a, b, c, 1.0
    real = tw * w + tx * x + ty * y + tz * z
    if real == 0.0:
        real = 1e-12
    scale = 2.0 / real
    return (
        scale * (tx * w - tw * x + tz * y - ty * z),
        scale * (ty * w - tw * y + tx * z - tz * x),
        scale * (tz * w - tw * z + ty * x - tx * y),
    )


@compiled
def mark_aimed(model, cells, sources, lower, upper, corner, step, shape, parts, margin, known, out):
    """Aim at cells (k,) that are not `known`, each from its source (k, n); write the configurations that reach a cell
    that is not known, on the way too, to `out`, note the cell as known, and return how many there are."""
    n = sources.shape[1]
    memory = np.empty(joints_size(model) + obstruction_size(model))
    return _mark_aimed(model, cells, sources, lower, upper, corner, step, shape, parts, margin, memory,
                       np.empty((0, 0)), np.empty(n), np.empty((n, 6)), known, out)  # fmt: skip


@kernel
def _mark_aimed(model, cells, sources, lower, upper, corner, step, shape, parts, margin, memory, none, q, columns,
                known, out):  # fmt: skip
    """Implement `mark_aimed`."""
    geometry, _, _ = unpack_model(model)
    joints = make_joints(model, memory)
    size, new, rotations = joints_size(model), 0, 4 * parts * parts * parts
    obstruction = make_obstruction(model, shaped(memory, size, (len(memory) - size,)), none, none)
    metre, radian = 1.0 / step, parts / (4.0 * QUARTER)
    for row in range(len(cells)):
        cell = cells[row]
        if new == len(out):
            return new
        assign(q, sources[row])
        place, least = cell // rotations, np.inf
        low_x = corner[0] + step * (place // (shape[1] * shape[2]))
        low_y = corner[1] + step * (place // shape[2] % shape[1])
        low_z = corner[2] + step * (place % shape[2])
        for _ in range(STEPS):
            if known[cell] or new == len(out):
                break
            R, p = walk(geometry, q, joints)
            here = cell_of_pose(R, p, corner, step, shape, parts)
            if here >= 0 and not known[here] and not touches(obstruction, margin, q):
                known[here] = True
                assign(out[new], q)
                new += 1
            if here == cell:  # reached, or it touches
                break
            x = metre * (inside(p[0], low_x, step) - p[0])
            y = metre * (inside(p[1], low_y, step) - p[1])
            z = metre * (inside(p[2], low_z, step) - p[2])
            u, v, w = turn_into(R, cell % rotations, parts)
            error = x * x + y * y + z * z + radian * radian * (u * u + v * v + w * w)
            if error > SLOW * least:
                break
            least = error
            fill_columns(geometry, joints.axes, p, columns)
            for i in range(len(q)):
                for r in range(3):
                    columns[i, r] *= metre
                    columns[i, 3 + r] *= radian
            _step_into(q, columns, (x, y, z, radian * u, radian * v, radian * w), lower, upper)
    return new


@inlined
def _step_into(q, columns, e, lower, upper):
    """Move q by a damped step for the error e; joints that would go beyond a limit stop there, and once the others make
    up for them."""
    for last in (False, True):
        _, L, _, inverses = factor(gram(columns, (DAMPING, DAMPING, DAMPING, DAMPING, DAMPING, DAMPING)))
        y = substitute(L, inverses, e)
        stopped = False
        for i in range(len(q)):
            move = _along(columns, i, y)
            if not last and (q[i] + move < lower[i] or q[i] + move > upper[i]):
                stopped = True
                end = lower[i] if move < 0.0 else upper[i]
                move, q[i] = end - q[i], end
                e = (e[0] - move * columns[i, 0], e[1] - move * columns[i, 1], e[2] - move * columns[i, 2],
                     e[3] - move * columns[i, 3], e[4] - move * columns[i, 4], e[5] - move * columns[i, 5])  # fmt: skip
                for r in range(6):
                    columns[i, r] = 0.0
        if last or not stopped:
            for i in range(len(q)):
                q[i] = min(max(q[i] + _along(columns, i, y), lower[i]), upper[i])
            break


@inlined
def _along(columns, i, y):
    """Return the step of joint i, column i of J times y."""
    move = columns[i, 0] * y[0] + columns[i, 1] * y[1] + columns[i, 2] * y[2]
    move += columns[i, 3] * y[3] + columns[i, 4] * y[4] + columns[i, 5] * y[5]
    return min(max(move, -LONGEST), LONGEST)
