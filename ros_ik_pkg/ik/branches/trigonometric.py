"""Trigonometric polynomials of degree eight: from samples to coefficients, and to all roots."""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel

DEGREE = 8
SAMPLES = 2 * DEGREE + 1
ROOTS = 2 * DEGREE
COSINES, SINES = (f(2.0 * np.pi * np.arange(SAMPLES) / SAMPLES) for f in (np.cos, np.sin))
ROUNDS = 50  # of the iteration for all roots; eight are enough if no two of them coincide
SETTLED = 1e-26  # square of a correction of a root of about 1
ROUNDING = 4e-16  # of a value of the polynomial, per sum of its terms
FARTHEST = 1e4  # square of the absolute value up to which roots are followed: the degree may be lower


@kernel
def to_coefficients(samples, c):
    """Write the coefficients c_k (SAMPLES, 2), real and imaginary parts from k = -8 to 8, of the sum of c_k exp(i k t)
    with these values (SAMPLES,) at t = 2 pi j / SAMPLES."""
    for k in range(DEGREE + 1):
        real, imaginary = 0.0, 0.0
        for j in range(SAMPLES):
            place = k * j % SAMPLES
            real += samples[j] * COSINES[place]
            imaginary -= samples[j] * SINES[place]
        c[DEGREE + k, 0], c[DEGREE + k, 1] = real / SAMPLES, imaginary / SAMPLES
        c[DEGREE - k, 0], c[DEGREE - k, 1] = real / SAMPLES, -imaginary / SAMPLES


@kernel
def value_and_slope(c, cosine, sine):
    """Return the value at an angle, and the derivative."""
    value, slope, x, y = c[DEGREE, 0], 0.0, 1.0, 0.0
    for k in range(1, DEGREE + 1):
        x, y = x * cosine - y * sine, x * sine + y * cosine
        value += 2.0 * (c[DEGREE + k, 0] * x - c[DEGREE + k, 1] * y)
        slope -= 2.0 * k * (c[DEGREE + k, 0] * y + c[DEGREE + k, 1] * x)
    return value, slope


@kernel
def to_roots(c, roots):
    """Write the 16 roots z = exp(i t), real and imaginary parts, to `roots` (16, 2): those on the unit circle belong to
    real angles. All are found at once (Aberth 1973)."""
    total = 0.0
    for m in range(SAMPLES):
        total += abs(c[m, 0]) + abs(c[m, 1])
    for k in range(ROOTS):
        angle, radius = 2.0 * math.pi * (k + 0.3) / ROOTS, 0.8 if k % 2 else 1.2
        roots[k, 0], roots[k, 1] = radius * math.cos(angle), radius * math.sin(angle)
    for _ in range(ROUNDS):
        largest = 0.0
        for k in range(ROOTS):
            x, y = roots[k, 0], roots[k, 1]
            dx, dy = _correction(c, roots, k, x, y, ROUNDING * total)
            square, shift = x * x + y * y, dx * dx + dy * dy
            x, y = x - dx, y - dy
            size = x * x + y * y
            if not size <= FARTHEST:
                scale = math.sqrt(FARTHEST / size) if size < math.inf else 0.0
                x, y, shift = scale * x, scale * y, 0.0
            roots[k, 0], roots[k, 1] = x, y
            largest = max(largest, shift / (1.0 + square))
        if largest < SETTLED:
            break


@inlined
def _correction(c, roots, k, x, y, rounding):
    """Return what Aberth's iteration takes off the root x + i y, number k."""
    px, py, sx, sy = c[SAMPLES - 1, 0], c[SAMPLES - 1, 1], 0.0, 0.0
    for m in range(SAMPLES - 2, -1, -1):
        sx, sy = sx * x - sy * y + px, sx * y + sy * x + py
        px, py = px * x - py * y + c[m, 0], px * y + py * x + c[m, 1]
    square = x * x + y * y
    power = square * square
    power *= power  # |z|^8
    if px * px + py * py <= (rounding * max(1.0, power * power)) ** 2:
        return 0.0, 0.0
    ax, ay = 0.0, 0.0  # the sum of 1 / (z - other root)
    for j in range(ROOTS):
        dx, dy = x - roots[j, 0], y - roots[j, 1]
        inverse = 1.0 / (dx * dx + dy * dy) if j != k else 0.0
        if inverse < math.inf:
            ax += dx * inverse
            ay -= dy * inverse
    # p / (p' - p a)
    bx, by = sx - (px * ax - py * ay), sy - (px * ay + py * ax)
    size = bx * bx + by * by
    if not size > 0.0:
        return 0.0, 0.0
    return (px * bx + py * by) / size, (py * bx - px * by) / size
