"""One period of a joint's motion within limits of position, velocity, acceleration and jerk, towards a moving target.

There is one rule: of all jerks that are constant over the period, take the one after which the shortest stop ends at
the target. While the stop would end short of the target, this is the largest jerk; from then on the joint follows the
stop itself. Relative to a target of constant velocity this is the time-optimal motion, whose switching surface is the
set of states from which the shortest stop ends on the target (Kroeger, On-Line Trajectory Generation in Robotic
Systems, 2010, chapter 5), apart from the length of a period.

The limits do not depend on that rule: a period is taken only if a stop within all limits can follow it. If no jerk
allows this, the joint follows the stop that made the previous period admissible.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import types

from ros_ik_pkg.ik.kernel.compiled import entry_point, inlined, kernel

ON_TARGET = 1e-11  # rad, m: a stop that ends this near the target needs no other jerk
ROUNDING = 1e-12  # rad, m, rad/s, m/s: what the sums over the periods of one stop may lose
HALVINGS = 52  # of a range of jerks, until no number is left between its ends
MOST_COPIED = 0.8  # of a limit, that a target may need itself and be followed exactly
UP, DOWN = 1, 2  # which limits a state breaks
MATRIX = types.Array(types.float64, 2, 'C')


class Bounds(NamedTuple):
    """Limits of one joint [rad, m, s]."""

    lower: float
    upper: float
    velocity: float
    acceleration: float
    jerk: float


@inlined
def bounds_of(limits, i):
    """Return the limits of joint i from a (5, n) array."""
    return Bounds(limits[0, i], limits[1, i], limits[2, i], limits[3, i], limits[4, i])


@inlined
def plan_stop(v, a, acceleration, jerk):
    """Return the shortest stop from velocity v and acceleration a: side, peak, t1, t2, t3.

    For t1 [s] the jerk is -side * jerk, for t2 the acceleration is -side * peak, for t3 the jerk is side * jerk.
    """
    coasting = v + 0.5 * a * abs(a) / jerk  # the velocity after the acceleration is brought to zero
    side = 1.0 if coasting >= 0.0 else -1.0
    v, a = side * v, side * a
    wanted = math.sqrt(max(jerk * v + 0.5 * a * a, 0.0))
    peak = max(min(wanted, acceleration), -a)
    t1 = (a + peak) / jerk
    t2 = max((v + 0.5 * a * a / jerk - peak * peak / jerk) / peak, 0.0) if wanted > peak > 0.0 else 0.0
    return side, peak, t1, t2, peak / jerk


@inlined
def stop_distance(v, a, acceleration, jerk):
    """Return how far the joint moves during the shortest stop [rad, m]."""
    side, peak, t1, t2, t3 = plan_stop(v, a, acceleration, jerk)
    v, a = side * v, side * a
    v1 = v + t1 * (a - 0.5 * jerk * t1)
    v2 = v1 - peak * t2
    x1 = t1 * (v + t1 * (0.5 * a - jerk * t1 / 6.0))
    x2 = t2 * (v1 - 0.5 * peak * t2)
    x3 = t3 * (v2 + t3 * (jerk * t3 / 6.0 - 0.5 * peak))
    return side * (x1 + x2 + x3)


@inlined
def move(x, v, a, j, t):
    """Return position, velocity and acceleration after the time t [s] with the constant jerk j."""
    return x + t * (v + t * (0.5 * a + t * j / 6.0)), v + t * (a + 0.5 * t * j), a + t * j


@kernel
def follow_stop(x, v, a, acceleration, jerk, period):
    """Return position, velocity and acceleration after a period of the shortest stop."""
    side, _, t1, t2, t3 = plan_stop(v, a, acceleration, jerk)
    left = period
    for t, j in ((t1, -side * jerk), (t2, 0.0), (t3, side * jerk)):
        x, v, a = move(x, v, a, j, min(t, left))
        left -= min(t, left)
    if left > 0.0:
        return x, 0.0, 0.0
    return x, v, a


@kernel
def broken(x, v, a, bounds, slack):
    """Return which limits, UP, DOWN or none, are broken now or during the shortest stop."""
    coasting = v + 0.5 * a * abs(a) / bounds.jerk
    end = x + stop_distance(v, a, bounds.acceleration, bounds.jerk)
    high, low = max(x, end), min(x, end)
    if v * coasting < 0.0:  # the joint turns back on the way: where its velocity is zero
        side = 1.0 if coasting >= 0.0 else -1.0
        t = (side * a - math.sqrt(max(a * a + 2.0 * bounds.jerk * side * v, 0.0))) / bounds.jerk
        turn = move(x, v, a, -side * bounds.jerk, t)[0]
        high, low = max(high, turn), min(low, turn)
    fastest, hardest = bounds.velocity + slack, bounds.acceleration + slack
    if high > bounds.upper + slack or max(v, coasting) > fastest or a > hardest:
        return UP
    if low < bounds.lower - slack or min(v, coasting) < -fastest or a < -hardest:
        return DOWN
    return 0


@kernel
def broken_after(x, v, a, j, bounds, period):
    """Return which limits are broken during a period with the jerk j or the stop after it."""
    x1, v1, a1 = move(x, v, a, j, period)
    if a * a1 < 0.0:  # the velocity has its extreme between the two samples
        extreme = v - 0.5 * a * a / j
        if extreme > bounds.velocity:
            return UP
        if extreme < -bounds.velocity:
            return DOWN
    return broken(x1, v1, a1, bounds, 0.0)


@kernel
def jerk_to(x, v, a, least, most, acceleration, jerk, period):
    """Return the jerk from `least` to `most` after which the stop ends nearest to the target, the origin of x and v."""
    for bound in (most, least):
        x1, v1, a1 = move(x, v, a, bound, period)
        end = x1 + stop_distance(v1, a1, acceleration, jerk)
        if (end <= 0.0) == (bound == most):
            return bound
    for _ in range(HALVINGS):
        j = 0.5 * (least + most)
        x1, v1, a1 = move(x, v, a, j, period)
        if x1 + stop_distance(v1, a1, acceleration, jerk) > 0.0:
            most = j
        else:
            least = j
    return least


@kernel
def advance_joint(x, v, a, target, target_v, target_a, target_j, bounds, period):
    """Return position, velocity and acceleration of one joint a period later."""
    if abs(target_a) > MOST_COPIED * bounds.acceleration or abs(target_j) > MOST_COPIED * bounds.jerk:
        target_a, target_j = 0.0, 0.0
    # Seen from the target, with the limits that its own motion leaves:
    away, approach, push = x - target, v - target_v, a - target_a
    acceleration, jerk = bounds.acceleration - abs(target_a), bounds.jerk - abs(target_j)
    if abs(away + stop_distance(approach, push, acceleration, jerk)) <= ON_TARGET:
        x1, v1, a1 = follow_stop(away, approach, push, acceleration, jerk, period)
        x2, v2, a2 = move(target, target_v, target_a, target_j, period)
        if broken(x1 + x2, v1 + v2, a1 + a2, bounds, ROUNDING) == 0:
            return x1 + x2, v1 + v2, a1 + a2
    least = max(-bounds.jerk, (-bounds.acceleration - a) / period)
    most = min(bounds.jerk, (bounds.acceleration - a) / period)
    j = target_j + jerk_to(away, approach, push, least - target_j, most - target_j, acceleration, jerk, period)
    side = broken_after(x, v, a, j, bounds, period)
    if side != 0:
        good, bad = least if side == UP else most, j
        for _ in range(HALVINGS):
            j = 0.5 * (good + bad)
            if broken_after(x, v, a, j, bounds, period) == side:
                bad = j
            else:
                good = j
        j = good
        if broken_after(x, v, a, j, bounds, period) != 0:
            return follow_stop(x, v, a, bounds.acceleration, bounds.jerk, period)
    return move(x, v, a, j, period)


@entry_point(types.none, [MATRIX, MATRIX, MATRIX, types.float64])
def advance(state, targets, limits, period):
    """Move all joints on by a period [s], in place.

    state: (3, n) position, velocity, acceleration. targets: (4, n) the same of the target, now, and its jerk, constant
    over the period. limits: (5, n) lower, upper, velocity, acceleration, jerk, the last three finite and above 0. The
    state must be one from which a stop within the limits is possible, such as rest; every state that this function
    leaves is, whatever the targets.
    """
    for i in range(state.shape[1]):
        state[0, i], state[1, i], state[2, i] = advance_joint(
            state[0, i], state[1, i], state[2, i], targets[0, i], targets[1, i], targets[2, i], targets[3, i],
            bounds_of(limits, i), period,
        )  # fmt: skip


@entry_point(types.bool_, [MATRIX, MATRIX])
def can_stop(state, limits):
    """Return whether a stop within the limits (5, n) follows the state (3, n)."""
    for i in range(state.shape[1]):
        if broken(state[0, i], state[1, i], state[2, i], bounds_of(limits, i), 2.0 * ROUNDING) != 0:
            return False
    return True


@entry_point(types.none, [MATRIX, MATRIX, types.float64])
def halt(state, limits, period):
    """Move all joints on by a period [s] of their shortest stops, in place; state and limits as for `advance`."""
    for i in range(state.shape[1]):
        state[0, i], state[1, i], state[2, i] = follow_stop(
            state[0, i], state[1, i], state[2, i], limits[3, i], limits[4, i], period
        )


@entry_point(types.float64, [MATRIX, MATRIX])
def time_to_rest(state, limits):
    """Return how long the shortest stop of the slowest joint takes [s]; state and limits as for `advance`."""
    longest = 0.0
    for i in range(state.shape[1]):
        _, _, t1, t2, t3 = plan_stop(state[1, i], state[2, i], limits[3, i], limits[4, i])
        longest = max(longest, t1 + t2 + t3)
    return longest
