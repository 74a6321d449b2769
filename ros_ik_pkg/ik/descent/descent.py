"""One descent from one seed: the iteration of the notes, with joint limits and stop reasons."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.descent.recorder import record, record_step
from ros_ik_pkg.ik.kernel.clock import passed
from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.linalg import assign
from ros_ik_pkg.ik.kinematics.task import look_around, look_at_error, within_tolerances
from ros_ik_pkg.ik.solution import Status
from ros_ik_pkg.ik.step.limits import step_within_limits

CONVERGED = int(Status.CONVERGED)
MAX_ITERATIONS = int(Status.MAX_ITERATIONS)
STALLED = int(Status.STALLED)
OSCILLATING = int(Status.OSCILLATING)
DIVERGED = int(Status.DIVERGED)
NOT_FINITE = int(Status.NOT_FINITE)
DEADLINE = int(Status.DEADLINE)

PAUSED = -1  # not a stop reason: the search decides whether to go on
FAR = 0.2  # error norm above which another start may be nearer
FREE_STEP = 50.0  # rad or m; a larger step of one joint is eight turns, far beyond the linear model
LINEAR_STEP = 0.5  # rad or m; a start within tolerance is not refined by longer steps
ROUNDING = 1e-13  # error norm; less is rounding
CLOCK_EVERY = 16  # iterations between looks at the clock


@inlined
def descend(geometry, task, tuning, cap, patience, progress, stop_time, attempt, first, pause, work, recorder):
    """Descend from work.q; return (status, steps, position error [m], orientation error [rad], norm, nearest).

    The figures are those of work.q at the end. work.near receives the iterate with the smallest error norm, which is
    `nearest`. `cap` is the longest step of a joint [rad or m]. The descent is abandoned if the error norm does not
    fall below `progress` times its mark within `patience` steps. At iterate `pause` it returns PAUSED if the error
    is still FAR; called again with `first` = `pause`, it continues.

    A start within tolerance is refined by one step, so that targets which move by less than the tolerance are
    followed. A step that does not bring the tip nearer is taken back.
    """
    last = int(tuning.max_iterations)
    mark, mark_step, previous, rises, nearest = math.inf, 0, math.inf, 0, math.inf
    refining = False
    k = first
    while True:
        position_error, orientation_error, norm, R, p = look_at_error(geometry, task, work)
        arrived = within_tolerances(position_error, orientation_error, tuning)
        recording = recorder is not None and len(recorder.rows) > 0
        refine = arrived and k == 0 and last > 0 and norm > ROUNDING
        if recording or refine or not arrived:
            look_around(geometry, task, R, p, work)
        if recorder is not None and recording and (k > first or k == 0):
            record(recorder, geometry, attempt, k, position_error, orientation_error, norm, p, work)
        if refining and k == 1 and not (arrived and norm < nearest):
            take_back(work)
            if recorder is not None and recording:
                record_step(recorder, 0.0, work.dq)
            k += 1
            continue
        if norm < nearest or k == first:
            nearest = norm
            assign(work.near, work.q)
        if not norm < math.inf:
            return NOT_FINITE, k, position_error, orientation_error, norm, nearest
        if arrived and not refine:
            return CONVERGED, k, position_error, orientation_error, norm, nearest
        if k == last:
            return MAX_ITERATIONS, k, position_error, orientation_error, norm, nearest
        if k == pause and norm > FAR:
            return PAUSED, k, position_error, orientation_error, norm, nearest
        rises += norm > previous
        previous = norm
        if norm < progress * mark:
            mark, mark_step, rises = norm, k, 0
        elif k - mark_step >= patience:
            reason = why_no_progress(norm, mark, rises, patience)
            return reason, k, position_error, orientation_error, norm, nearest
        if k % CLOCK_EVERY == CLOCK_EVERY - 1 and passed(stop_time, work.clock):
            return DEADLINE, k, position_error, orientation_error, norm, nearest
        damping = step_within_limits(geometry, tuning, norm, work)
        largest = largest_component(work.dq)
        if refine and not largest < LINEAR_STEP:
            return CONVERGED, k, position_error, orientation_error, norm, nearest
        refining = refine
        if not largest < math.inf:
            return NOT_FINITE, k, position_error, orientation_error, norm, nearest
        if largest > FREE_STEP and cap > FREE_STEP:
            return DIVERGED, k, position_error, orientation_error, norm, nearest
        update(geometry, tuning, cap, work)
        if recorder is not None and recording:
            record_step(recorder, damping, work.dq)
        k += 1


@inlined
def take_back(work):
    """Return to the nearest iterate; dq becomes the step back to it."""
    for i in range(len(work.q)):
        work.dq[i] = work.near[i] - work.q[i]
        work.q[i] = work.near[i]


@inlined
def largest_component(dq):
    """Return max |dq_i|, or a non-finite value if any component is NaN or infinite."""
    largest, total = 0.0, 0.0
    for i in range(len(dq)):
        largest = max(largest, abs(dq[i]))
        total += abs(dq[i])
    return largest if total < math.inf else total


@inlined
def update(geometry, tuning, cap, work):
    """q <- q + step_size * dq with each joint's step capped, and then kept within the limits; dq becomes the step."""
    for i in range(len(work.q)):
        step = min(max(tuning.step_size * work.dq[i], -cap), cap)
        q = work.q[i] + step
        if tuning.respect_limits > 0.0:
            q = min(max(q, geometry.lower[i]), geometry.upper[i])
        work.dq[i] = q - work.q[i]
        work.q[i] = q


@kernel
def why_no_progress(norm, mark, rises, patience):
    """Return whether a descent diverged, oscillated or stalled, judged by the errors since the last progress."""
    if norm > 2.0 * mark:
        return DIVERGED
    if 3 * rises >= patience:
        return OSCILLATING
    return STALLED
