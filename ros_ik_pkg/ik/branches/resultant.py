"""The determinant of any_axes.py at an angle of joint 2, and what its matrix takes to nothing."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik.branches.elimination import SIZE, UNKNOWNS, factor_rows, substitute_rows
from ros_ik_pkg.ik.branches.trigonometric import ROOTS, SAMPLES
from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.linalg import fill
from ros_ik_pkg.ik.kernel.numba_insides import shaped

EQUATIONS = 14
PRODUCTS = 9  # of (cos, sin, 1) of one angle and of another; with tangents, of (x^2, x, 1)
BLOCKS = 3  # of the right sides: factors of the cosine and the sine of joint 2, and of 1
COLUMNS = UNKNOWNS + BLOCKS * PRODUCTS
TABLES = EQUATIONS * (COLUMNS + 2 * PRODUCTS)
MEMORY = TABLES + SIZE * (SIZE + 3) + SAMPLES * 3 + 2 * ROOTS + UNKNOWNS * 3
TOGETHER = 1e-3  # between two roots that are one
UNEQUAL = 1e-12  # square of the difference of two tangents, to their squares, from which on they differ
LONGEST = 0.1  # rad: correction of an angle


class Resultant(NamedTuple):
    """The equations of one pose, and room to solve them."""

    equations: np.ndarray  # (14, COLUMNS)
    left: np.ndarray  # (9, 14) coefficients of joints 1 and 6
    right: np.ndarray  # (9, 14) of joints 3 and 4
    A: np.ndarray  # (12, 12)
    rows: np.ndarray  # (12,) order of its rows
    v: np.ndarray  # (12,) what it takes to nothing
    w: np.ndarray  # (12,) the same, if there are two such vectors
    samples: np.ndarray  # (17,) of the determinant
    c: np.ndarray  # (17, 2) its coefficients
    roots: np.ndarray  # (16, 2)
    unknowns: np.ndarray  # (3, 8) order of the products of joints 1 and 6, their right sides, and their values


@inlined
def make_resultant(memory):
    """Return a Resultant in a block of memory."""
    a = EQUATIONS * COLUMNS
    b = TABLES + SIZE * SIZE
    c = b + 3 * SIZE
    d = c + 3 * SAMPLES
    return Resultant(
        shaped(memory, 0, (EQUATIONS, COLUMNS)), shaped(memory, a, (PRODUCTS, EQUATIONS)),
        shaped(memory, a + PRODUCTS * EQUATIONS, (PRODUCTS, EQUATIONS)), shaped(memory, TABLES, (SIZE, SIZE)),
        shaped(memory, b, (SIZE,)), shaped(memory, b + SIZE, (SIZE,)), shaped(memory, b + 2 * SIZE, (SIZE,)),
        shaped(memory, c, (SAMPLES,)), shaped(memory, c + SAMPLES, (SAMPLES, 2)), shaped(memory, d, (ROOTS, 2)),
        shaped(memory, d + 2 * ROOTS, (3, UNKNOWNS)),
    )  # fmt: skip


@inlined
def _write_matrix(made, cosine, sine, one):
    """Write cosine, sine and one times their blocks of the last six equations to A, twice: times x, and as they are."""
    A, equations = made.A, made.equations
    for r in range(6):
        for j in range(3):
            A[r, PRODUCTS + j], A[6 + r, j] = 0.0, 0.0
        for j in range(PRODUCTS):
            column = UNKNOWNS + j
            value = cosine * equations[UNKNOWNS + r, column] + sine * equations[UNKNOWNS + r, column + PRODUCTS]
            value += one * equations[UNKNOWNS + r, column + 2 * PRODUCTS]
            A[r, j], A[6 + r, 3 + j] = value, value


@kernel
def determinant(made, cosine, sine):
    """Return the determinant at an angle of joint 2, and leave A factored."""
    _write_matrix(made, cosine, sine, 1.0)
    return factor_rows(made.A, made.rows)


@kernel
def keeps_away(made, angle, off):
    """Return whether the determinant, near an angle, is that of two roots which are `off` the unit circle.

    Then it is a parabola that has ten times its least value at three times `off`.
    """
    least = determinant(made, math.cos(angle), math.sin(angle))
    for side in (-3.0, 3.0):
        value = determinant(made, math.cos(angle + side * off), math.sin(angle + side * off))
        if not 5.0 < value / least < 20.0:
            return False
    return True


@kernel
def null_vectors(made, angle):
    """Write what A takes to nothing at an angle of joint 2 to v, and the next best vector across it to w; return how
    long A leaves w."""
    v, w = made.v, made.w
    determinant(made, math.cos(angle), math.sin(angle))
    fill(v, 1.0)
    for i in range(SIZE):
        w[i] = (i * 7 % SIZE) / SIZE - 0.4
    for _ in range(2):
        substitute_rows(made.A, made.rows, v)
    left = 0.0
    for _ in range(2):
        _straighten(v, w)
        left = substitute_rows(made.A, made.rows, w)
    _straighten(v, w)
    return left


@inlined
def _straighten(v, w):
    """Take the part along v off w."""
    part = _inner(v, w, 0, 0, SIZE) / _inner(v, v, 0, 0, SIZE)
    for i in range(SIZE):
        w[i] -= part * v[i]


@inlined
def _inner(a, b, first, second, count):
    """Return the inner product of `count` numbers of a and b, from the first and the second on."""
    total = 0.0
    for i in range(count):
        total += a[first + i] * b[second + i]
    return total


@kernel
def middle_of(made, root):
    """Return the angle between a root and the nearest other one, and the number of that: its own if none is near."""
    roots, partner, least = made.roots, root, TOGETHER
    for k in range(ROOTS):
        gap = math.hypot(roots[k, 0] - roots[root, 0], roots[k, 1] - roots[root, 1])
        if k != root and gap < least:
            partner, least = k, gap
    return math.atan2(roots[root, 1] + roots[partner, 1], roots[root, 0] + roots[partner, 0]), partner


@kernel
def tell_apart(v, w):
    """Turn two vectors that span the solutions of A into the two solutions; return how many are real.

    A solution has x times the same numbers three places further up, so x is an eigenvalue of a matrix (2, 2); or 1 / x
    is, if x is large.
    """
    low, high = 3, 0
    a, b, c = _inner(v, v, 3, 3, PRODUCTS), _inner(v, w, 3, 3, PRODUCTS), _inner(w, w, 3, 3, PRODUCTS)
    d, e, f = _inner(v, v, 0, 0, PRODUCTS), _inner(v, w, 0, 0, PRODUCTS), _inner(w, w, 0, 0, PRODUCTS)
    if d * f - e * e > a * c - b * b:
        low, high, a, b, c = 0, 3, d, e, f
    vv, vw = _inner(v, v, low, high, PRODUCTS), _inner(v, w, low, high, PRODUCTS)
    wv, ww = _inner(w, v, low, high, PRODUCTS), _inner(w, w, low, high, PRODUCTS)
    area = a * c - b * b
    p, q = (c * vv - b * wv) / area, (c * vw - b * ww) / area
    r, s = (a * wv - b * vv) / area, (a * ww - b * vw) / area
    half, square = 0.5 * (p + s), 0.25 * (p - s) * (p - s) + q * r
    if not square > UNEQUAL * (p * p + s * s):
        return 0 if square < -UNEQUAL * (p * p + s * s) else 2
    root = math.sqrt(square)
    first, second = half + root, half - root
    for i in range(SIZE):
        one, other = v[i], w[i]
        if abs(q) > abs(r):  # eigenvectors (q, x - p), else (x - s, r)
            v[i], w[i] = q * one + (first - p) * other, q * one + (second - p) * other
        else:
            v[i], w[i] = (first - s) * one + r * other, (second - s) * one + r * other
    return 2


@kernel
def correction(made, angle):
    """Return by how much an angle is too large for A to take v to nothing, by Newton's method with one component of v
    kept."""
    v, A, equations = made.v, made.A, made.equations
    cosine, sine = math.cos(angle), math.sin(angle)
    top = 0
    for i in range(SIZE):
        top = i if abs(v[i]) > abs(v[top]) else top
    kept = v[top]
    image = made.samples  # is free by now
    for r in range(6):
        upper, lower = 0.0, 0.0
        for j in range(PRODUCTS):
            column = UNKNOWNS + j
            change = cosine * equations[UNKNOWNS + r, column + PRODUCTS] - sine * equations[UNKNOWNS + r, column]
            upper += change * v[j]
            lower += change * v[3 + j]
        image[r], image[6 + r] = upper, lower
    for i in range(SIZE):
        v[i] = image[i]
    scale = substitute_rows(A, made.rows, v)
    step = scale * kept / v[top] if v[top] != 0.0 else 0.0
    return step if abs(step) < LONGEST else 0.0
