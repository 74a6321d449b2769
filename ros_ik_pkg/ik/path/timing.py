"""Times along a joint path: as fast as velocity limits, acceleration limits and the requested speed allow.

The path parameter s is the length of the joint path. With x = (ds/dt)^2 and u = d2s/dt2 every limit is linear:
|q'| sqrt(x) <= v bounds x, and -a <= q' u + q'' x <= a bounds u on both sides. A pass backwards finds the largest x at
each row from which the limits can be kept to the end; a pass forwards then takes the largest u (Pham & Pham 2018,
reachability analysis). A spline with continuous accelerations, at rest at the stops, passes the rows at these times.
"""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import compiled, kernel

SHORTEST = 1e-9  # rad, m or s: the least length and duration
PARTS = 10  # of an interval; limits are checked at their ends
ROUNDS = 5  # of lowering limits where the spline exceeds them; after that the whole motion is slowed down
CLOSE = 1.01  # an excess that needs no further round
AROUND = 2  # rows to either side whose limits are lowered too
MARGIN = 1.0 + 1e-9


@compiled
def time_path(q, stops, least, velocity, acceleration):
    """Return (durations (N - 1,), velocities (N, n), accelerations (N, n)) of a joint path.

    Parameters
    ----------
    q : (N, n) [rad, m], no two rows in succession equal
    stops : (N,) bool, at which rows the joints rest; the first and the last are set
    least : (N - 1,) shortest time of each interval [s]; 0 for no bound
    velocity, acceleration : (n,) finite limits [rad/s, m/s], [rad/s^2, m/s^2]

    """
    count, n = q.shape
    durations, best = np.empty(count - 1), np.empty(count - 1)
    v, a = np.zeros((count, n)), np.zeros((count, n))
    speeds, ratios, scratch = np.zeros(count), np.empty(count - 1), np.empty((2, count))
    slopes, bends = np.empty(n), np.empty(n)
    lines = np.empty((2, n + 1, 2))
    ease, less = np.ones(count), np.empty(count)
    shortest = math.inf
    for _ in range(ROUNDS):
        first = 0
        for last in range(1, count):
            if stops[last]:
                fastest(q, first, last, least, velocity, acceleration, ease, speeds, slopes, bends, lines)
                first = last
        for k in range(count - 1):
            total = math.sqrt(speeds[k]) + math.sqrt(speeds[k + 1])
            moving = 2.0 * chord(q, k) / total if total > 0.0 else alone(q, k, velocity, acceleration)
            durations[k] = max(moving, least[k], SHORTEST)
        fit_spline(q, stops, durations, v, a, scratch)
        worst = MARGIN * measure_limits(q, durations, v, a, velocity, acceleration, ratios)
        factor = worst  # on all durations: velocities fall by it, accelerations by its square
        for k in range(count - 1):
            factor = max(factor, least[k] / durations[k])
        whole = factor * durations.sum()
        if whole < shortest:
            shortest = whole
            for k in range(count - 1):
                best[k] = factor * durations[k]
        if worst <= CLOSE:
            break
        take_it_easy(ratios, ease, less)
    fit_spline(q, stops, best, v, a, scratch)
    return best, v, a


@kernel
def take_it_easy(ratios, ease, less):
    """Lower the limits of the rows around intervals in which the spline exceeds them."""
    less[:] = 1.0
    for k in range(len(ratios)):
        if ratios[k] > 1.0:
            for i in range(max(0, k - AROUND), min(len(less), k + 2 + AROUND)):
                less[i] = min(less[i], 1.0 / (ratios[k] * ratios[k]))
    for k in range(len(less)):
        ease[k] *= less[k]


@kernel
def alone(q, k, velocity, acceleration):
    """Return the time of an interval between two rests [s].

    The polynomial of the fifth degree reaches 15/8 of the mean velocity, and an acceleration of 10 / sqrt(3) times the
    distance over the square of the time.
    """
    longest = 0.0
    for j in range(q.shape[1]):
        way = abs(q[k + 1, j] - q[k, j])
        longest = max(longest, 1.875 * way / velocity[j], math.sqrt(5.7736 * way / acceleration[j]))
    return longest


@kernel
def chord(q, k):
    """Return the length of the joint path from row k to the next."""
    square = 0.0
    for j in range(q.shape[1]):
        square += (q[k + 1, j] - q[k, j]) ** 2
    return max(math.sqrt(square), SHORTEST)


@kernel
def fastest(q, first, last, least, velocity, acceleration, ease, x, slopes, bends, lines):
    """Write the largest x = (ds/dt)^2 that the limits allow at rows `first` to `last`, with rests at both."""
    n = q.shape[1]
    x[last] = 0.0
    for k in range(last - 1, first - 1, -1):
        bound = bounds_at(q, k, first, last, least, velocity, acceleration, ease[k], x[k + 1], slopes, bends, lines)
        for i in range(n + 1):
            for j in range(n + 1):
                gap = lines[0, i, 1] - lines[1, j, 1]
                if gap > 0.0 and lines[1, j, 0] < math.inf and lines[0, i, 0] > -math.inf:
                    bound = min(bound, (lines[1, j, 0] - lines[0, i, 0]) / gap)
        x[k] = max(0.0, bound)
    x[first] = 0.0
    for k in range(first, last):
        bounds_at(q, k, first, last, least, velocity, acceleration, ease[k], x[k + 1], slopes, bends, lines)
        u = math.inf
        for j in range(n + 1):
            u = min(u, lines[1, j, 0] + lines[1, j, 1] * x[k])
        x[k + 1] = min(x[k + 1], max(0.0, x[k] + 2.0 * chord(q, k) * u))


@kernel
def bounds_at(q, k, first, last, least, velocity, acceleration, ease, most, slopes, bends, lines):
    """Return the bound of x at row k; write those of u to `lines`: lines[0] u >= a + b x, lines[1] u <= a + b x.

    The last line of each keeps x at the next row between 0 and `most`. `ease` is a factor on the limits.
    """
    n, h = q.shape[1], chord(q, k)
    differentiate(q, k, first, last, slopes, bends)
    bound = math.inf
    if least[k] > 0.0:
        bound = (h / least[k]) ** 2
    if k > first and least[k - 1] > 0.0:
        bound = min(bound, (chord(q, k - 1) / least[k - 1]) ** 2)
    for j in range(n):
        slope, bend = abs(slopes[j]), bends[j]
        if slope > SHORTEST:
            bound = min(bound, ease * (velocity[j] / slope) ** 2)
            room, tilt = ease * acceleration[j] / slope, -bend / slopes[j]
            lines[0, j, 0], lines[0, j, 1] = -room, tilt
            lines[1, j, 0], lines[1, j, 1] = room, tilt
        else:
            if abs(bend) > SHORTEST:
                bound = min(bound, ease * acceleration[j] / abs(bend))
            lines[0, j, 0], lines[0, j, 1], lines[1, j, 0], lines[1, j, 1] = -math.inf, 0.0, math.inf, 0.0
    lines[0, n, 0], lines[0, n, 1] = 0.0, -0.5 / h
    lines[1, n, 0], lines[1, n, 1] = 0.5 * most / h, -0.5 / h
    return bound


@kernel
def differentiate(q, k, first, last, slopes, bends):
    """Write dq/ds and d2q/ds2 at row k by finite differences, one-sided at the ends of a stretch."""
    at = min(max(k, first + 1), last - 1)
    if last - first < 2:
        h = chord(q, first)
        for j in range(q.shape[1]):
            slopes[j], bends[j] = (q[last, j] - q[first, j]) / h, 0.0
        return
    g, h = chord(q, at - 1), chord(q, at)
    for j in range(q.shape[1]):
        before, after = (q[at, j] - q[at - 1, j]) / g, (q[at + 1, j] - q[at, j]) / h
        bends[j] = 2.0 * (after - before) / (g + h)
        if k == first:
            slopes[j] = before
        elif k == last:
            slopes[j] = after
        else:
            slopes[j] = (before * h + after * g) / (g + h)


@kernel
def fit_spline(q, stops, durations, v, a, scratch):
    """Write velocities and accelerations of the cubic spline through q with continuous accelerations.

    Both are 0 at a stop, so the intervals beside it become polynomials of the fifth degree.
    """
    first = 0
    for last in range(1, len(q)):
        if stops[last]:
            for j in range(q.shape[1]):
                fit_one(q[:, j], durations, v[:, j], a[:, j], first, last, scratch)
            first = last


@kernel
def fit_one(q, durations, v, a, first, last, scratch):
    """Implement `fit_spline` for one joint between two stops: a tridiagonal system of the velocities."""
    v[first] = a[first] = v[last] = a[last] = 0.0
    upper, right = scratch[0], scratch[1]
    upper[first], right[first] = 0.0, 0.0
    for k in range(first + 1, last):
        g, h = 1.0 / durations[k - 1], 1.0 / durations[k]
        rest = 3.0 * (g * g * (q[k] - q[k - 1]) + h * h * (q[k + 1] - q[k]))
        pivot = 2.0 * (g + h) - g * upper[k - 1]
        upper[k] = h / pivot
        right[k] = (rest - g * right[k - 1]) / pivot
    for k in range(last - 1, first, -1):
        v[k] = right[k] - upper[k] * v[k + 1]
    for k in range(first + 1, last):
        h = durations[k]
        a[k] = (6.0 * (q[k + 1] - q[k]) / h - 4.0 * v[k] - 2.0 * v[k + 1]) / h


@kernel
def measure_limits(q, durations, v, a, velocity, acceleration, ratios):
    """Write the factor by which each interval must be longer to keep its limits; return the largest."""
    worst = 0.0
    for k in range(len(durations)):
        ratio = 0.0
        for j in range(q.shape[1]):
            c = quintic(q[k, j], v[k, j], a[k, j], q[k + 1, j], v[k + 1, j], a[k + 1, j], durations[k])
            for i in range(PARTS + 1):
                t = durations[k] * i / PARTS
                speed = c[1] + t * (2.0 * c[2] + t * (3.0 * c[3] + t * (4.0 * c[4] + t * 5.0 * c[5])))
                gain = 2.0 * c[2] + t * (6.0 * c[3] + t * (12.0 * c[4] + t * 20.0 * c[5]))
                ratio = max(ratio, abs(speed) / velocity[j], math.sqrt(abs(gain) / acceleration[j]))
        ratios[k] = ratio
        worst = max(worst, ratio)
    return worst


@kernel
def quintic(p, v, a, p2, v2, a2, h):
    """Return the six coefficients of the polynomial with given position, velocity and acceleration at 0 and at h."""
    d = p2 - p - h * (v + 0.5 * h * a)
    e, f = h * (v2 - v - h * a), h * h * (a2 - a)
    h3 = h * h * h
    return (
        p, v, 0.5 * a, (10.0 * d - 4.0 * e + 0.5 * f) / h3, (-15.0 * d + 7.0 * e - f) / (h3 * h),
        (6.0 * d - 3.0 * e + 0.5 * f) / (h3 * h * h),
    )  # fmt: skip
