"""Two equations that are linear in the cosines and sines of two angles: the core of both closed forms."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.branches.subproblems import four_angles, two_angles
from ros_ik_pkg.ik.kernel.compiled import inlined, kernel

INDEPENDENT = 1e-3  # ratio of two rows from which on the equations count as two for the second angle


@kernel
def meet_circles(first_a, second_a, first_b, second_b, first_level, second_level, slack, free, a0, b0, pairs, roots):
    """Write all pairs of angles (a, b) that solve two equations to `pairs` (4, 6); return how many, and whether they
    are isolated: if any angle does, a0 or b0 stands for it.

    The equations are first_a . (1, cos a, -sin a) = first_b . (1, cos b, sin b) + first_level, and so for the second;
    one that is missed by up to the slack counts. Turned into the main axes of what b makes of them, one of them is free
    of b for most arms, and the angles follow one after the other. For the others b is eliminated, which leaves a
    polynomial of degree four for a.
    """
    ax, ay = first_a[1], -first_a[2]
    bx, by = second_a[1], -second_a[2]
    r, s = first_b[0] + first_level - first_a[0], second_b[0] + second_level - second_a[0]
    # Main axes of the 2 x 2 matrix with the rows (first_b[1:], second_b[1:])
    ux, uy, vx, vy = first_b[1], first_b[2], second_b[1], second_b[2]
    half = 0.5 * math.atan2(2.0 * (ux * vx + uy * vy), ux * ux + uy * uy - vx * vx - vy * vy)
    c, d = math.cos(half), math.sin(half)
    ax, ay, bx, by = c * ax + d * bx, c * ay + d * by, c * bx - d * ax, c * by - d * ay
    ux, uy, vx, vy = c * ux + d * vx, c * uy + d * vy, c * vx - d * ux, c * vy - d * uy
    r, s = c * r + d * s, c * s - d * r
    if vx * vx + vy * vy <= INDEPENDENT * INDEPENDENT * (ux * ux + uy * uy):
        return one_after_the_other(ax, ay, bx, by, ux, uy, r, s, slack, free, a0, b0, pairs)
    det = ux * vy - uy * vx
    # (cos b, sin b) = P (cos a, sin a) + o
    pxx, pxy, ox = (vy * ax - uy * bx) / det, (vy * ay - uy * by) / det, (uy * s - vy * r) / det
    pyx, pyy, oy = (ux * bx - vx * ax) / det, (ux * by - vx * ay) / det, (vx * r - ux * s) / det
    xx, yy, xy = pxx * pxx + pyx * pyx, pxy * pxy + pyy * pyy, pxx * pxy + pyx * pyy
    count = four_angles(
        0.5 * (xx + yy) + ox * ox + oy * oy - 1.0, 2.0 * (ox * pxx + oy * pyx), 2.0 * (ox * pxy + oy * pyy),
        0.5 * (xx - yy), xy, math.sqrt(slack), roots,
    )  # fmt: skip
    for k in range(count):
        x, y = math.cos(roots[k]), math.sin(roots[k])
        pairs[k, 0], pairs[k, 1] = roots[k], math.atan2(pyx * x + pyy * y + oy, pxx * x + pxy * y + ox)
    return count, True


@inlined
def one_after_the_other(ax, ay, bx, by, ux, uy, r, s, slack, free, a0, b0, pairs):
    """Solve b . (cos a, sin a) = s for a, and a . (cos a, sin a) - r = u . (cos b, sin b) for b then."""
    choices, a, other = two_angles(bx, by, s, slack, free)
    single, count = choices >= 0, 0
    if choices < 0:
        choices, a = 1, a0
    for choice in range(choices):
        if choice == 1:
            a = other
        level = ax * math.cos(a) + ay * math.sin(a) - r
        more, b, another = two_angles(ux, uy, level, slack, free)
        if more < 0:
            more, b, single = 1, b0, False
        for turned in range(more):
            pairs[count, 0], pairs[count, 1] = a, b if turned == 0 else another
            count += 1
    return count, single
