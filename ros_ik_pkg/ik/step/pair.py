"""The dense kernels of the step rules for twelve rows, as loops over memory.

The 21 numbers of a triangle of six rows fit into registers (see `linalg.py`), the 78 of twelve rows do not.
"""

from __future__ import annotations

from ros_ik_pkg.ik.kernel.compiled import kernel, variant_of
from ros_ik_pkg.ik.kernel.linalg import SINGULAR
from ros_ik_pkg.ik.kernel.pair_layout import ROWS, PairWorkspace
from ros_ik_pkg.ik.step.methods import apply_transpose, damped_step, pairs_of, rows_of, solve_normal_equations

HALF = ROWS // 2
FIRST = tuple(a for a in range(ROWS) for _ in range(a + 1, ROWS))
SECOND = tuple(b for a in range(ROWS) for b in range(a + 1, ROWS))


@variant_of(rows_of, PairWorkspace)
def rows_of_pair(work):
    """Return how many rows both tasks have."""
    return ROWS


@variant_of(pairs_of, PairWorkspace)
def pairs_of_rows(work):
    """Return the pairs of rows that `svd_of_rows` makes orthogonal."""
    return FIRST, SECOND


@variant_of(damped_step, PairWorkspace)
def damped_step_of_pair(damping, work):
    """dq = J^T (J J^T + lambda^2 I)^-1 e over both tasks; return whether there is one."""
    write_gram(damping * damping, work)
    definite = factor_rows(work.A, work.sigma)
    substitute_rows(work.A, work.e, work.y)
    apply_transpose(ROWS, work.columns, work.y, work.dq)
    return definite


@variant_of(solve_normal_equations, PairWorkspace)
def solve_normal_equations_of_pair(work):
    """Write y of A y = rhs, with the lower triangle of A alone; return whether A is positive definite."""
    definite = factor_rows(work.A, work.sigma)
    substitute_rows(work.A, work.rhs, work.y)
    return definite


@kernel
def write_gram(added, work):
    """Write the lower triangle of J J^T to A, with `added` on the diagonal, or 1 for a row that is dropped."""
    A, columns = work.A, work.columns
    for r in range(ROWS):
        for c in range(r):
            A[r, c] = 0.0
        A[r, r] = added if work.weights[r] > 0.0 else 1.0
    for i in range(len(columns)):
        column = columns[i]
        # Most joints move only one tip, so only a quarter of their products is not zero.
        first = HALF if is_zero(column, 0) else 0
        last = HALF if is_zero(column, HALF) else ROWS
        for r in range(first, last):
            x = column[r]
            for c in range(first, r + 1):
                A[r, c] += x * column[c]


@kernel
def is_zero(column, first):
    """Return whether the six numbers from `first` on are zeros."""
    for r in range(first, first + HALF):
        if column[r] != 0.0:
            return False
    return True


@kernel
def factor_rows(A, pivots):
    """Write L and D of A = L D L^T over the lower triangle of A; return whether A is positive definite.

    `pivots` (12,) is scratch. The inverse of D is left on the diagonal.
    """
    definite = True
    for r in range(ROWS):
        whole = A[r, r]
        for c in range(r):
            s = A[r, c]
            for k in range(c):
                s -= pivots[k] * A[c, k]
            pivots[c] = s  # L[r, c] D[c]
        d = whole
        for c in range(r):
            scaled = pivots[c] * A[c, c]
            d -= scaled * pivots[c]
            A[r, c] = scaled
        definite = definite and d > SINGULAR * whole
        A[r, r] = 1.0 / d
    return definite


@kernel
def substitute_rows(A, b, y):
    """Write y of L D L^T y = b with what factor_rows left in A."""
    for r in range(ROWS):
        s = b[r]
        for c in range(r):
            s -= A[r, c] * y[c]
        y[r] = s
    for r in range(ROWS - 1, -1, -1):
        s = y[r] * A[r, r]
        for c in range(r + 1, ROWS):
            s -= A[c, r] * y[c]
        y[r] = s
