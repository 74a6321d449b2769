"""All branches of six revolute joints of any geometry, by the resultant of Raghavan and Roth (1993).

E_2 E_3 E_4 and E_1^-1 G E_6^-1 move a point x of axis 5, and the direction of the axis, to the same place, where E_k
is the turn of joint k and G the motion that all joints make together. That makes 14 equations without joint 5, linear
in products of the cosines and sines of joints 1 and 6 on one side and of joints 3 and 4 on the other. Eight of them
eliminate joints 1 and 6. The six that are left, and the same times tan(q3 / 2), are linear in 12 products of
tan(q3 / 2) and tan(q4 / 2), with coefficients linear in the cosine and sine of joint 2. So their determinant is a
trigonometric polynomial of joint 2, of degree eight, and its roots are the only values that joint 2 can have.
docs/derivation.md has the details.
"""

from __future__ import annotations

import math

from ros_ik_pkg.ik.branches.axes import axis, origin
from ros_ik_pkg.ik.branches.chain import put
from ros_ik_pkg.ik.branches.elimination import UNKNOWNS, back_substitute, eliminate, substitute_rows
from ros_ik_pkg.ik.branches.resultant import (
    COLUMNS,
    EQUATIONS,
    MEMORY,
    PRODUCTS,
    correction,
    determinant,
    keeps_away,
    make_resultant,
    middle_of,
    null_vectors,
    tell_apart,
)
from ros_ik_pkg.ik.branches.subproblems import angle_onto, turn
from ros_ik_pkg.ik.branches.trigonometric import (
    COSINES,
    ROOTS,
    SAMPLES,
    SINES,
    to_coefficients,
    to_roots,
    value_and_slope,
)
from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.linalg import assign, fill
from ros_ik_pkg.ik.kernel.numba_insides import on_stack
from ros_ik_pkg.ik.kernel.vectors import cross, dot, length, minus, plus_times, rotated

NOTHING, DOUBTFUL, CERTAIN = range(3)  # what the starts of `branches_of_any_axes` are worth
RANK = 1e-9  # ratio of pivots from which on the elimination counts as possible
MISFIT = 1e-9  # of the polynomial between its samples, to its largest: above, the determinant is rounding
LEAST_NOISE = 1e-14  # of its values, to the largest
SAFETY = 100.0  # factor on the error of a root that noise makes
GOOD = 1e-6  # lengths of the arm: residual of a start up to which it is next to a solution
CORRECTIONS = 4  # of a root
TWOFOLD = 1e-8  # of A, of numbers of about 1, up to which it takes a second vector to nothing
NEARLY_TWOFOLD = 1e-5  # the same where rounding has torn a double root apart
MOST = 32  # starts
BETWEEN = 0.4  # rad: where the polynomial is compared with the determinant


@kernel
def branches_of_any_axes(chain, found):
    """Append starts to the `found` ones in chain.branches; return how many there are then, and what they are worth.

    CERTAIN: every isolated solution is next to one of them. DOUBTFUL: there may be others, because roots of the
    polynomial are too close together. NOTHING: the equations say nothing of this geometry.
    """
    made = make_resultant(on_stack(MEMORY))
    _write_sides(chain, made.left, made.right)
    _write_equations(made)
    if not eliminate(made.equations, made.unknowns[0]) > RANK or not _to_tangents(made.equations):
        return found, NOTHING
    largest = 0.0
    for k in range(SAMPLES):
        made.samples[k] = determinant(made, COSINES[k], SINES[k])
        largest = max(largest, abs(made.samples[k]))
    to_coefficients(made.samples, made.c)
    expected, _ = value_and_slope(made.c, math.cos(BETWEEN), math.sin(BETWEEN))
    misfit = abs(determinant(made, math.cos(BETWEEN), math.sin(BETWEEN)) - expected)
    if not misfit <= MISFIT * largest:
        return found, NOTHING
    noise = max(LEAST_NOISE * largest, 10.0 * misfit)
    to_roots(made.c, made.roots)
    worth = CERTAIN
    for k in range(ROOTS):
        x, y = made.roots[k, 0], made.roots[k, 1]
        off = 0.5 * abs(x * x + y * y - 1.0)
        angle = math.atan2(y, x)
        _, slope = value_and_slope(made.c, math.cos(angle), math.sin(angle))
        real = off * abs(slope) <= SAFETY * noise
        if real or off <= math.sqrt(chain.slack):
            choices, sure = 1, True
            if null_vectors(made, angle) <= NEARLY_TWOFOLD:
                middle, partner = middle_of(made, k)
                if null_vectors(made, middle) <= TWOFOLD:  # two solutions have this angle in common
                    angle, choices = middle, tell_apart(made.v, made.w)
                    if partner != k:
                        fill(made.roots[partner], 0.0)
                else:
                    null_vectors(made, angle)
            for choice in range(choices):
                if choice == 1:
                    assign(made.v, made.w)
                angles, residual = _angles_of(chain, made, angle)
                if residual > GOOD:
                    angles, residual, sure = _corrected(chain, made, k, angle)
                if real and not ((residual <= GOOD and sure) or keeps_away(made, angle, off)):
                    worth = DOUBTFUL
                if found < MOST:
                    found = put(chain, found, angles)
                else:
                    worth = DOUBTFUL
    return found, worth


@kernel
def _write_sides(chain, left, right):
    """Write the coefficients (9, 14) of the invariants of axis 5 by the products of (cos, sin, 1) of two angles each:
    joints 1 and 6 on the left, joints 3 and 4 on the right."""
    lines, h2 = chain.lines, axis(chain.lines, 1)
    first = _across(h2)
    frame, o = (first, cross(h2, first), h2), origin(lines, 1)
    h5, p5 = axis(lines, 4), origin(lines, 4)
    for i in range(3):  # 0, 90 and 180 degrees
        ci, si = 1.0 - i, i * (2.0 - i)
        for j in range(3):
            cj, sj = 1.0 - j, j * (2.0 - j)
            h = rotated(chain.G, turn(axis(lines, 5), cj, -sj, h5))
            p = plus_times(rotated(chain.G, _turned(lines, 5, cj, -sj, p5)), chain.t, 1.0)
            h, p = turn(axis(lines, 0), ci, -si, h), _turned(lines, 0, ci, -si, p)
            _write_invariants(frame, minus(p, o), h, left[3 * i + j])
            h, p = turn(axis(lines, 3), cj, sj, h5), _turned(lines, 3, cj, sj, p5)
            h, p = turn(axis(lines, 2), ci, si, h), _turned(lines, 2, ci, si, p)
            _write_invariants(frame, minus(p, o), h, right[3 * i + j])
    for table in (left, right):
        for i in range(3):
            _fit(table, 3 * i, 3 * i + 1, 3 * i + 2)
        for j in range(3):
            _fit(table, j, 3 + j, 6 + j)


@inlined
def _across(h):
    """Return a unit vector across h."""
    x = cross(h, (1.0, 0.0, 0.0) if abs(h[0]) < 0.7 else (0.0, 1.0, 0.0))
    return plus_times((0.0, 0.0, 0.0), x, 1.0 / length(x))


@inlined
def _turned(lines, k, cosine, sine, p):
    """Return the point p turned about axis k."""
    o = origin(lines, k)
    return plus_times(o, turn(axis(lines, k), cosine, sine, minus(p, o)), 1.0)


@inlined
def _write_invariants(frame, p, h, row):
    """Write p, h, p x h and (p . p) h - 2 (p . h) p in the axes of a frame, then p . p and p . h, to `row` (14,).

    All are linear in the cosine and the sine of each joint that turns the line of h through p.
    """
    m, pp, ph = cross(p, h), dot(p, p), dot(p, h)
    for i in range(3):
        x, y = dot(frame[i], p), dot(frame[i], h)
        row[i], row[3 + i], row[6 + i], row[9 + i] = x, y, dot(frame[i], m), pp * y - 2.0 * ph * x
    row[12], row[13] = pp, ph


@inlined
def _fit(table, a, b, c):
    """Turn the rows of values at 0, 90 and 180 degrees into those of the factors of (cos, sin, 1)."""
    for e in range(EQUATIONS):
        constant = 0.5 * (table[a, e] + table[c, e])
        table[a, e] -= constant
        table[b, e] -= constant
        table[c, e] = constant


@kernel
def _write_equations(made):
    """Write the 14 equations: products of joints 1 and 6 = products of joints 3 and 4, turned about axis 2."""
    equations, left, right = made.equations, made.left, made.right
    for e in range(EQUATIONS):
        row = equations[e]
        fill(row, 0.0)
        for m in range(UNKNOWNS):
            row[m] = left[m, e]
        for m in range(PRODUCTS):
            cosine, sine, one = UNKNOWNS + m, UNKNOWNS + PRODUCTS + m, UNKNOWNS + 2 * PRODUCTS + m
            if e >= 12 or e % 3 == 2:  # along axis 2
                row[one] = right[m, e]
            elif e % 3 == 0:
                row[cosine], row[sine] = right[m, e], -right[m, e + 1]
            else:
                row[cosine], row[sine] = right[m, e], right[m, e - 1]
        row[COLUMNS - 1] -= left[UNKNOWNS, e]


@kernel
def _to_tangents(equations):
    """Write the last six equations in products of (x^2, x, 1) in place of (cos, sin, 1), where x is the tangent of half
    the angle, and scale each to about 1; return False if one is empty."""
    for r in range(UNKNOWNS, EQUATIONS):
        row, largest = equations[r], 0.0
        for start in range(UNKNOWNS, COLUMNS, PRODUCTS):
            for i in range(3):
                _to_tangent(row, start + 3 * i, 1)
            for i in range(3):
                _to_tangent(row, start + i, 3)
        for j in range(UNKNOWNS, COLUMNS):
            largest = max(largest, abs(row[j]))
        if not largest > 0.0:
            return False
        for j in range(UNKNOWNS, COLUMNS):
            row[j] /= largest
    return True


@inlined
def _to_tangent(row, start, stride):
    """Turn factors of (cos, sin, 1) into those of (x^2, x, 1), times 1 + x^2."""
    a, b, c = row[start], row[start + stride], row[start + 2 * stride]
    row[start], row[start + stride], row[start + 2 * stride] = c - a, 2.0 * b, c + a


@kernel
def _corrected(chain, made, root, angle):
    """Correct the angle of joint 2; return the six angles, how far they miss the pose [lengths of the arm], and whether
    the root is still that one."""
    angles, residual = _angles_of(chain, made, angle)
    determinant(made, math.cos(angle), math.sin(angle))
    for _ in range(CORRECTIONS):
        angle -= correction(made, angle)
        determinant(made, math.cos(angle), math.sin(angle))
        substitute_rows(made.A, made.rows, made.v)
        angles, residual = _angles_of(chain, made, angle)
        if residual <= GOOD:
            break
    x, y = math.cos(angle), math.sin(angle)
    away = math.hypot(made.roots[root, 0] - x, made.roots[root, 1] - y)
    for k in range(ROOTS):
        if k != root and math.hypot(made.roots[k, 0] - x, made.roots[k, 1] - y) <= 2.0 * away:
            return angles, residual, False
    return angles, residual, True


@kernel
def _angles_of(chain, made, angle):
    """Return the six angles that belong to the angle of joint 2 and to v, and how far they miss the pose."""
    v, lines, G = made.v, chain.lines, chain.G
    # v has the products of (x^3, x^2, x, 1) and (y^2, y, 1)
    xx, xy, yy = 0.0, 0.0, 0.0
    for i in range(PRODUCTS):
        xx, xy, yy = xx + v[i] * v[i], xy + v[i] * v[i + 3], yy + v[i + 3] * v[i + 3]
    q3 = 2.0 * (math.atan2(xx, xy) if xx > yy else math.atan2(xy, yy))
    xx, xy, yy = 0.0, 0.0, 0.0
    for i in range(4):
        for j in range(3 * i, 3 * i + 2):
            xx, xy, yy = xx + v[j] * v[j], xy + v[j] * v[j + 1], yy + v[j + 1] * v[j + 1]
    q4 = 2.0 * (math.atan2(xx, xy) if xx > yy else math.atan2(xy, yy))
    c2, s2, c3, s3 = math.cos(angle), math.sin(angle), math.cos(q3), math.sin(q3)
    c4, s4 = math.cos(q4), math.sin(q4)
    products = (c3 * c4, c3 * s4, c3, s3 * c4, s3 * s4, s3, c4, s4, 1.0)
    order, right, unknowns = made.unknowns[0], made.unknowns[1], made.unknowns[2]
    for r in range(UNKNOWNS):
        row, value = made.equations[r], 0.0
        for m in range(PRODUCTS):
            column = UNKNOWNS + m
            value += (c2 * row[column] + s2 * row[column + PRODUCTS] + row[column + 2 * PRODUCTS]) * products[m]
        right[r] = value
    back_substitute(made.equations, order, right, unknowns)
    q1, q6 = math.atan2(unknowns[5], unknowns[2]), math.atan2(unknowns[7], unknowns[6])
    c1, s1, c6, s6 = math.cos(q1), math.sin(q1), math.cos(q6), math.sin(q6)
    # E_5 turns any vector across axis 5 to where the other joints bring it to the pose
    h5 = axis(lines, 4)
    arm = _across(h5)
    z = turn(axis(lines, 0), c1, -s1, rotated(G, turn(axis(lines, 5), c6, -s6, arm)))
    z = turn(axis(lines, 3), c4, -s4, turn(axis(lines, 2), c3, -s3, turn(axis(lines, 1), c2, -s2, z)))
    q5, _ = angle_onto(h5, arm, z)
    c5, s5 = math.cos(q5), math.sin(q5)
    miss = 0.0
    for k in range(3):
        p = origin(lines, 4)
        p = plus_times(p, h5, 1.0) if k == 1 else plus_times(p, arm, 1.0) if k == 2 else p
        goal = plus_times(rotated(G, _turned(lines, 5, c6, -s6, p)), chain.t, 1.0)
        p = _turned(lines, 3, c4, s4, _turned(lines, 4, c5, s5, p))
        p = _turned(lines, 0, c1, s1, _turned(lines, 1, c2, s2, _turned(lines, 2, c3, s3, p)))
        miss = max(miss, length(minus(p, goal)))
    return (q1, angle, q3, q4, q5, q6), miss
