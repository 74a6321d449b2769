"""Sine and cosine of eight angles in the time of one libm call, with the same bits on every machine.

Argument reduction in three parts (Cody and Waite 1980) and the polynomials of fdlibm (`k_sin.c`, `k_cos.c`);
within 2e-16 of libm up to LARGE; beyond that, libm computes them.
"""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.numba_insides import on_its_own

LARGE = 1e5
BLOCK = 8  # angles
TWO_OVER_PI = 0.6366197723675814
# pi/2 in parts of 33 bits: n * part is exact for the n that occur
PART_1 = 1.57079632673412561417e00
PART_2 = 6.07710050630396597660e-11
PART_3 = 2.02226624879595063154e-21
# sin r = r + r^3 (S0 + S1 r^2 + ...), cos r = 1 - r^2 / 2 + r^4 (C0 + C1 r^2 + ...) for |r| <= pi/4
S = (
    -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
    2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10,
)  # fmt: skip
C = (
    4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
    -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11,
)  # fmt: skip


@inlined
def reduce_angle(x):
    """Return (k, x - k pi/2) [rad] for the nearest multiple of a quarter turn."""
    quarter = math.floor(x * TWO_OVER_PI + 0.5)
    return quarter, ((x - quarter * PART_1) - quarter * PART_2) - quarter * PART_3


@inlined
def sincos_of_rest(r):
    """Return (sin r, cos r) for |r| <= pi/4 [rad]."""
    z = r * r
    sine = r + r * z * (S[0] + z * (S[1] + z * (S[2] + z * (S[3] + z * (S[4] + z * S[5])))))
    cosine = 1.0 - 0.5 * z + z * z * (C[0] + z * (C[1] + z * (C[2] + z * (C[3] + z * (C[4] + z * C[5])))))
    return sine, cosine


@inlined
def sincos(x):
    """Return (sin x, cos x) of an angle below LARGE [rad]; without branches, so that the compiler can vectorise it."""
    quarter, r = reduce_angle(x)
    sine, cosine = sincos_of_rest(r)
    turn = int(quarter)
    sine, cosine = (cosine, sine) if turn & 1 else (sine, cosine)
    return -sine if turn & 2 else sine, -cosine if (turn + 1) & 2 else cosine


@kernel
def sincos_all(angles, sines, cosines):
    """Write sine and cosine of angles [rad], in whole blocks: as many at once as a register holds."""
    on_its_own()
    near = True
    for i in range(len(angles)):
        near = near and abs(angles[i]) < LARGE
    if near:
        for i in range(len(angles)):
            sines[i], cosines[i] = sincos(angles[i])
    else:
        for i in range(len(angles)):
            sines[i], cosines[i] = math.sin(angles[i]), math.cos(angles[i])
