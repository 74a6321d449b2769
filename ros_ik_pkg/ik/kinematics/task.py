"""What counts as error: the rows of the task in its axes, beyond their tolerances, weighted; and their Jacobian."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.data_layout import Task
from ros_ik_pkg.ik.kernel.linalg import ROWS
from ros_ik_pkg.ik.kinematics.forward import fill_columns, walk
from ros_ik_pkg.ik.kinematics.pose_error import twist_error

AIM = 0.5  # of a tolerance: an error beyond it is brought to the middle between its bound and zero


@inlined
def make_task(T, weights, tolerances, in_tip_axes):
    """Return the task of reaching the pose T (4, 4)."""
    R = (T[0, 0], T[0, 1], T[0, 2], T[1, 0], T[1, 1], T[1, 2], T[2, 0], T[2, 1], T[2, 2])
    plain = 1.0
    for r in range(ROWS):
        if weights[r] != 1.0 or tolerances[r] > 0.0:
            plain = 0.0
    return Task(R, (T[0, 3], T[1, 3], T[2, 3]), weights, tolerances, in_tip_axes, plain)


@inlined
def look(geometry, task, work):
    """Write the error at work.q and the task's Jacobian there to the workspace; return the norms of the error's two
    halves [m, rad], the norm of the weighted whole, and the position of the tip [m]."""
    position_error, orientation_error, norm, R, p = look_at_error(geometry, task, work)
    look_around(geometry, task, R, p, work)
    return position_error, orientation_error, norm, p


@inlined
def look_at_error(geometry, task, work):
    """Do the first half of `look`; return rotation and position of the tip too."""
    R, p = walk(geometry, work.q, work.joints)
    position_error, orientation_error, norm = measure(task, R, p, work)
    return position_error, orientation_error, norm, R, p


@inlined
def look_around(geometry, task, R, p, work):
    """Do the second half of `look`: the Jacobian where the tip is at (R, p)."""
    fill_columns(geometry, work.joints.axes, p, work.columns)
    shape_columns(task, R, work.weights, work.columns)


@inlined
def holds(position_error, orientation_error, tuning):
    """Return whether both errors are within tolerance."""
    return position_error <= tuning.position_tolerance and orientation_error <= tuning.orientation_tolerance


@inlined
def measure(task, R, p, work):
    """Write the error and the weights of its rows at the pose (R, p) to the workspace; return the norms of its two
    halves [m, rad] over the rows of the task, and the norm of the weighted whole."""
    x, y, z, rx, ry, rz = twist_error(task.R, task.p, R, p)
    work.e[0], work.e[1], work.e[2], work.e[3], work.e[4], work.e[5] = x, y, z, rx, ry, rz
    if task.plain:
        position, orientation = x * x + y * y + z * z, rx * rx + ry * ry + rz * rz
        return math.sqrt(position), math.sqrt(orientation), math.sqrt(position + orientation)
    return measure_rows(task, work)


@kernel
def measure_rows(task, work):
    """Do what `measure` says for a task whose rows do not all count alike; work.e holds the twist error."""
    turn_into_axes(task, work.e)
    position, orientation, total = 0.0, 0.0, 0.0
    for r in range(ROWS):
        size, bound, weight = abs(work.e[r]), task.tolerances[r], task.weights[r]
        beyond = max(0.0, size - bound) if size == size else size
        # Within its tolerance a row is free, and leaves the system.
        work.weights[r] = 0.0 if bound > 0.0 and beyond == 0.0 else weight
        work.e[r] = work.weights[r] * math.copysign(beyond + AIM * bound, work.e[r])
        total += weight * weight * beyond * beyond
        if weight > 0.0 and r < 3:
            position += beyond * beyond
        elif weight > 0.0:
            orientation += beyond * beyond
    return math.sqrt(position), math.sqrt(orientation), math.sqrt(total)


@kernel
def turn_into_axes(task, vector):
    """Turn both halves of a vector (6,) from base axes into those of the task: the tip frame's at the target, if
    not the base frame's. A rotation error has the same components in the tip frame as it is."""
    if task.in_tip_axes == 0.0:
        return
    R = task.R
    for half in (0, 3):
        x, y, z = vector[half], vector[half + 1], vector[half + 2]
        for i in range(3):
            vector[half + i] = R[i] * x + R[3 + i] * y + R[6 + i] * z


@inlined
def shape_columns(task, R, weights, columns):
    """Make a Jacobian by columns (n, 6) that of the task's rows at these weights; R is the rotation of the tip."""
    if not task.plain:
        shape_rows(task, R, weights, columns)


@kernel
def shape_rows(task, R, weights, columns):
    """Do what `shape_columns` says.

    Where orientation rows are weighed apart, theirs is the derivative of the logarithm: with phi = log(R* R^T),
    d phi = -(w + phi x w / 2 + c phi x (phi x w)) dt, c = 1 / |phi|^2 - (1 + cos|phi|) / (2 |phi| sin|phi|)
    (Chirikjian 2011, inverse right Jacobian of SO(3)). Where all count alike the step is the same without it, for
    that matrix leaves phi as it is.
    """
    _, _, _, x, y, z = twist_error(task.R, task.p, R, task.p)
    c, weighed_apart = log_curvature(x * x + y * y + z * z), apart(task)
    for i in range(len(columns)):
        column = columns[i]
        if weighed_apart:
            wx, wy, wz = column[3], column[4], column[5]
            ax, ay, az = y * wz - z * wy, z * wx - x * wz, x * wy - y * wx
            column[3] += 0.5 * ax + c * (y * az - z * ay)
            column[4] += 0.5 * ay + c * (z * ax - x * az)
            column[5] += 0.5 * az + c * (x * ay - y * ax)
        turn_into_axes(task, column)
        for r in range(ROWS):
            column[r] *= weights[r]


@kernel
def log_curvature(square):
    """Return c of `shape_rows` for an angle from 0 to pi, given its square."""
    if square < 1e-4:
        return 1.0 / 12.0 + square / 720.0
    half = 0.5 * math.sqrt(square)
    return (1.0 - half * math.cos(half) / math.sin(half)) / square


@kernel
def apart(task):
    """Return whether the orientation rows are not all weighed alike."""
    w, bound = task.weights, task.tolerances
    return w[3] != w[4] or w[4] != w[5] or bound[3] + bound[4] + bound[5] > 0.0
