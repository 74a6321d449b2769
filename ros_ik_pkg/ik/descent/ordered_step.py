"""The step of a descent for two tasks in strict order, and the joints that are at a limit.

Sequential quadratic programming (Nocedal & Wright 2006, chapter 18) with exact second derivatives: a step brings the
error of the demanded rows to zero and, among the steps that do, goes to where the wished error is least,

    min  1/2 d^T H d - b^T d   subject to  J d = e,    b = Jw^T ew,    H = Jw^T Jw + sum_r mu_r d2 e_r

with J, e of the demanded and Jw, ew of the wished rows; mu_r is the error of a wished row, or the Lagrange multiplier
of a demanded one. Without the last sum these would be Gauss-Newton steps, which creep or run away if the wished error
does not vanish. For an axis w_i and a velocity v_j of the tip in the Jacobian's columns, i before j, d2 p = w_i x v_j,
and d2 phi = -1/2 w_i x w_j up to terms of higher order in phi = log(R* R^T).

With K = H + rho J^T J, positive definite for a large rho where H is so in the null space of J, the step is
d = K^-1 (b + J^T y), (J K^-1 J^T) y = e - J K^-1 b. Its parts by e and by b are orthogonal with respect to K.
"""

from __future__ import annotations

import math

from ros_ik_pkg.ik.descent.descent import largest_component
from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kernel.linalg import ROWS, assign

LONGEST_STEP = 0.5  # rad or m of one joint
RHO = 1e4  # over the largest diagonal element of H, per largest square of a column of J
POSITIVE = 1e-9  # a pivot over the largest diagonal element of H; less bends the other way
FIRST_DAMPING, MORE, MOST_DAMPING = 0.1, 4.0, 1e4  # over that element, where K is not positive definite
SINGULAR = 1e-10  # added to J K^-1 J^T, over its largest diagonal element: a singular row is mended in part
HOPE = 2.0  # times what the null space promises: the most that a step is believed to gain


@inlined
def step_in_order(geometry, tuning, wish, radius, work):
    """Write the step to work.dq; return the most by which it may lower the square of the wished error, how much of
    that the motion in the null space of the demanded rows promises, and whether a joint leaves its limit.

    No joint moves further than `radius` in that null space. An active set: joints that would leave their limits go as
    far as those, and the others take over. work.near has the steps of such joints, NaN for the others; those that are
    at a limit stay in the set for the next step.
    """
    fixed = work.near
    for i in range(len(fixed)):
        if fixed[i] == fixed[i]:
            fixed[i] = 0.0
    unit, rho = bend(wish, work)
    while True:
        gain, promised = least_on_task(unit, rho, wish, radius, work)
        if not (tuning.respect_limits > 0.0 and fix_first(geometry, work)):
            break
    released = release(geometry, wish, work)
    for r in range(ROWS):
        if work.weights[r] > 0.0:
            work.rhs[r] = (work.y[r] - rho * work.e[r]) * work.weights[r]
    return gain, promised, released


@inlined
def fix_first(geometry, work):
    """Let the joint that the step leads to a limit first stop there; return whether one goes beyond a limit."""
    first, least = -1, 1.0
    for i in range(len(work.q)):
        goal = work.q[i] + work.dq[i]
        if work.near[i] == work.near[i] or geometry.lower[i] <= goal <= geometry.upper[i]:
            continue
        fraction = (min(max(goal, geometry.lower[i]), geometry.upper[i]) - work.q[i]) / work.dq[i]
        if fraction < least:
            first, least = i, fraction
    if first < 0:
        return False
    work.near[first] = least * work.dq[first]
    return True


@inlined
def release(geometry, wish, work):
    """Take the joint that is pulled most from its limit out of the active set; return whether there is one."""
    most, worst = 0.0, -1
    for i in range(len(work.q)):
        if work.near[i] != work.near[i]:
            continue
        pull = work.null[i]
        for r in range(ROWS):
            if work.weights[r] > 0.0:
                pull += work.columns[i, r] * work.y[r]
        for j in range(len(work.q)):
            pull -= wish.curvature[max(i, j), min(i, j)] * work.dq[j]
        if work.q[i] + work.dq[i] >= geometry.upper[i]:
            pull = -pull
        if pull > most:
            most, worst = pull, i
    if worst < 0:
        return False
    work.near[worst] = math.nan
    return True


@inlined
def bend(wish, work):
    """Write b to work.null and the lower triangle of K to wish.curvature; return the largest diagonal element of H,
    and rho."""
    n, b, K, e, columns, wished, trial = (
        len(work.q), work.null, wish.curvature, work.e, work.columns, wish.columns, work.trial
    )
    mu, w = work.rhs, wish.task.weights
    for r in range(ROWS):
        if w[r] > 0.0:
            mu[r] = w[r] * e[r]
    m0, m1, m2, m3, m4, m5 = mu[0], mu[1], mu[2], 0.5 * mu[3], 0.5 * mu[4], 0.5 * mu[5]
    x, y, z, share = turned_whole(wish, work)
    unit, longest = 0.0, 0.0
    for i in range(n):
        ax, ay, az = trial[i, 3], trial[i, 4], trial[i, 5]
        # mu . (w_i x v) = (mu x w_i) . v
        px, py, pz = m1 * az - m2 * ay, m2 * ax - m0 * az, m0 * ay - m1 * ax
        ox, oy, oz = m4 * az - m5 * ay, m5 * ax - m3 * az, m3 * ay - m4 * ax
        along = x * ax + y * ay + z * az
        sx, sy, sz = share * (ax - along * x), share * (ay - along * y), share * (az - along * z)
        ux, uy, uz = sx - ox, sy - oy, sz - oz
        c0, c1, c2, c3, c4, c5 = wished[i, 0], wished[i, 1], wished[i, 2], wished[i, 3], wished[i, 4], wished[i, 5]
        b[i] = c0 * e[0] + c1 * e[1] + c2 * e[2] + c3 * e[3] + c4 * e[4] + c5 * e[5]
        for j in range(i + 1, n):
            K[j, i] = (
                c0 * wished[j, 0] + c1 * wished[j, 1] + c2 * wished[j, 2]
                + c3 * wished[j, 3] + c4 * wished[j, 4] + c5 * wished[j, 5]
                + ux * trial[j, 3] + uy * trial[j, 4] + uz * trial[j, 5]
                - px * trial[j, 0] - py * trial[j, 1] - pz * trial[j, 2]
            )  # fmt: skip
        K[i, i] = (
            c0 * c0 + c1 * c1 + c2 * c2 + c3 * c3 + c4 * c4 + c5 * c5 + sx * ax + sy * ay + sz * az
            - px * trial[i, 0] - py * trial[i, 1] - pz * trial[i, 2]
        )  # fmt: skip
        unit = max(unit, abs(K[i, i]))
        square = 0.0
        for r in range(ROWS):
            square += columns[i, r] * columns[i, r]
        longest = max(longest, square)
    rho = RHO * unit / longest if longest > 0.0 else 0.0
    for i in range(n):
        c0, c1, c2, c3, c4, c5 = (
            rho * columns[i, 0], rho * columns[i, 1], rho * columns[i, 2],
            rho * columns[i, 3], rho * columns[i, 4], rho * columns[i, 5],
        )  # fmt: skip
        for j in range(i, n):
            K[j, i] += (
                c0 * columns[j, 0] + c1 * columns[j, 1] + c2 * columns[j, 2]
                + c3 * columns[j, 3] + c4 * columns[j, 4] + c5 * columns[j, 5]
            )  # fmt: skip
    return unit, rho


@inlined
def turned_whole(wish, work):
    """Return the axis of the rotation error and what its second derivative has more than wish.columns say: that of
    |phi|^2 / 2 is n n^T + c (1 - n n^T) along rotations, c = |phi| / 2 cot(|phi| / 2). Zeros unless the three rows of
    the orientation are wished for alike."""
    w, bound = wish.task.weights, wish.task.tolerances
    x, y, z = work.e[3], work.e[4], work.e[5]
    angle = math.sqrt(x * x + y * y + z * z)
    if not (w[3] > 0.0 and w[3] == w[4] == w[5] and bound[3] + bound[4] + bound[5] == 0.0 and angle > 1e-6):
        return 0.0, 0.0, 0.0, 0.0
    half = 0.5 * angle / w[3]
    return x / angle, y / angle, z / angle, w[3] * w[3] * (half / math.tan(half) - 1.0)


@inlined
def least_on_task(unit, rho, wish, radius, work):
    """Write the step to work.dq, and y to work.y; return the gains that step_in_order returns."""
    n, b, fixed, y, e, S = len(work.q), work.null, work.near, work.y, work.e, work.A
    L, G, columns, weights, dq, went = wish.factors, wish.inverse, work.columns, work.weights, work.dq, work.went
    damping = 0.0
    while not factor_free(wish.curvature, damping, POSITIVE * unit, fixed, L):
        damping = max(FIRST_DAMPING * unit, MORE * damping)
        if not damping < MOST_DAMPING * unit:
            break
    # K^-1 b, K^-1 J^T; joints that are fixed count as given
    left, mended = wish.left, 0.0
    assign(left, b)
    for j in range(n):
        if fixed[j] == fixed[j] and fixed[j] != 0.0:
            for i in range(n):
                left[i] -= wish.curvature[max(i, j), min(i, j)] * fixed[j]
    for j in range(n):
        if fixed[j] == fixed[j]:
            mended += (b[j] + left[j]) * fixed[j]
    assign(went, left)
    back(L, fixed, went)
    largest = 0.0
    for r in range(ROWS):
        if weights[r] > 0.0:
            g = G[r]
            for i in range(n):
                g[i] = columns[i, r]
            back(L, fixed, g)
            for s in range(r + 1):
                if weights[s] > 0.0:
                    total = 0.0
                    for i in range(n):
                        if fixed[i] != fixed[i]:
                            total += columns[i, s] * g[i]
                    S[r, s] = total
            largest = max(largest, S[r, r])
    # y of both parts
    for r in range(ROWS):
        if weights[r] > 0.0:
            given, free = e[r], 0.0
            for i in range(n):
                if fixed[i] == fixed[i]:
                    given -= columns[i, r] * fixed[i]
                else:
                    free -= columns[i, r] * went[i]
            y[r], work.sigma[r], wish.given[r] = given, free, given
    solve_rows_of(weights, S, SINGULAR * largest, y, work.sigma)
    promised, longest = 0.0, 0.0
    for i in range(n):
        if fixed[i] == fixed[i]:
            dq[i], went[i] = fixed[i], 0.0
        else:
            mend, along = 0.0, went[i]
            for r in range(ROWS):
                if weights[r] > 0.0:
                    mend += G[r, i] * y[r]
                    along += G[r, i] * work.sigma[r]
            dq[i], went[i] = mend, along
            mended += 2.0 * left[i] * mend
            promised += left[i] * along
            longest = max(longest, abs(mend))
    if longest > LONGEST_STEP:
        for i in range(n):
            if fixed[i] != fixed[i]:
                dq[i] *= LONGEST_STEP / longest
    for r in range(ROWS):
        if weights[r] > 0.0:
            mended += rho * e[r] * e[r] - wish.given[r] * y[r]
    longest = largest_component(went)
    part = radius / longest if longest > radius else 1.0
    for i in range(n):
        dq[i] += part * went[i]
    for r in range(ROWS):
        if weights[r] > 0.0:
            y[r] += work.sigma[r]
    gain = math.inf if damping > 0.0 else mended + HOPE * promised
    return gain, promised if damping == 0.0 else math.inf


@inlined
def factor_free(K, damping, least, fixed, L):
    """Write the factors L D L^T of K + damping I, over the joints that are not fixed, to the lower triangle of L, with
    the inverse of D on its diagonal; return False if a pivot is not above `least`."""
    n = len(fixed)
    for j in range(n):
        if fixed[j] == fixed[j]:
            continue
        pivot = K[j, j] + damping
        for k in range(j):
            if fixed[k] != fixed[k]:
                pivot -= L[j, k] * L[k, j]
        if not pivot > least:
            return False
        inverse = 1.0 / pivot
        L[j, j] = inverse
        for i in range(j + 1, n):
            s = K[i, j]
            for k in range(j):
                if fixed[k] != fixed[k]:
                    s -= L[i, k] * L[k, j]
            L[j, i] = s  # D L^T, above the diagonal
            L[i, j] = s * inverse
    return True


@inlined
def back(L, fixed, x):
    """Solve L D L^T x = rhs in place, over the joints that are not fixed."""
    n = len(x)
    for i in range(n):
        if fixed[i] != fixed[i]:
            s = x[i]
            for k in range(i):
                if fixed[k] != fixed[k]:
                    s -= L[i, k] * x[k]
            x[i] = s
    for i in range(n - 1, -1, -1):
        if fixed[i] != fixed[i]:
            s = x[i] * L[i, i]
            for k in range(i + 1, n):
                if fixed[k] != fixed[k]:
                    s -= L[k, i] * x[k]
            x[i] = s


@inlined
def solve_rows_of(weights, S, added, x, y):
    """Solve (S + added I) x = rhs in place for two right-hand sides, over the rows with a weight; S, given by its lower
    triangle, is overwritten by its factors."""
    for j in range(ROWS):
        if not weights[j] > 0.0:
            continue
        pivot = S[j, j] + added
        for k in range(j):
            if weights[k] > 0.0:
                pivot -= S[j, k] * S[k, j]
        inverse = 1.0 / pivot if pivot > 0.0 else 0.0
        S[j, j] = inverse
        for i in range(j + 1, ROWS):
            if weights[i] > 0.0:
                s = S[i, j]
                for k in range(j):
                    if weights[k] > 0.0:
                        s -= S[i, k] * S[k, j]
                S[j, i], S[i, j] = s, s * inverse
    for i in range(ROWS):
        if weights[i] > 0.0:
            for k in range(i):
                if weights[k] > 0.0:
                    x[i] -= S[i, k] * x[k]
                    y[i] -= S[i, k] * y[k]
    for i in range(ROWS - 1, -1, -1):
        if weights[i] > 0.0:
            x[i] *= S[i, i]
            y[i] *= S[i, i]
            for k in range(i + 1, ROWS):
                if weights[k] > 0.0:
                    x[i] -= S[k, i] * x[k]
                    y[i] -= S[k, i] * y[k]
