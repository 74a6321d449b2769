"""Gaussian elimination for the resultant of any_axes.py: 8 unknowns of 14 equations, and determinants of 12 rows."""

from __future__ import annotations

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel

UNKNOWNS = 8
SIZE = 12
HALF = SIZE // 2
THIRD = 3  # columns that the lower half of the rows does not have
VANISHED = 1e-18  # of a pivot of rows of about 1


@kernel
def eliminate(equations, order):
    """Eliminate the first 8 columns of equations (14, columns) with full pivoting: rows from the 8th on are free of
    them; return the ratio of the least pivot to the largest. `order` receives which unknown is in which column."""
    rows, columns = equations.shape
    least, largest = 0.0, 0.0
    for k in range(UNKNOWNS):
        order[k] = k
    for k in range(UNKNOWNS):
        row, column, size = k, k, 0.0
        for i in range(k, rows):
            for j in range(k, UNKNOWNS):
                if abs(equations[i, j]) > size:
                    row, column, size = i, j, abs(equations[i, j])
        largest = size if k == 0 else largest
        least = size
        if not size > 0.0:
            return 0.0
        swap_rows(equations, k, row, columns)
        if column != k:
            for i in range(rows):
                equations[i, k], equations[i, column] = equations[i, column], equations[i, k]
            order[k], order[column] = order[column], order[k]
        inverse = 1.0 / equations[k, k]
        for i in range(k + 1, rows):
            factor = equations[i, k] * inverse
            for j in range(k + 1, columns):
                equations[i, j] -= factor * equations[k, j]
    return least / largest


@kernel
def back_substitute(equations, order, right, unknowns):
    """Write the 8 unknowns of the first 8 rows that `eliminate` left, for right sides (8,), which are overwritten."""
    for k in range(UNKNOWNS - 1, -1, -1):
        value = right[k]
        for j in range(k + 1, UNKNOWNS):
            value -= equations[k, j] * right[j]
        right[k] = value / equations[k, k]
        unknowns[int(order[k])] = right[k]


@kernel
def factor_rows(A, order):
    """Factor A (12, 12), of which the lower six rows begin with three zeros, with pivots in columns; return the
    determinant. `order` receives which row was exchanged for which."""
    determinant = 1.0
    for k in range(SIZE):
        bottom = HALF if k < THIRD else SIZE
        row, size = k, abs(A[k, k])
        for i in range(k + 1, bottom):
            if abs(A[i, k]) > size:
                row, size = i, abs(A[i, k])
        order[k] = row
        if row != k:
            swap_rows(A, k, row, SIZE)
            determinant = -determinant
        determinant *= A[k, k]
        if size < VANISHED:
            A[k, k] = VANISHED
        inverse = 1.0 / A[k, k]
        for i in range(k + 1, bottom):
            factor = A[i, k] * inverse
            A[i, k] = factor
            for j in range(k + 1, SIZE):
                A[i, j] -= factor * A[k, j]
    return determinant


@kernel
def substitute_rows(A, order, v):
    """Overwrite v (12,) with the solution y of A y = v, from what `factor_rows` left, scaled to a largest component of
    1; return the scale."""
    for k in range(SIZE):
        row = int(order[k])
        v[k], v[row] = v[row], v[k]
    for k in range(SIZE):
        for i in range(k + 1, SIZE):
            v[i] -= A[i, k] * v[k]
    largest = 0.0
    for k in range(SIZE - 1, -1, -1):
        for j in range(k + 1, SIZE):
            v[k] -= A[k, j] * v[j]
        v[k] /= A[k, k]
        largest = max(largest, abs(v[k]))
    for k in range(SIZE):
        v[k] /= largest
    return 1.0 / largest


@inlined
def swap_rows(A, a, b, columns):
    """Exchange two rows."""
    if a != b:
        for j in range(columns):
            A[a, j], A[b, j] = A[b, j], A[a, j]
