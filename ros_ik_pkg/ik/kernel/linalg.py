"""The few small dense kernels that the steps need: a 6 x 6 Gram matrix, its factors, an SVD of 6 x n.

At this size a call of LAPACK costs more than the arithmetic. Jacobians are stored by columns, as rows of
`columns` (n, 6); a row of the task that is dropped, or a joint that is frozen, is a row or column of zeros.
"""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel

ROWS = 6
SINGULAR = 1e-14  # pivot over its diagonal element, below which the matrix counts as singular
MAX_SWEEPS = 30
ORTHOGONAL = 1e-13  # cosine between two rows
ALMOST = 1e-6  # cosine that one rotation reduces to rounding
# The pairs of rows, three disjoint ones at a time, so that the processor computes them in parallel.
FIRST = (0, 2, 4, 0, 1, 3, 0, 1, 2, 0, 1, 2, 0, 1, 3)
SECOND = (1, 3, 5, 2, 4, 5, 3, 5, 4, 4, 3, 5, 5, 2, 4)
NOTHING = 1e-31  # square of a row over the square of all


@kernel
def assign(into, values):
    """Copy a vector; a slice assignment would allocate memory in case the two overlap."""
    for i in range(len(into)):
        into[i] = values[i]


@inlined
def fill(into, value):
    """Set every number of a vector."""
    for i in range(len(into)):
        into[i] = value


@inlined
def gram(columns, diagonal):
    """Return the lower triangle of J J^T + diag(diagonal), its 21 numbers row by row.

    They are written out, here and below, to stay in registers: the compiler cannot tell whether two arrays overlap, so
    with arrays it would store and load every sum.
    """
    a00, a11, a22, a33, a44, a55 = diagonal
    a10 = a20 = a21 = a30 = a31 = a32 = a40 = a41 = a42 = a43 = a50 = a51 = a52 = a53 = a54 = 0.0
    for i in range(len(columns)):
        x, y, z, u, v, w = columns[i, 0], columns[i, 1], columns[i, 2], columns[i, 3], columns[i, 4], columns[i, 5]
        a00, a10, a20, a30, a40, a50 = a00 + x * x, a10 + x * y, a20 + x * z, a30 + x * u, a40 + x * v, a50 + x * w
        a11, a21, a31, a41, a51 = a11 + y * y, a21 + y * z, a31 + y * u, a41 + y * v, a51 + y * w
        a22, a32, a42, a52 = a22 + z * z, a32 + z * u, a42 + z * v, a52 + z * w
        a33, a43, a53 = a33 + u * u, a43 + u * v, a53 + u * w
        a44, a54, a55 = a44 + v * v, a54 + v * w, a55 + w * w
    return (
        a00, a10, a11, a20, a21, a22, a30, a31, a32, a33, a40, a41, a42, a43, a44, a50, a51, a52, a53, a54, a55,
    )  # fmt: skip


@inlined
def lower_triangle(A):
    """Return the lower triangle of a symmetric A (6, 6), row by row."""
    return (
        A[0, 0], A[1, 0], A[1, 1], A[2, 0], A[2, 1], A[2, 2], A[3, 0], A[3, 1], A[3, 2], A[3, 3], A[4, 0], A[4, 1],
        A[4, 2], A[4, 3], A[4, 4], A[5, 0], A[5, 1], A[5, 2], A[5, 3], A[5, 4], A[5, 5],
    )  # fmt: skip


@inlined
def factor(a):
    """Return (definite, L, pivots, inverses) with A = L diag(pivots) L^T, unit lower triangular L (15 numbers row by
    row) and the inverses of the pivots.

    `a` is a lower triangle (21). If A is not positive definite, `definite` is False and the rest is meaningless. Unlike
    Cholesky's factors these need no square roots.
    """
    a00, a10, a11, a20, a21, a22, a30, a31, a32, a33, a40, a41, a42, a43, a44, a50, a51, a52, a53, a54, a55 = a
    f0 = 1.0 / a00
    l10, l20, l30, l40, l50 = f0 * a10, f0 * a20, f0 * a30, f0 * a40, f0 * a50
    d1 = a11 - l10 * a10
    b21, b31, b41, b51 = a21 - l20 * a10, a31 - l30 * a10, a41 - l40 * a10, a51 - l50 * a10
    f1 = 1.0 / d1
    l21, l31, l41, l51 = f1 * b21, f1 * b31, f1 * b41, f1 * b51
    d2 = a22 - l20 * a20 - l21 * b21
    b32 = a32 - l30 * a20 - l31 * b21
    b42 = a42 - l40 * a20 - l41 * b21
    b52 = a52 - l50 * a20 - l51 * b21
    f2 = 1.0 / d2
    l32, l42, l52 = f2 * b32, f2 * b42, f2 * b52
    d3 = a33 - l30 * a30 - l31 * b31 - l32 * b32
    b43 = a43 - l40 * a30 - l41 * b31 - l42 * b32
    b53 = a53 - l50 * a30 - l51 * b31 - l52 * b32
    f3 = 1.0 / d3
    l43, l53 = f3 * b43, f3 * b53
    d4 = a44 - l40 * a40 - l41 * b41 - l42 * b42 - l43 * b43
    b54 = a54 - l50 * a40 - l51 * b41 - l52 * b42 - l53 * b43
    f4 = 1.0 / d4
    l54 = f4 * b54
    d5 = a55 - l50 * a50 - l51 * b51 - l52 * b52 - l53 * b53 - l54 * b54
    # `&`, not `and`: the numbers may be Wide (kernel/wide.py)
    definite = (a00 > 0.0) & (d1 > SINGULAR * a11) & (d2 > SINGULAR * a22)
    definite = definite & (d3 > SINGULAR * a33) & (d4 > SINGULAR * a44) & (d5 > SINGULAR * a55)
    lower = (l10, l20, l21, l30, l31, l32, l40, l41, l42, l43, l50, l51, l52, l53, l54)
    return definite, lower, (a00, d1, d2, d3, d4, d5), (f0, f1, f2, f3, f4, 1.0 / d5)


@inlined
def substitute(lower, inverses, b):
    """Return y (6 numbers) of L D L^T y = b, with the inverses of the pivots D."""
    l10, l20, l21, l30, l31, l32, l40, l41, l42, l43, l50, l51, l52, l53, l54 = lower
    y0 = b[0]
    y1 = b[1] - l10 * y0
    y2 = b[2] - l20 * y0 - l21 * y1
    y3 = b[3] - l30 * y0 - l31 * y1 - l32 * y2
    y4 = b[4] - l40 * y0 - l41 * y1 - l42 * y2 - l43 * y3
    y5 = b[5] - l50 * y0 - l51 * y1 - l52 * y2 - l53 * y3 - l54 * y4
    y5 = y5 * inverses[5]
    y4 = y4 * inverses[4] - l54 * y5
    y3 = y3 * inverses[3] - l43 * y4 - l53 * y5
    y2 = y2 * inverses[2] - l32 * y3 - l42 * y4 - l52 * y5
    y1 = y1 * inverses[1] - l21 * y2 - l31 * y3 - l41 * y4 - l51 * y5
    y0 = y0 * inverses[0] - l10 * y1 - l20 * y2 - l30 * y3 - l40 * y4 - l50 * y5
    return y0, y1, y2, y3, y4, y5


@kernel
def svd(columns, U, W, sigma):
    """Write the SVD of six rows; see svd_of_rows."""
    svd_of_rows(ROWS, (FIRST, SECOND), columns, U, W, sigma)


@kernel
def svd_of_rows(rows, pairs, columns, U, W, sigma):
    """Write J = U diag(sigma) V^T with U (rows, rows) by rows u_i, and W (rows, n) with rows sigma_i v_i; sigma falls.

    One-sided Jacobi (Hestenes 1958): rows of J are rotated in pairs until they are orthogonal. Small singular values
    have full relative precision, and J may have any rank, 0 included.
    """
    n = len(columns)
    for r in range(rows):
        for i in range(n):
            W[r, i] = columns[i, r]
        for c in range(rows):
            U[r, c] = 1.0 if r == c else 0.0
    for _ in range(MAX_SWEEPS):
        if not _sweep(rows, pairs, n, U, W, sigma) > ALMOST * ALMOST:  # a sweep squares the cosines
            break
    for r in range(rows):
        sigma[r] = math.sqrt(_square(n, W, r))
    _sort(rows, n, U, W, sigma)


@kernel
def _square(n, W, r):
    """Return the square of the length of a row."""
    square = 0.0
    for i in range(n):
        square += W[r, i] * W[r, i]
    return square


@kernel
def _sweep(rows, pairs, n, U, W, squares):
    """Rotate each pair of rows of W once to make it orthogonal; return the square of the largest cosine before.

    Rows whose square is below NOTHING times the sum are rounding and would never become orthogonal. `squares` (rows,)
    holds the squares of the rows.
    """
    total, largest = 0.0, 0.0
    for r in range(rows):
        squares[r] = _square(n, W, r)
        total += squares[r]
    first, second = pairs
    for k in range(len(first)):
        a, b = first[k], second[k]
        aa, bb, ab = squares[a], squares[b], 0.0
        for i in range(n):
            ab += W[a, i] * W[b, i]
        if aa <= NOTHING * total or bb <= NOTHING * total or not ab * ab > ORTHOGONAL * ORTHOGONAL * aa * bb:
            continue
        largest = max(largest, ab * ab / (aa * bb))
        gap = 0.5 * (bb - aa)
        t = ab / (gap + math.copysign(math.sqrt(gap * gap + ab * ab), gap))
        c = 1.0 / math.sqrt(1.0 + t * t)
        s = c * t
        for i in range(n):
            x, y = W[a, i], W[b, i]
            W[a, i], W[b, i] = c * x - s * y, s * x + c * y
        for i in range(rows):
            x, y = U[a, i], U[b, i]
            U[a, i], U[b, i] = c * x - s * y, s * x + c * y
        squares[a], squares[b] = aa - t * ab, bb + t * ab
    return largest


@kernel
def _sort(rows, n, U, W, sigma):
    """Order the triplets by falling singular value."""
    for a in range(rows - 1):
        top = a
        for b in range(a + 1, rows):
            if sigma[b] > sigma[top]:
                top = b
        if top != a:
            sigma[a], sigma[top] = sigma[top], sigma[a]
            for i in range(n):
                W[a, i], W[top, i] = W[top, i], W[a, i]
            for i in range(rows):
                U[a, i], U[top, i] = U[top, i], U[a, i]
