"""Self-motion: minimises a secondary objective in the null space of a solved task.

The projection onto the null space is exact: the task's rows are made orthonormal (modified Gram-Schmidt, twice), and
their components are removed from the objective's direction. The damped projector
I - J^T (J J^T + lambda^2 I)^-1 J would move the tip wherever the damping acts.
"""

from __future__ import annotations

import math

from ros_ik_pkg.ik.descent.acceptance import ACCEPTED, judge
from ros_ik_pkg.ik.descent.descent import largest_component
from ros_ik_pkg.ik.descent.objectives import CLEARANCE, cost, curvature, downhill
from ros_ik_pkg.ik.descent.recorder import record, record_step
from ros_ik_pkg.ik.kernel.clock import passed
from ros_ik_pkg.ik.kernel.compiled import kernel
from ros_ik_pkg.ik.kernel.linalg import ROWS, assign
from ros_ik_pkg.ik.kinematics.task import look, within_tolerances
from ros_ik_pkg.ik.step.limits import pushed_outwards

MOST_STEPS = 60
MOST_STEPS_OUT = 20  # away from contact
MOST_LOOSE = 6  # steps off the task before the next one only corrects the task
LONGEST_STEP = 0.2  # rad or m of one joint, up to which the linear model of the task holds
ROUNDING = 1e-10  # what the projection leaves of a slope outside the null space, relative to it
SETTLED = 1e-7  # rad or m of the joint that moves most; smaller steps end the motion
LEAST_BEND = 0.2  # lower bound of the curvature along the null space over that of the cost alone
DEPENDENT = 1e-9  # a row is dependent if its remainder after Gram-Schmidt is shorter than this times its length


@kernel
def settle(geometry, task, tuning, preferences, escape, stop_time, attempt, steps, work, recorder):
    """Move work.q, a solution, to the least cost in the null space; return the number of steps.

    The accepted iterate with the least cost is left in work.q, so the cost never rises. No joint moves further than
    null_space_step in total, if that is above 0. With `escape`, work.q touches and moves away from contact, whatever
    null_space says, until the first iterate is accepted.
    """
    least, left, longest, factor = math.inf, tuning.null_space_step, LONGEST_STEP, 0.0
    kind, most_steps = int(tuning.null_space), MOST_STEPS
    if escape:
        kind, most_steps = CLEARANCE, MOST_STEPS_OUT
    if escape or left <= 0.0:
        left = math.inf
    k, held, accepted = 0, 0, False
    while True:
        value = cost(geometry, task, kind, preferences, work)
        downhill(geometry, task, kind, preferences, work)
        position_error, orientation_error, norm, p = look(geometry, task, work)
        if len(recorder.rows) > 0 and k > 0:
            record(recorder, geometry, attempt, steps + k, position_error, orientation_error, norm, p, work)
        held_now = within_tolerances(position_error, orientation_error, tuning)
        if held_now:
            held = k
            verdict = judge(tuning, preferences, position_error, orientation_error, work.q)
            if k == 0 or (verdict == ACCEPTED and (value < least or not accepted)):
                least, accepted = value, verdict == ACCEPTED
                assign(work.near, work.q)
            else:
                longest *= 0.5
        if k >= most_steps or (escape and accepted) or not norm < math.inf or passed(stop_time, work.clock):
            break
        most = min(longest, left) if k - held < MOST_LOOSE else 0.0
        length, factor = null_step(geometry, task, tuning, kind, preferences, most, factor, work)
        if held_now and not length > SETTLED:
            break
        left -= length
        move(geometry, tuning, work)
        if len(recorder.rows) > 0:
            record_step(recorder, 0.0, work.dq)
        k += 1
    assign(work.q, work.near)
    return k


@kernel
def null_step(geometry, task, tuning, kind, preferences, longest, before, work):
    """Write to work.dq a step that corrects the task's error and moves along work.null in the null space.

    Returns the largest joint motion of the second part, and the ratio of that part to the slope; `before` is the ratio
    of the last step. Joints at a limit that would be pushed outwards are left out.
    """
    while True:
        rank = orthonormal_rows(work)
        mend(rank, work)
        steep = largest_component(work.null)
        project(work.W, rank, work.null)
        if not largest_component(work.null) > ROUNDING * steep:
            work.null[:] = 0.0
        length, factor = 0.0, 0.0
        if rank < len(work.dq):
            length, factor = scale(geometry, task, kind, preferences, longest, before, work)
        for i in range(len(work.dq)):
            work.dq[i] += factor * work.null[i]
        if not (tuning.respect_limits > 0.0 and leave_out_pushed(geometry, work)):
            for i in range(len(work.dq)):
                work.went[i] = factor * work.null[i]
            return length, factor


@kernel
def orthonormal_rows(work):
    """Write an orthonormal basis of the task's rows to work.W; return its rank.

    work.A and work.y receive the triangular system A y = e of the step in that basis. Dependent rows are left out.
    """
    columns, W, L, y = work.columns, work.W, work.A, work.y
    n, rank = len(columns), 0
    for r in range(ROWS):
        before = 0.0
        for i in range(n):
            W[rank, i] = columns[i, r]
            before += columns[i, r] * columns[i, r]
        for k in range(rank):
            L[rank, k] = 0.0
        for _ in range(2):  # the second pass removes the rounding errors of the first
            for k in range(rank):
                L[rank, k] += remove(W[k], W[rank])
        after = 0.0
        for i in range(n):
            after += W[rank, i] * W[rank, i]
        if not after > DEPENDENT * DEPENDENT * before:
            continue
        length = math.sqrt(after)
        s = work.e[r]
        for k in range(rank):
            s -= L[rank, k] * y[k]
        y[rank] = s / length
        for i in range(n):
            W[rank, i] /= length
        rank += 1
        if rank == n:
            break
    return rank


@kernel
def remove(unit, vector):
    """Subtract the component along a unit vector from a vector; return that component."""
    along = 0.0
    for i in range(len(unit)):
        along += unit[i] * vector[i]
    for i in range(len(unit)):
        vector[i] -= along * unit[i]
    return along


@kernel
def mend(rank, work):
    """Write to work.dq the shortest step that corrects the task's error, scaled down to LONGEST_STEP per joint."""
    largest = 0.0
    for i in range(len(work.dq)):
        s = 0.0
        for k in range(rank):
            s += work.y[k] * work.W[k, i]
        work.dq[i] = s
        largest = max(largest, abs(s))
    if largest > LONGEST_STEP:
        for i in range(len(work.dq)):
            work.dq[i] *= LONGEST_STEP / largest


@kernel
def project(basis, rank, vector):
    """Project a vector onto the orthogonal complement of the first `rank` rows of an orthonormal basis."""
    for _ in range(2):
        for k in range(rank):
            remove(basis[k], vector)


@kernel
def scale(geometry, task, kind, preferences, longest, before, work):
    """Return the step along the slope in work.null to the least cost, at most `longest` for each joint: the largest
    joint motion, and its ratio to the slope.

    The curvature is that of the cost and of the null space; the slope after the last step shows it (secant).
    """
    square, largest, along, length = 0.0, 0.0, 0.0, 0.0
    for i in range(len(work.null)):
        square += work.null[i] * work.null[i]
        along += work.null[i] * work.went[i]
        length += work.went[i] * work.went[i]
        largest = max(largest, abs(work.null[i]))
    if not largest > 0.0:
        return 0.0, 0.0
    bend = curvature(geometry, task, kind, preferences, largest, work) / square
    if before > 0.0 and length > 0.0:
        bend = max(1.0 / before - along / length, LEAST_BEND * bend)
    factor = longest / largest
    if bend > 0.0:
        factor = min(factor, 1.0 / bend)
    return factor * largest, factor


@kernel
def leave_out_pushed(geometry, work):
    """Take joints at a limit that the step pushes outwards out of the system and out of work.null; return whether
    there were any."""
    some = False
    for i in range(len(work.q)):
        if pushed_outwards(geometry, work, i):
            work.columns[i, :] = 0.0
            work.null[i] = 0.0
            some = True
    return some


@kernel
def move(geometry, tuning, work):
    """Take the step in work.dq up to where the first joint meets a limit."""
    fraction = 1.0
    if tuning.respect_limits > 0.0:
        for i in range(len(work.q)):
            room = (geometry.upper[i] if work.dq[i] > 0.0 else geometry.lower[i]) - work.q[i]
            if abs(work.dq[i]) > abs(room):
                fraction = min(fraction, abs(room / work.dq[i]))
    for i in range(len(work.q)):
        work.dq[i] *= fraction
        q = work.q[i] + work.dq[i]
        if tuning.respect_limits > 0.0:
            q = min(max(q, geometry.lower[i]), geometry.upper[i])
        work.q[i] = q
