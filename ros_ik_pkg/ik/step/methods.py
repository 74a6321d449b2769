"""The compiled step rules of the methods, and the one function that selects among them.

Each rule reads the Jacobian's columns and the weighted error from the workspace, writes the joint step dq and
returns its damping. A frozen joint is a column of zeros, for which every rule returns dq = 0. A rule that
finds no finite step returns NaN.
"""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.linalg import (
    FIRST,
    ROWS,
    SECOND,
    assign,
    factor,
    gram,
    lower_triangle,
    substitute,
    svd_of_rows,
)
from ros_ik_pkg.methods import METHODS

TRANSPOSE, DLS, ADAPTIVE_DLS, SDLS = (METHODS.index(name) for name in ('transpose', 'dls', 'adaptive_dls', 'sdls'))
RANK_TOLERANCE = 1e-10  # singular values below this are zeros to sdls
TINY = 1e-300


@inlined
def take_step(tuning, error_norm, work):
    """Write the step of the selected method to work.dq and return its damping; both are NaN if there is no step."""
    method = int(tuning.method)
    if method == TRANSPOSE:
        transpose_step(work)
        return 0.0
    if method == SDLS:
        sdls_step(tuning.sdls_max_step, work)
        return 0.0
    damping = 0.0
    if method == DLS:
        damping = tuning.dls_damping
    elif method == ADAPTIVE_DLS:
        damping = max(tuning.adaptive_dls_damping, tuning.adaptive_dls_gain * error_norm)
    if damping == 0.0 and fewer_joints_than_rows(work):
        found = normal_equations_step(work)
    else:
        found = damped_step(damping, work)
    if not found:
        work.dq[:] = math.nan
        return math.nan
    return damping


@inlined
def joint_step_cap(tuning, stride):
    """Return the cap on one joint's step [rad or m]: the option, or if it is 0 the method's own times `stride`."""
    if tuning.max_joint_step > 0.0:
        return tuning.max_joint_step
    return stride * tuning.step_cap


@inlined
def gradient(work):
    """Write J^T e to dq: the direction in which half the square of the error falls fastest."""
    apply_transpose(rows_of(work), work.columns, work.e, work.dq)


@inlined
def rows_of(work):
    """Return how many rows the task has, those that are dropped included."""
    return ROWS


@inlined
def pairs_of(work):
    """Return the pairs of rows that `svd_of_rows` makes orthogonal."""
    return FIRST, SECOND


@inlined
def apply_transpose(rows, columns, y, dq):
    """Write dq = J^T y."""
    for i in range(len(columns)):
        s = 0.0
        for r in range(rows):
            s += columns[i, r] * y[r]
        dq[i] = s


@inlined
def combine_rows(columns, y, dq):
    """Write dq = J^T y for six numbers y in registers."""
    a, b, c, d, e, f = y
    for i in range(len(columns)):
        dq[i] = (
            columns[i, 0] * a + columns[i, 1] * b + columns[i, 2] * c
            + columns[i, 3] * d + columns[i, 4] * e + columns[i, 5] * f
        )  # fmt: skip


@kernel
def transpose_step(work):
    """dq = alpha J^T e with alpha = <e, J J^T e> / |J J^T e|^2; zero if the denominator is zero."""
    gradient(work)
    top, bottom = 0.0, 0.0
    for r in range(rows_of(work)):
        s = 0.0
        for i in range(len(work.dq)):
            s += work.columns[i, r] * work.dq[i]
        top += work.e[r] * s
        bottom += s * s
    alpha = top / bottom if bottom > TINY else 0.0
    for i in range(len(work.dq)):
        work.dq[i] *= alpha


@inlined
def damped_step(damping, work):
    """dq = J^T (J J^T + lambda^2 I)^-1 e, the pseudoinverse step if lambda is 0; return whether there is one."""
    definite, lower, _, inverses = factor(gram(work.columns, diagonal(work.weights, damping * damping)))
    combine_rows(work.columns, substitute(lower, inverses, work.e), work.dq)
    return definite


@inlined
def solve_normal_equations(work):
    """Write y of A y = rhs, with the lower triangle of A alone; return whether A is positive definite."""
    definite, lower, _, inverses = factor(lower_triangle(work.A))
    assign(work.y, substitute(lower, inverses, work.rhs))
    return definite


@inlined
def diagonal(weights, added):
    """Return the terms added to the diagonal of J J^T: the damping, or 1 for a row that is dropped."""
    return (
        added if weights[0] > 0.0 else 1.0, added if weights[1] > 0.0 else 1.0, added if weights[2] > 0.0 else 1.0,
        added if weights[3] > 0.0 else 1.0, added if weights[4] > 0.0 else 1.0, added if weights[5] > 0.0 else 1.0,
    )  # fmt: skip


@kernel
def fewer_joints_than_rows(work):
    """Return whether fewer joints are free than the task has rows: then J J^T is singular and J^T J is not."""
    weights, columns = work.weights, work.columns
    rows, free = 0, 0
    for r in range(rows_of(work)):
        rows += weights[r] > 0.0
    for i in range(len(columns)):
        free += moves(rows_of(work), columns, i)
    return free < rows


@kernel
def moves(rows, columns, i):
    """Return whether joint i is in the system, that is, whether its column is not zero."""
    for r in range(rows):
        if columns[i, r] != 0.0:
            return True
    return False


@kernel
def normal_equations_step(work):
    """dq = (J^T J)^-1 J^T e over the free joints, fewer than rows; return whether there is one.

    Unused rows of the 6 x 6 system get a 1 on the diagonal.
    """
    A, columns, rows = work.A, work.columns, rows_of(work)
    rhs = work.rhs
    n, a = len(work.dq), 0
    for r in range(rows):
        rhs[r] = 0.0
        for c in range(rows):
            A[r, c] = 1.0 if r == c else 0.0
    for i in range(n):
        if not moves(rows, columns, i):
            continue
        b = 0
        for j in range(i + 1):
            if moves(rows, columns, j):
                s = 0.0
                for r in range(rows):
                    s += columns[i, r] * columns[j, r]
                A[a, b] = s
                b += 1
        for r in range(rows):
            rhs[a] += columns[i, r] * work.e[r]
        a += 1
    definite = solve_normal_equations(work)
    a = 0
    for i in range(n):
        work.dq[i] = 0.0
        if moves(rows, columns, i):
            work.dq[i] = work.y[a]
            a += 1
    return definite


@kernel
def sdls_step(max_step, work):
    """Selectively damped least squares (Buss & Kim 2005): every singular direction has its own bound.

    With J = U S V^T, target blocks l (position, orientation) and rho_lj = |column j of block l|:
    a_i = <u_i, e>, N_i = sum_l |u_il|, M_i = (1/s_i) sum_l sum_j |v_ji| rho_lj, gamma_i = min(1, N_i/M_i) gamma_max,
    dq = clamp(sum_i clamp((a_i/s_i) v_i, gamma_i), gamma_max), where clamp scales the largest component.
    """
    columns, U, W, dq = work.columns, work.U, work.W, work.dq
    n, rows = len(dq), rows_of(work)
    svd_of_rows(rows, pairs_of(work), columns, U, W, work.sigma)
    dq[:] = 0.0
    for i in range(rows):
        s = work.sigma[i]
        if not s > RANK_TOLERANCE:
            continue
        a, largest, M = 0.0, 0.0, 0.0
        for r in range(rows):
            a += U[i, r] * work.e[r]
        for j in range(n):
            v = abs(W[i, j]) / s
            largest = max(largest, v)
            M += v * _lengths(rows, columns, j) / s
        bound = min(1.0, _lengths(rows, U, i) / M) * max_step
        scale = a / s
        if abs(scale) * largest > bound:
            scale = math.copysign(bound / largest, scale)
        for j in range(n):
            dq[j] += scale * W[i, j] / s
    clamp_largest(dq, max_step)


@kernel
def _lengths(rows, matrix, i):
    """Return the sum of the Euclidean lengths of row i's position and orientation parts."""
    total = 0.0
    for r in range(0, rows, 3):
        x, y, z = matrix[i, r], matrix[i, r + 1], matrix[i, r + 2]
        total += math.sqrt(x * x + y * y + z * z)
    return total


@kernel
def clamp_largest(dq, bound):
    """Scale dq so that no component exceeds the bound."""
    largest = 0.0
    for i in range(len(dq)):
        largest = max(largest, abs(dq[i]))
    if largest > bound:
        for i in range(len(dq)):
            dq[i] *= bound / largest
