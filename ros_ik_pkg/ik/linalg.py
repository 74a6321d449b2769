"""The few small dense kernels that the steps need: a 6 x 6 Gram matrix, its Cholesky solve, an SVD of 6 x n.

At this size the call into LAPACK costs more than the arithmetic. Jacobians are stored by columns, as rows of
`columns` (n, 6); a row of the task that is dropped, or a joint that is frozen, is a row or column of zeros.
"""

from __future__ import annotations

import math

from ros_ik_pkg.ik.compiled import kernel

ROWS = 6
SINGULAR = 1e-14  # pivot over its diagonal element; less is what rounding leaves of zero
MAX_SWEEPS = 30
ORTHOGONAL = 1e-13  # cosine between two rows
ALMOST = 1e-6  # cosine that one more turn makes orthogonal
# The pairs of rows, three at a time that have none in common: the processor works on them side by side.
FIRST = (0, 2, 4, 0, 1, 3, 0, 1, 2, 0, 1, 2, 0, 1, 3)
SECOND = (1, 3, 5, 2, 4, 5, 3, 5, 4, 4, 3, 5, 5, 2, 4)
NOTHING = 1e-31  # square of a row over the square of all


@kernel
def assign(into, values):
    """Copy a vector; a slice assignment would ask for memory, in case the two overlap."""
    for i in range(len(into)):
        into[i] = values[i]


@kernel
def gram(columns, diagonal, A):
    """Write A = J J^T + diag(diagonal), (6, 6)."""
    for r in range(ROWS):
        for c in range(ROWS):
            A[r, c] = 0.0
        A[r, r] = diagonal[r]
    for i in range(len(columns)):
        for r in range(ROWS):
            x = columns[i, r]
            for c in range(ROWS):
                A[r, c] += x * columns[i, c]


@kernel
def cholesky_solve(A, b, y):
    """Solve A y = b for a positive definite A (6, 6), which is overwritten; return whether it was one."""
    for j in range(ROWS):
        d = A[j, j]
        rounding = SINGULAR * d
        for k in range(j):
            d -= A[j, k] * A[j, k]
        if not d > rounding:
            return False
        A[j, j] = 1.0 / math.sqrt(d)
        for i in range(j + 1, ROWS):
            s = A[i, j]
            for k in range(j):
                s -= A[i, k] * A[j, k]
            A[i, j] = s * A[j, j]
    for i in range(ROWS):
        s = b[i]
        for k in range(i):
            s -= A[i, k] * y[k]
        y[i] = s * A[i, i]
    for i in range(ROWS - 1, -1, -1):
        s = y[i]
        for k in range(i + 1, ROWS):
            s -= A[k, i] * y[k]
        y[i] = s * A[i, i]
    return True


@kernel
def svd(columns, U, W, sigma):
    """Write J = U diag(sigma) V^T with U (6, 6) by rows u_i, and W (6, n) with rows sigma_i v_i; sigma falls.

    One-sided Jacobi (Hestenes 1958): rows of J are turned in pairs until they are orthogonal. Small singular
    values come out to full relative precision, and any rank will do, 0 included.
    """
    n = len(columns)
    for r in range(ROWS):
        for i in range(n):
            W[r, i] = columns[i, r]
        for c in range(ROWS):
            U[r, c] = 1.0 if r == c else 0.0
    for _ in range(MAX_SWEEPS):
        if not _sweep(n, U, W, sigma) > ALMOST * ALMOST:  # the sweep that saw this left the square of it
            break
    for r in range(ROWS):
        sigma[r] = math.sqrt(_square(n, W, r))
    _sort(n, U, W, sigma)


@kernel
def _square(n, W, r):
    """Return the square of the length of a row."""
    square = 0.0
    for i in range(n):
        square += W[r, i] * W[r, i]
    return square


@kernel
def _sweep(n, U, W, squares):
    """Make every pair of rows of W orthogonal once; return the square of the largest cosine that there was.

    Rows whose square is below NOTHING of the whole are rounding: they would be turned for ever. `squares` (6,) keeps
    those of the rows up to date.
    """
    total, largest = 0.0, 0.0
    for r in range(ROWS):
        squares[r] = _square(n, W, r)
        total += squares[r]
    for k in range(len(FIRST)):
        a, b = FIRST[k], SECOND[k]
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
        for i in range(ROWS):
            x, y = U[a, i], U[b, i]
            U[a, i], U[b, i] = c * x - s * y, s * x + c * y
        squares[a], squares[b] = aa - t * ab, bb + t * ab
    return largest


@kernel
def _sort(n, U, W, sigma):
    """Order the six triplets by falling singular value."""
    for a in range(ROWS - 1):
        top = a
        for b in range(a + 1, ROWS):
            if sigma[b] > sigma[top]:
                top = b
        if top != a:
            sigma[a], sigma[top] = sigma[top], sigma[a]
            for i in range(n):
                W[a, i], W[top, i] = W[top, i], W[a, i]
            for i in range(ROWS):
                U[a, i], U[top, i] = U[top, i], U[a, i]
