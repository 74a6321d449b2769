"""Joint limits: the active set of a step, clipping, and whole turns."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.step.methods import gradient, take_step
from ros_ik_pkg.ik.step.weights import take_back_weights, weigh

TURN = 2.0 * math.pi


@kernel
def clip(geometry, q):
    """Bring every joint that is outside its limits to the nearer one."""
    for i in range(len(q)):
        q[i] = min(max(q[i], geometry.lower[i]), geometry.upper[i])


@kernel
def unwrap(geometry, q, reference):
    """Replace angles that may turn round by their equivalents nearest the reference and within the limits.

    Returns whether any changed.
    """
    changed = False
    for i in range(len(q)):
        if not geometry.wraps[i]:
            continue
        angle = q[i] + TURN * math.floor((reference[i] - q[i]) / TURN + 0.5)
        if angle > geometry.upper[i]:
            angle -= TURN * math.ceil((angle - geometry.upper[i]) / TURN)
        if angle < geometry.lower[i]:
            angle += TURN * math.ceil((geometry.lower[i] - angle) / TURN)
        if angle != q[i] and geometry.lower[i] <= angle <= geometry.upper[i]:
            q[i] = angle
            changed = True
    return changed


@kernel
def bring_inside(arm, q):
    """Bring q within the limits by whole turns, then by clipping; return whether any joint was outside."""
    outside = False
    for i in range(len(q)):
        outside = outside or q[i] < arm.lower[i] or q[i] > arm.upper[i]
    if outside:
        unwrap(arm, q, q)
        clip(arm, q)
    return outside


@kernel
def limits_mask(arm, q):
    """Return a number whose bit i is set if joint i is at a limit."""
    mask = 0
    for i in range(len(q)):
        if q[i] <= arm.lower[i] or q[i] >= arm.upper[i]:
            mask |= 1 << i
    return mask


@kernel
def count_at_limits(geometry, q):
    """Return how many joints are at a limit."""
    count = 0
    for i in range(len(q)):
        count += q[i] <= geometry.lower[i] or q[i] >= geometry.upper[i]
    return count


@inlined
def step_within_limits(geometry, tuning, norm, work):
    """Compute the step that pushes no joint at a limit outwards; return its damping.

    Active set: such joints leave the system (their columns become zero) and the others compensate. The gradient
    J^T e gives the first set; if the step pushes another joint outwards, it is computed again without that joint.
    """
    weigh(work)
    if tuning.respect_limits > 0.0:
        gradient(work)
        freeze_pushed(geometry, work)
    while True:
        damping = take_step(tuning, norm, work)
        if not (tuning.respect_limits > 0.0 and freeze_pushed(geometry, work)):
            take_back_weights(work)
            return damping


@inlined
def freeze_pushed(geometry, work):
    """Take joints at a limit that dq pushes outwards out of the system; return whether there were any."""
    frozen = False
    for i in range(len(work.q)):
        if pushed_outwards(geometry, work, i):
            work.columns[i, :] = 0.0
            frozen = True
    return frozen


@inlined
def pushed_outwards(geometry, work, i):
    """Return whether joint i is at a limit and dq pushes it outwards."""
    q, push = work.q[i], work.dq[i]
    # `&` and `|`, not `and` and `or`: the sign of `push` is unpredictable, so short-circuiting mispredicts.
    return ((push < 0.0) & (q <= geometry.lower[i])) | ((push > 0.0) & (q >= geometry.upper[i]))
