"""A descent for two tasks in strict order: the demanded rows are held, the wished ones come as near as that allows."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.descent.descent import CLOCK_EVERY
from ros_ik_pkg.ik.descent.ordered_step import LONGEST_STEP, solve_rows_of, step_in_order
from ros_ik_pkg.ik.descent.recorder import record, record_step
from ros_ik_pkg.ik.kernel.clock import passed
from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kernel.linalg import ROWS, fill
from ros_ik_pkg.ik.kinematics.forward import fill_columns, walk
from ros_ik_pkg.ik.kinematics.pose_error import twist_error
from ros_ik_pkg.ik.kinematics.task import AIM, apart, shape_rows, turn_into_axes

SETTLED = 1e-3  # part of the square of the wished error that the last step may promise to take away
NEAR = 3e-2  # m + rad of the task: from there on joints at a limit stay there until they are wanted elsewhere
WIDER, NARROWER, FALLEN = 2.0, 0.3, 0.9  # factors on the longest step in the null space, while the task's error falls
LEAST_SQUARES = 1e-4  # added to J J^T for the multipliers, over its largest diagonal element
HALF, PATIENCE = 0.5, 5  # the error of the task falls by this factor within so many steps, or the descent is given up


@inlined
def descend_in_order(geometry, task, wish, tuning, cap, most, stop_time, attempt, work, recorder):
    """Descend from work.q; return (whether the task is held, steps, norm of the weighted wished error).

    At most `most` steps. It is given up once the wish is not going to get below `cap`, a norm.
    """
    k, settled, radius, before, mark, mark_step = 0, False, LONGEST_STEP, math.inf, math.inf, 0
    fill(work.near, math.nan)
    fill(work.rhs, 0.0)
    while True:
        R, p = walk(geometry, work.q, work.joints)
        position_error, orientation_error, far, near, norm = measure_in_order(task, wish, R, p, work)
        held = position_error <= tuning.position_tolerance and orientation_error <= tuning.orientation_tolerance
        settled = settled or (far <= tuning.position_tolerance and near <= tuning.orientation_tolerance)
        recording = recorder is not None and len(recorder.rows) > 0
        if recording or not ((settled and held) or k >= most):
            fill_both(geometry, task, wish, R, p, work)
        if recorder is not None and recording:
            whole = math.sqrt(position_error * position_error + orientation_error * orientation_error + norm * norm)
            position, orientation = math.hypot(position_error, far), math.hypot(orientation_error, near)
            record(recorder, geometry, attempt, k, position, orientation, whole, p, work)
        late = k % CLOCK_EVERY == CLOCK_EVERY - 1 and passed(stop_time, work.clock)
        if (settled and held) or k >= most or not norm < math.inf or late:
            break
        error = position_error + orientation_error
        radius = min(LONGEST_STEP, WIDER * radius) if held or error < FALLEN * before else NARROWER * radius
        before = error
        if not error < NEAR:
            fill(work.near, math.nan)
        estimate_multipliers(wish, work)
        gain, promised, released = step_in_order(geometry, tuning, wish, radius, work)
        settled = promised < SETTLED * norm * norm and not released
        if error < NEAR and not released and norm * norm - gain > cap * cap:
            break
        if held or error < HALF * mark:
            mark, mark_step = error, k
        elif k - mark_step >= PATIENCE:
            break
        for i in range(len(work.q)):
            q = work.q[i] + work.dq[i]
            if tuning.respect_limits > 0.0:
                q = min(max(q, geometry.lower[i]), geometry.upper[i])
            work.dq[i] = q - work.q[i]
            work.q[i] = q
        if recorder is not None and recording:
            record_step(recorder, 0.0, work.dq)
        k += 1
    return held, k, norm


@inlined
def measure_in_order(task, wish, R, p, work):
    """Write the error and the weights of all rows at the pose (R, p) to the workspace; return the norms of the task's
    two halves [m, rad], of the wish's two halves, and of the weighted wish."""
    e = work.e
    e[0], e[1], e[2], e[3], e[4], e[5] = twist_error(task.R, task.p, R, p)
    turn_into_axes(task, e)
    held_position, held_orientation, position, orientation, norm = 0.0, 0.0, 0.0, 0.0, 0.0
    for r in range(ROWS):
        size, bound = abs(e[r]), task.tolerances[r]
        excess = max(0.0, size - bound) if size == size else size
        wished = wish.task.weights[r] > 0.0
        square = excess * excess if wished or task.weights[r] > 0.0 else 0.0
        if wished:
            work.weights[r] = 0.0
            e[r] = wish.task.weights[r] * math.copysign(excess, e[r])
            norm += e[r] * e[r]
            if r < 3:
                position += square
            else:
                orientation += square
        else:
            work.weights[r] = 0.0 if bound > 0.0 and excess == 0.0 else task.weights[r]
            e[r] = work.weights[r] * math.copysign(excess + AIM * bound, e[r])
            if r < 3:
                held_position += square
            else:
                held_orientation += square
    return (
        math.sqrt(held_position), math.sqrt(held_orientation), math.sqrt(position), math.sqrt(orientation),
        math.sqrt(norm),
    )  # fmt: skip


@inlined
def fill_both(geometry, task, wish, R, p, work):
    """Write the Jacobians by columns: that of the task to work.columns, that of the wish to wish.columns, and to
    work.trial that of all rows in the task's axes, without weights."""
    fill_columns(geometry, work.joints.axes, p, work.trial)
    by_logarithm = apart(task) or apart(wish.task)
    for i in range(len(work.trial)):
        if by_logarithm:
            for r in range(ROWS):
                work.columns[i, r] = wish.columns[i, r] = work.trial[i, r]
        turn_into_axes(task, work.trial[i])
        if not by_logarithm:
            for r in range(ROWS):
                work.columns[i, r] = work.weights[r] * work.trial[i, r]
                wish.columns[i, r] = wish.task.weights[r] * work.trial[i, r]
    if by_logarithm:
        shape_rows(task, R, work.weights, work.columns)
        shape_rows(wish.task, R, wish.task.weights, wish.columns)


@inlined
def estimate_multipliers(wish, work):
    """Write the Lagrange multipliers of least squares, J J^T y = -J b as in ordered_step.py over the joints that are
    not held at a limit, times the weights of their rows to work.rhs.

    Those of the last step are far off if it was cut short, and grow without bound if the joints at limits leave a row
    that cannot be mended. Without good ones a descent runs away where the constraint bends most: at a stretched elbow,
    where many optima are.
    """
    b, columns, weights, rhs, S, held = work.null, work.columns, work.weights, work.rhs, work.A, work.near
    for i in range(len(b)):
        b[i] = 0.0
        for r in range(ROWS):
            b[i] += wish.columns[i, r] * work.e[r]
    largest = 0.0
    for r in range(ROWS):
        rhs[r], work.sigma[r] = 0.0, 0.0
        if weights[r] > 0.0:
            for i in range(len(b)):
                if held[i] != held[i]:
                    rhs[r] -= columns[i, r] * b[i]
            for s in range(r + 1):
                S[r, s] = 0.0
                for i in range(len(b)):
                    if held[i] != held[i]:
                        S[r, s] += columns[i, r] * columns[i, s]
            largest = max(largest, S[r, r])
    solve_rows_of(weights, S, LEAST_SQUARES * largest, rhs, work.sigma)
    for r in range(ROWS):
        rhs[r] *= weights[r]
