"""One step of LANES descents by adaptive_dls, within the joint limits: what `step/` does for one."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kernel.linalg import ROWS
from ros_ik_pkg.ik.kernel.wide import bits_of, larger, smaller, where, wide
from ros_ik_pkg.ik.step.methods import damped_step, gradient


@inlined
def take_steps(geometry, tuning, cap, norm, moves, lanes):
    """Step those lanes that move from lanes.q; q becomes NaN if there is no finite step.

    As `step_within_limits` and `update`; for a lane in which no joint leaves the system, taking the step again because
    of another lane gives the same numbers.
    """
    gradient(lanes)
    freeze_pushed_lanes(geometry, lanes)
    damping = larger(tuning.adaptive_dls_gain * norm, tuning.adaptive_dls_damping)
    while True:
        definite = damped_step(damping, lanes)
        if not freeze_pushed_lanes(geometry, lanes):
            break
    total = wide(0.0)
    for i in range(len(lanes.dq)):
        total = total + abs(lanes.dq[i])
    sound = definite & (total < math.inf)
    for i in range(len(lanes.q)):
        step = larger(smaller(tuning.step_size * lanes.dq[i], cap), -cap)
        q = larger(smaller(lanes.q[i] + step, geometry.upper[i]), geometry.lower[i])
        lanes.q[i] = where(moves, where(sound, q, math.nan), lanes.q[i])


@inlined
def freeze_pushed_lanes(geometry, lanes):
    """Take joints at a limit that dq pushes outwards out of the system; return whether there were any."""
    some = 0
    for i in range(len(lanes.q)):
        q, push = lanes.q[i], lanes.dq[i]
        outwards = ((push < 0.0) & (q <= geometry.lower[i])) | ((push > 0.0) & (q >= geometry.upper[i]))
        lanes_pushed = bits_of(outwards)
        if lanes_pushed:
            kept = where(outwards, 0.0, 1.0)  # a product, as a processor is slow to read again what it stored masked
            for r in range(ROWS):
                lanes.columns[i, r] = kept * lanes.columns[i, r]
        some |= lanes_pushed
    return some != 0
