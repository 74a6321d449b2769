"""The error of a task: its rows in its axes, beyond their tolerances, weighted; and their Jacobian."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.data_layout import Task
from ros_ik_pkg.ik.kernel.linalg import ROWS
from ros_ik_pkg.ik.kinematics.forward import fill_columns, walk
from ros_ik_pkg.ik.kinematics.pose_error import twist_error

AIM = 0.5  # share of a tolerance to which a step reduces an error beyond it
EDGE = 0.9  # share of a slack up to which a step may lead that would otherwise leave it


@inlined
def make_task(T, weights, tolerances, in_tip_axes):
    """Return the task of reaching the pose T (4, 4)."""
    R = (T[0, 0], T[0, 1], T[0, 2], T[1, 0], T[1, 1], T[1, 2], T[2, 0], T[2, 1], T[2, 2])
    plain = 1.0
    for r in range(ROWS):
        if weights[r] != 1.0 or tolerances[r] > 0.0:
            plain = 0.0
    return Task(R, (T[0, 3], T[1, 3], T[2, 3]), weights, tolerances, in_tip_axes, plain, 0.0, 0.0)


@inlined
def with_weights(task, weights):
    """Return the task with other weights (6,) of its rows."""
    return Task(task.R, task.p, weights, task.tolerances, task.in_tip_axes, 0.0, 0.0, 0.0)


@inlined
def with_slack(task, position_slack, orientation_slack):
    """Return the task of coming within these distances [m, rad] of the pose."""
    return Task(
        task.R, task.p, task.weights, task.tolerances, task.in_tip_axes, 0.0, position_slack, orientation_slack
    )


@inlined
def tolerated_norm(task, tuning):
    """Return the largest norm of a weighted error that is within both tolerances."""
    w = task.weights
    position = max(w[0], w[1], w[2]) * tuning.position_tolerance
    orientation = max(w[3], w[4], w[5]) * tuning.orientation_tolerance
    return math.sqrt(position * position + orientation * orientation)


@inlined
def look(geometry, task, work):
    """Write the error at work.q and the task's Jacobian there to the workspace; return the norms of the error's two
    halves [m, rad], the norm of the weighted whole, and the position of the tip [m]."""
    position_error, orientation_error, norm, R, p = look_at_error(geometry, task, work)
    look_around(geometry, task, R, p, work)
    return position_error, orientation_error, norm, p


@inlined
def look_at_error(geometry, task, work):
    """Do the first half of `look`, the error; return also rotation and position of the tip."""
    R, p = walk(geometry, work.q, work.joints)
    position_error, orientation_error, norm = measure(task, R, p, work)
    return position_error, orientation_error, norm, R, p


@inlined
def look_around(geometry, task, R, p, work):
    """Do the second half of `look`, the Jacobian; the tip is at (R, p)."""
    fill_columns(geometry, work.joints.axes, p, work.columns)
    shape_columns(task, R, work.weights, work.columns)
    if task.position_slack > 0.0:
        ease_rows(0, task.position_slack, task.position_slack > task.orientation_slack, work)
    if task.orientation_slack > 0.0:
        ease_rows(3, task.orientation_slack, task.orientation_slack > task.position_slack, work)


@inlined
def within_tolerances(position_error, orientation_error, tuning):
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
    """Implement `measure` for a task with weights or tolerances of single rows; work.e holds the twist error."""
    turn_into_axes(task, work.e)
    position, orientation, weighted_position, weighted_orientation = 0.0, 0.0, 0.0, 0.0
    for r in range(ROWS):
        size, bound, weight = abs(work.e[r]), task.tolerances[r], task.weights[r]
        excess = max(0.0, size - bound) if size == size else size
        # A row within its tolerance is free and leaves the system.
        work.weights[r] = 0.0 if bound > 0.0 and excess == 0.0 else weight
        work.e[r] = work.weights[r] * math.copysign(excess + AIM * bound, work.e[r])
        weighted = weight * weight * excess * excess
        if r < 3:
            position += excess * excess if weight > 0.0 else 0.0
            weighted_position += weighted
        else:
            orientation += excess * excess if weight > 0.0 else 0.0
            weighted_orientation += weighted
    position, orientation = math.sqrt(position), math.sqrt(orientation)
    a, b = beyond(position, task.position_slack), beyond(orientation, task.orientation_slack)
    return position, orientation, math.sqrt(a * a * weighted_position + b * b * weighted_orientation)


@inlined
def beyond(length, slack):
    """Return the fraction of a length that is beyond the slack, 0 to 1."""
    return 1.0 if slack <= 0.0 else 0.0 if length <= slack else 1.0 - slack / length


@kernel
def ease_rows(first, slack, looser, work):
    """Apply the slack to one half of the error, from row `first` on.

    Within the slack its rows leave the system. One row, the length of the error, is kept in work.trial and work.y;
    `keep_slack` adds it to the system if a step would leave the slack. Beyond the slack, a step reduces the length to
    AIM of the slack, by that row alone if the half is the `looser` one.
    """
    square, plain = 0.0, 0.0
    for r in range(first, first + 3):
        square += work.e[r] * work.e[r]
        plain += (work.e[r] / work.weights[r]) ** 2 if work.weights[r] > 0.0 else 0.0
    length, inside = math.sqrt(square), math.sqrt(plain) <= slack
    if plain > 0.0:
        slack *= math.sqrt(square / plain)
    per_length = 1.0 / length if length > 0.0 else 0.0
    x, y, z = work.e[first] * per_length, work.e[first + 1] * per_length, work.e[first + 2] * per_length
    if not (inside or looser):
        work.y[first + 1] = -math.inf
        for r in range(first, first + 3):
            work.e[r] *= 1.0 - (1.0 - AIM) * slack * per_length
        return
    for i in range(len(work.columns)):
        column = work.columns[i]
        work.trial[i, first] = x * column[first] + y * column[first + 1] + z * column[first + 2]
        column[first] = column[first + 1] = column[first + 2] = 0.0
    for r in range(first, first + 3):
        work.e[r], work.weights[r] = 0.0, 0.0
    work.y[first], work.y[first + 1] = length - AIM * slack, -math.inf
    if inside:
        work.y[first], work.y[first + 1] = length - EDGE * slack, length - slack
    else:
        take_row(first, work)


@kernel
def take_row(first, work):
    """Add the row that ease_rows made to the system."""
    for i in range(len(work.columns)):
        work.columns[i, first] = work.trial[i, first]
    work.e[first], work.weights[first], work.y[first + 1] = work.y[first], 1.0, -math.inf


@kernel
def keep_slack(task, work):
    """Add the halves of the error to the system that the step dq would bring out of their slack; return whether there
    are any."""
    some = False
    for first in (0, 3):
        if (task.position_slack if first == 0 else task.orientation_slack) > 0.0:
            shorter = 0.0
            for i in range(len(work.dq)):
                shorter += work.trial[i, first] * work.dq[i]
            if shorter < work.y[first + 1]:
                take_row(first, work)
                some = True
    return some


@kernel
def turn_into_axes(task, vector):
    """Turn both halves of a vector (6,) from base axes into the axes of the task: those of the target, or of the base
    frame. A rotation error has the same components in the axes of the target and of the present tip frame."""
    if task.in_tip_axes == 0.0:
        return
    R = task.R
    for half in (0, 3):
        x, y, z = vector[half], vector[half + 1], vector[half + 2]
        for i in range(3):
            vector[half + i] = R[i] * x + R[3 + i] * y + R[6 + i] * z


@inlined
def shape_columns(task, R, weights, columns):
    """Turn a Jacobian by columns (n, 6) into that of the weighted rows of the task; R is the rotation of the tip."""
    if not task.plain:
        shape_rows(task, R, weights, columns)


@kernel
def shape_rows(task, R, weights, columns):
    """Implement `shape_columns`.

    If the orientation rows have different weights, their Jacobian is the derivative of phi = log(R* R^T):
    d phi = -(w + phi x w / 2 + c phi x (phi x w)) dt, c = 1 / |phi|^2 - (1 + cos|phi|) / (2 |phi| sin|phi|)
    (Chirikjian 2011, inverse right Jacobian of SO(3)). With equal weights the step is the same without it, because
    this matrix maps phi to itself.
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
    """Return whether the orientation rows have different weights."""
    w, bound = task.weights, task.tolerances
    return w[3] != w[4] or w[4] != w[5] or bound[3] + bound[4] + bound[5] > 0.0
