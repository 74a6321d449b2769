"""All branches of six revolute joints: starts for descents, and how many there can be.

Two kinds of arms have a closed form, each from base to tip or from tip to base: the last three axes meet in a point
(a spherical wrist, Pieper 1968), or axes two, three and four are parallel (Universal Robots). For both, the angle of
the first joint and that of one other joint follow from two equations that are linear in their cosines and sines, with
at most four solutions; each of them leaves two choices, for the wrist or for the elbow. All other axes are solved by
a resultant (`any_axes.py`). docs/derivation.md derives both.

The angles are exact up to rounding if the axes are. They are starts all the same: descents by the selected method bring
each of them to the target, and the search judges the outcome as any other.
"""

from __future__ import annotations

import math

from ros_ik_pkg.ik.branches.any_axes import CERTAIN, branches_of_any_axes
from ros_ik_pkg.ik.branches.axes import NO_KIND, WRIST, axis, feet, kind_of, origin
from ros_ik_pkg.ik.branches.chain import JOINTS, Chain, from_other_end, put, reference_of, with_slack
from ros_ik_pkg.ik.branches.circles import meet_circles
from ros_ik_pkg.ik.branches.subproblems import angle_onto, component, turn, two_angles
from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.data_layout import BRANCH_ROWS
from ros_ik_pkg.ik.kernel.linalg import assign, fill
from ros_ik_pkg.ik.kernel.vectors import dot, minus, plus_times, rotated, rotated_back
from ros_ik_pkg.ik.kinematics.forward import walk
from ros_ik_pkg.ik.kinematics.pose_error import difference

PAIRS = BRANCH_ROWS - 4  # row of the memory at which the pairs of angles begin
UNKNOWN, STARTS, FAMILY, COMPLETE = range(4)  # what is known of the branches that were found, see find_branches

EXACT = 2e-5  # rad, or lengths of the arm: so far axes may be off in an exact geometry, for 1.5708 is not pi / 2
COARSEST = 1e-3  # rad, or lengths of the arm: with larger tolerances more than the branches of the pose are solutions
MARGIN = 10.0  # factor on the tolerance: an equation that misses a solution by less may have one within tolerance
NEAR_LIMIT = 100.0  # factor too: an angle that is outside the limits by less becomes a start at the limit


@kernel
def find_branches(geometry, scale, task, tuning, reference, work):
    """Write starts (k, 6) within the limits to work.branches; return k, and what is known of them.

    COMPLETE: every solution is next to one of them; without any there is none. FAMILY: so it is, but the pose is
    singular: solutions form a continuous family, of which a start is near the reference. STARTS: there may be others,
    because the axes are not quite as a closed form needs them, or solutions are close together. UNKNOWN: there are
    none of this arm or task.
    `scale` is the length of the arm [m].
    """
    if not (task.plain > 0.0 and six_turning(geometry)):
        return 0, UNKNOWN
    fill(work.went, 0.0)
    R, p = walk(geometry, work.went, work.joints)
    lines = work.joints.axes
    for k in range(JOINTS):
        for i in range(3, 6):
            lines[k, i] /= scale
    kind, backwards, off = kind_of(lines)
    tolerance = max(tuning.position_tolerance / scale, tuning.orientation_tolerance)
    miss = min(tolerance, COARSEST)
    G = difference(task.R, R)
    moved = rotated(G, p)
    t = (task.p[0] - moved[0]) / scale, (task.p[1] - moved[1]) / scale, (task.p[2] - moved[2]) / scale
    chain = Chain(
        lines, G, t, NEAR_LIMIT * miss, MARGIN * miss, 0.5 * tolerance, False, geometry, tuning.respect_limits > 0.0,
        reference, work.branches,
    )  # fmt: skip
    most = COMPLETE if tolerance <= COARSEST else STARTS
    if kind == NO_KIND or off > EXACT:
        count, worth = branches_of_any_axes(chain, 0)
        if worth != CERTAIN:
            chain, before = from_other_end(chain), count
            count, worth = branches_of_any_axes(chain, before)
            chain = from_other_end(chain)
            if worth == CERTAIN:
                for k in range(before, count):
                    assign(work.branches[k - before], work.branches[k])
                count -= before
        if worth == CERTAIN:
            return count, most
        if kind == NO_KIND:
            return count, STARTS if count > 0 else UNKNOWN
        most = STARTS
    chain = with_slack(chain, NEAR_LIMIT * (miss + off), MARGIN * (miss + off))
    if backwards:
        chain = from_other_end(chain)
    count, single = branches_by_wrist(chain, work.rhs) if kind == WRIST else branches_by_parallel(chain, work.rhs)
    return count, most if single or most == STARTS else FAMILY


@kernel
def six_turning(geometry):
    """Return whether the chain has six joints that turn, each with a variable of its own."""
    if len(geometry.lower) != JOINTS or len(geometry.prismatic) != JOINTS:
        return False
    for k in range(JOINTS):
        if geometry.prismatic[k] != 0.0 or geometry.variable[k] != k or abs(geometry.multiplier[k]) != 1.0:
            return False
    return True


@kernel
def branches_by_wrist(chain, roots):
    """Solve six axes of which the last three meet in a point c; return the number of branches and whether all are
    isolated.

    The first three joints bring c to its place x. Seen from axis 2, c turned about axis 3 and x turned back about
    axis 1 must have the same height and the same distance.
    """
    lines, G = chain.lines, chain.G
    h1, h2, h3, h4, h5, h6 = axes_of(lines)
    c, _ = feet(lines, 5, 4)
    x = plus_times(rotated(G, c), chain.t, 1.0)
    p1, p2 = feet(lines, 0, 1)
    p3 = plus_times(origin(lines, 2), h3, dot(h3, minus(c, origin(lines, 2))))
    w, g, e, d = minus(x, p1), minus(c, p3), minus(p1, p2), minus(p3, p2)
    count, single = meet_circles(
        component(h2, h1, w), component(e, h1, w), component(h2, h3, g), component(d, h3, g),
        dot(h2, minus(d, e)), 0.5 * (dot(d, d) + dot(g, g) - dot(e, e) - dot(w, w)),
        chain.slack, chain.free, reference_of(chain, 0), reference_of(chain, 2), chain.branches[PAIRS:], roots,
    )  # fmt: skip
    found = 0
    last, middle = rotated(G, h6), rotated(G, h5)
    for k in range(count):
        q1, q3 = chain.branches[PAIRS + k, 0], chain.branches[PAIRS + k, 1]
        c1, s1, c3, s3 = math.cos(q1), math.sin(q1), math.cos(q3), math.sin(q3)
        q2, lever = angle_onto(h2, plus_times(d, turn(h3, c3, s3, g), 1.0), plus_times(e, turn(h1, c1, -s1, w), 1.0))
        if lever <= chain.free:
            q2, single = reference_of(chain, 1), False
        c2, s2 = math.cos(q2), math.sin(q2)
        z = turn(h3, c3, -s3, turn(h2, c2, -s2, turn(h1, c1, -s1, last)))
        y = turn(h3, c3, -s3, turn(h2, c2, -s2, turn(h1, c1, -s1, middle)))
        level, b, s = component(h4, h5, h6)
        choices, first, second = two_angles(b, s, dot(h4, z) - level, chain.slack, chain.free)
        for choice in range(choices):
            q5 = first if choice == 0 else second
            c5, s5 = math.cos(q5), math.sin(q5)
            q4, lever = angle_onto(h4, turn(h5, c5, s5, h6), z)
            if lever <= chain.free:
                q4, single = reference_of(chain, 3), False
            q6, _ = angle_onto(h6, h5, turn(h5, c5, -s5, turn(h4, math.cos(q4), -math.sin(q4), y)))
            found = put(chain, found, (q1, q2, q3, q4, q5, q6))
    return found, single


@kernel
def branches_by_parallel(chain, roots):
    """Solve six axes of which the second to the fourth are parallel to h; return as `branches_by_wrist`.

    The joints 2 to 4 change neither the height along h of a point c on axis 6 nor the angle between h and axis 6:
    two equations for the angles 1 and 5. Then joint 6 follows, and a triangle in the plane across h is left.
    """
    lines, G = chain.lines, chain.G
    h1, h, _, _, h5, h6 = axes_of(lines)
    c, p5 = feet(lines, 5, 4)
    p1, p2, p3, p4 = origin(lines, 0), origin(lines, 1), origin(lines, 2), origin(lines, 3)
    last = rotated(G, h6)
    a, b = component(h, h5, minus(c, p5)), component(h, h5, h6)
    count, single = meet_circles(
        component(h, h1, minus(plus_times(rotated(G, c), chain.t, 1.0), p1)), component(h, h1, last), a, b,
        dot(h, minus(p5, p1)), 0.0,
        chain.slack, chain.free, reference_of(chain, 0), reference_of(chain, 4), chain.branches[PAIRS:], roots,
    )  # fmt: skip
    upper, lower = across(h, minus(p3, p2)), across(h, minus(p4, p3))
    _, b3, s3 = component(upper, h, lower)
    found = 0
    for k in range(count):
        q1, q5 = chain.branches[PAIRS + k, 0], chain.branches[PAIRS + k, 1]
        c1, s1, c5, s5 = math.cos(q1), math.sin(q1), math.cos(q5), math.sin(q5)
        back, lever = angle_onto(h6, turn(h5, c5, -s5, h), rotated_back(G, turn(h1, c1, s1, h)))
        if lever <= chain.free:
            back, single = -reference_of(chain, 5), False
        c6, s6 = math.cos(back), math.sin(back)
        z = plus_times(p5, turn(h5, c5, -s5, minus(p4, p5)), 1.0)
        z = plus_times(c, turn(h6, c6, s6, minus(z, c)), 1.0)
        z = minus(plus_times(rotated(G, z), chain.t, 1.0), p1)
        z = across(h, minus(plus_times(p1, turn(h1, c1, -s1, z), 1.0), p2))
        y = turn(h1, c1, -s1, rotated(G, turn(h6, c6, s6, turn(h5, c5, -s5, upper))))
        sum_of_three, _ = angle_onto(h, upper, y)
        level = 0.5 * (dot(z, z) - dot(upper, upper) - dot(lower, lower))
        choices, first, second = two_angles(b3, s3, level, chain.slack, chain.free)
        for choice in range(choices):
            q3 = first if choice == 0 else second
            q2, lever = angle_onto(h, plus_times(upper, turn(h, math.cos(q3), math.sin(q3), lower), 1.0), z)
            if lever <= chain.free:
                q2, single = reference_of(chain, 1), False
            found = put(chain, found, (q1, q2, q3, sum_of_three - q2 - q3, q5, -back))
    return found, single


@inlined
def axes_of(lines):
    """Return the directions of all six axes."""
    return axis(lines, 0), axis(lines, 1), axis(lines, 2), axis(lines, 3), axis(lines, 4), axis(lines, 5)


@inlined
def across(h, v):
    """Return the part of v across the unit vector h."""
    return plus_times(v, h, -dot(h, v))
