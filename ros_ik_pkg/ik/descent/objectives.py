"""Secondary objectives for redundant joints: the cost of a configuration, its gradient and its curvature."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.collision.proximity import proximity
from ros_ik_pkg.ik.kernel.compiled import kernel
from ros_ik_pkg.ik.kernel.linalg import factor, gram
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.kinematics.forward import fill_columns, walk
from ros_ik_pkg.ik.kinematics.task import shape_columns
from ros_ik_pkg.ik.step.methods import diagonal

NONE, POSTURE, LIMITS, MANIPULABILITY, CLEARANCE = range(5)
SMALL = 1e-5  # rad or m, for first differences
WIDE = 1e-3  # rad or m, for second differences
TURN = 2.0 * math.pi


@kernel
def cost(geometry, task, kind, preferences, work):
    """Return the cost of work.q, which self-motion minimises within the null space of the task.

    posture: half the square of the distance from the posture; limits: half the sum of squares of the distances from
    the middle of each range, over half the range; manipulability: -log of it (Yoshikawa 1985) in the task's rows;
    clearance: see `collision.proximity`.
    """
    if kind == CLEARANCE:
        nothing = shaped(work.q, 0, (0,))
        return proximity(preferences.obstruction, work.q, nothing, nothing)[0]
    if kind == MANIPULABILITY:
        return -log_manipulability(geometry, task, work)
    total = 0.0
    for i in range(len(work.q)):
        gap = gap_of(geometry, kind, preferences.posture, work.q, i)
        total += 0.5 * stiffness(geometry, kind, i) * gap * gap
    return total


@kernel
def downhill(geometry, task, kind, preferences, work):
    """Write the negative gradient of the cost at work.q to work.null."""
    if kind == CLEARANCE:
        proximity(preferences.obstruction, work.q, shaped(work.q, 0, (0,)), work.null)
        return
    for i in range(len(work.q)):
        if kind == MANIPULABILITY:
            q = work.q[i]
            work.q[i] = q + SMALL
            ahead = log_manipulability(geometry, task, work)
            work.q[i] = q - SMALL
            behind = log_manipulability(geometry, task, work)
            work.q[i] = q
            slope = (ahead - behind) / (2.0 * SMALL)
            work.null[i] = slope if abs(slope) < math.inf else 0.0
        else:
            work.null[i] = stiffness(geometry, kind, i) * gap_of(geometry, kind, preferences.posture, work.q, i)


@kernel
def curvature(geometry, task, kind, preferences, largest, work):
    """Return d^T H d for the direction d in work.null, its largest component given, and the Hessian H of the cost."""
    if kind == CLEARANCE:
        return proximity(preferences.obstruction, work.q, work.null, shaped(work.q, 0, (0,)))[1]
    if kind == MANIPULABILITY:
        step = WIDE / largest
        middle = log_manipulability(geometry, task, work)
        shift(work.q, step, work.null)
        ahead = log_manipulability(geometry, task, work)
        shift(work.q, -2.0 * step, work.null)
        behind = log_manipulability(geometry, task, work)
        shift(work.q, step, work.null)
        return (2.0 * middle - ahead - behind) / (step * step)
    total = 0.0
    for i in range(len(work.null)):
        total += stiffness(geometry, kind, i) * work.null[i] * work.null[i]
    return total


@kernel
def gap_of(geometry, kind, posture, q, i):
    """Return how far joint i is from where the objective wants it, without whole turns if it may turn round."""
    if kind == POSTURE:
        gap = posture[i] - q[i]
        if geometry.wraps[i]:
            gap -= TURN * math.floor(gap / TURN + 0.5)
        return gap
    middle = 0.5 * (geometry.lower[i] + geometry.upper[i])
    return middle - q[i] if abs(middle) < math.inf else 0.0


@kernel
def stiffness(geometry, kind, i):
    """Return the second derivative of the cost by joint i."""
    if kind == POSTURE:
        return 1.0
    half = 0.5 * (geometry.upper[i] - geometry.lower[i])
    return 1.0 / (half * half) if 0.0 < half < math.inf else 0.0


@kernel
def shift(q, step, direction):
    """Move q along a direction."""
    for i in range(len(q)):
        q[i] += step * direction[i]


@kernel
def log_manipulability(geometry, task, work):
    """Return log sqrt(det(J J^T)) of the task's rows at work.q, or -inf if they are dependent."""
    R, p = walk(geometry, work.q, work.joints)
    fill_columns(geometry, work.joints.axes, p, work.trial)
    shape_columns(task, R, task.weights, work.trial)
    definite, _, pivots, _ = factor(gram(work.trial, diagonal(task.weights, 0.0)))
    if not definite:
        return -math.inf
    total = 0.0
    for pivot in pivots:
        total += 0.5 * math.log(pivot)
    return total
