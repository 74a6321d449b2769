"""The closest approach to a target that no descent reached.

The step rules assume an error that vanishes. If an error remains, they converge slowly or stop a few percent short,
because they neglect the curvature that is multiplied by that error. Levenberg-Marquardt (Marquardt 1963) handles it:
a step that does not reduce the error is taken back and tried again with more damping.
"""

from __future__ import annotations

import math

from ros_ik_pkg.ik.descent.recorder import record, record_step
from ros_ik_pkg.ik.kernel.clock import passed
from ros_ik_pkg.ik.kernel.compiled import kernel
from ros_ik_pkg.ik.kernel.linalg import assign
from ros_ik_pkg.ik.kinematics.task import keep_slack, look, within_tolerances
from ros_ik_pkg.ik.step.limits import freeze_pushed, pushed_outwards
from ros_ik_pkg.ik.step.methods import damped_step, gradient
from ros_ik_pkg.ik.step.weights import scale_columns, take_back_weights, weigh

MOST_STEPS = 200
FIRST_DAMPING = 0.1
LEAST_DAMPING, MOST_DAMPING = 1e-4, 1e3
LESS, MORE = 0.5, 3.0  # factors on the damping after a step that reduced the error, and after one that did not
NO_NEARER = 1e-7  # relative reduction of the error norm below which a step counts as useless
PATIENCE = 10  # useless steps in a row
LONGEST_STEP = 0.5  # rad or m of one joint


@kernel
def approach(geometry, task, tuning, stop_time, attempt, work, recorder):
    """Reduce the error at work.q until it stops falling; return the number of steps."""
    nearest, damping, idle, k = math.inf, FIRST_DAMPING, 0, 0
    while True:
        position_error, orientation_error, norm, p = look(geometry, task, work)
        assign(work.went, work.q)
        if recorder is not None and len(recorder.rows) > 0:
            record(recorder, geometry, attempt, k, position_error, orientation_error, norm, p, work)
        idle = idle + 1 if not norm < (1.0 - NO_NEARER) * nearest else 0
        reached = within_tolerances(position_error, orientation_error, tuning)
        if norm < nearest or reached:
            nearest, damping = norm, max(LESS * damping, LEAST_DAMPING)
            assign(work.near, work.q)
        else:
            damping *= MORE
        spent = idle >= PATIENCE or damping > MOST_DAMPING or k >= MOST_STEPS
        if reached or spent or passed(stop_time, work.clock):
            break
        if norm > nearest:  # take the step back
            assign(work.q, work.near)
            look(geometry, task, work)
        if not step_towards(geometry, task, tuning, damping, work):
            break
        if recorder is not None and len(recorder.rows) > 0:
            for i in range(len(work.q)):
                work.dq[i] = work.q[i] - work.went[i]  # as the rows have it, back and forth
            record_step(recorder, damping, work.dq)
        k += 1
    assign(work.q, work.near)
    return k


@kernel
def step_towards(geometry, task, tuning, damping, work):
    """Take a damped step within the limits, without joints that it would push beyond them; return whether there is
    one."""
    weigh(work)
    weigh_slack(work)
    if tuning.respect_limits > 0.0:
        gradient(work)
        freeze(geometry, work)
    while True:
        if not damped_step(damping, work):
            return False
        again = tuning.respect_limits > 0.0 and freeze(geometry, work)
        if not (keep_slack(task, work) or again):
            break
    take_back_weights(work)
    for i in range(len(work.q)):
        q = work.q[i] + min(max(work.dq[i], -LONGEST_STEP), LONGEST_STEP)
        if tuning.respect_limits > 0.0:
            q = min(max(q, geometry.lower[i]), geometry.upper[i])
        work.q[i] = q
    return True


@kernel
def weigh_slack(work):
    """Weigh the rows of the task's slack, which may become active."""
    if len(work.scales) > 0:
        scale_columns(work.scales, work.trial)


@kernel
def freeze(geometry, work):
    """Take joints at a limit that dq pushes outwards out of the system, and out of the rows of the slack."""
    for i in range(len(work.q)):
        if pushed_outwards(geometry, work, i):
            work.trial[i, :] = 0.0
    return freeze_pushed(geometry, work)
