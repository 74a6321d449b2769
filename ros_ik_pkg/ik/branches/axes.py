"""Which closed form the axes of an arm allow, told from the axes where all joints are zero."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.vectors import cross, dot, length, minus, plus_times

NO_KIND, WRIST, PARALLEL = range(3)
NEARLY = 2e-2  # rad, or lengths of the arm: so far axes may be off and yield starts at least
CROSSED = 0.01  # sine of the angle from which on two axes count as different, and length of a link that counts as one


@kernel
def kind_of(lines):
    """Return (kind, backwards, off) of six axes (6, 6), each a unit vector and a point.

    WRIST: the last three meet in a point. PARALLEL: the second, third and fourth are parallel. `backwards`: so it is
    if the joints are counted from the tip. `off` [rad, or lengths of the arm] is how far they miss it; of several
    kinds the one that is missed least counts.
    """
    kind, backwards, least = NO_KIND, False, NEARLY
    off = spread(lines, 5, 4, 3)
    if off < least:
        kind, backwards, least = WRIST, False, off
    off = spread(lines, 0, 1, 2)
    if off < least:
        kind, backwards, least = WRIST, True, off
    off = skewness(lines, 0, 1, 2, 3, 4, 5)
    if off < least:
        kind, backwards, least = PARALLEL, False, off
    off = skewness(lines, 5, 4, 3, 2, 1, 0)
    if off < least:
        kind, backwards, least = PARALLEL, True, off
    return kind, backwards, least


@inlined
def spread(lines, a, b, c):
    """Return how far three axes are from meeting in a point; inf if the middle one is parallel to another one."""
    if not (crossed(lines, a, b) and crossed(lines, b, c)):
        return math.inf
    point, other = feet(lines, a, b)
    h, p = axis(lines, c), origin(lines, c)
    return max(length(minus(point, other)), length(cross(h, minus(point, p))))


@inlined
def skewness(lines, a, b, c, d, e, f):
    """Return how far the axes b, c and d are from parallel; inf unless the closed form of six axes a to f needs no more
    than that."""
    h = axis(lines, b)
    upper, lower = minus(origin(lines, c), origin(lines, b)), minus(origin(lines, d), origin(lines, c))
    long = length(cross(h, upper)) > CROSSED and length(cross(h, lower)) > CROSSED
    if not (long and crossed(lines, a, b) and crossed(lines, d, e) and crossed(lines, e, f)):
        return math.inf
    return max(length(cross(h, axis(lines, c))), length(cross(h, axis(lines, d))))


@inlined
def feet(lines, a, b):
    """Return the ends of the shortest connection of two axes, on the first and on the second."""
    h, k = axis(lines, a), axis(lines, b)
    p, q = origin(lines, a), origin(lines, b)
    n = cross(h, k)
    square = dot(n, n)
    between = minus(q, p)
    if square < 1e-12:  # parallel
        return p, plus_times(q, k, -dot(between, k))
    return plus_times(p, h, dot(cross(between, k), n) / square), plus_times(q, k, dot(cross(between, h), n) / square)


@inlined
def crossed(lines, a, b):
    """Return whether two axes have different directions."""
    return length(cross(axis(lines, a), axis(lines, b))) > CROSSED


@inlined
def axis(lines, k):
    """Return the direction of an axis."""
    return lines[k, 0], lines[k, 1], lines[k, 2]


@inlined
def origin(lines, k):
    """Return the point on an axis."""
    return lines[k, 3], lines[k, 4], lines[k, 5]


@kernel
def turn_round(lines):
    """Count the axes from the other end."""
    for k in range(3):
        for i in range(6):
            lines[k, i], lines[5 - k, i] = lines[5 - k, i], lines[k, i]
