"""The small problems that closed forms are made of (Paden 1986, Kahan 1983; Elias and Wen 2025, IK-Geo).

Vectors are tuples of three numbers, rotations are about unit axes, and angles come from `atan2` alone, which is well
conditioned everywhere.
"""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.vectors import cross, dot

ROUNDS = 40  # of the iteration for four roots; ten are enough if no two of them coincide
SETTLED = 1e-28  # square of the last correction of roots of about 1
VANISHES = 1e-9  # length of what is rounding alone, of about 1


@inlined
def turn(axis, cosine, sine, v):
    """Return v rotated about the axis by the angle with this cosine and sine (Rodrigues)."""
    x = cross(axis, v)
    k = (1.0 - cosine) * dot(axis, v)
    return (
        cosine * v[0] + sine * x[0] + k * axis[0],
        cosine * v[1] + sine * x[1] + k * axis[1],
        cosine * v[2] + sine * x[2] + k * axis[2],
    )


@inlined
def component(h, axis, v):
    """Return (a, b, c) of h . R v = a + b cos + c sin, R being the rotation about the axis by the angle."""
    level = dot(h, axis) * dot(axis, v)
    return level, dot(h, v) - level, dot(h, cross(axis, v))


@inlined
def angle_onto(axis, v, target):
    """Return the angle about the axis that turns v into the half plane of `target`, and the distance from the axis of
    the nearer of the two: without any, every angle does."""
    x = cross(axis, v)
    y = cross(axis, target)
    sine, cosine = dot(x, target), dot(x, y)
    return math.atan2(sine, cosine), math.sqrt(min(dot(x, x), dot(y, y)))


@inlined
def two_angles(b, c, level, slack, free):
    """Return (count, first, second) of the angles with b cos + c sin = level.

    If the level is out of reach by no more than the slack, the angle that comes nearest counts as a double one. The
    count is -1 if every angle solves it, up to `free`.
    """
    length = math.sqrt(b * b + c * c)
    if length + abs(level) <= free + VANISHES:
        return -1, 0.0, 0.0
    if abs(level) > length + slack:
        return 0, 0.0, 0.0
    middle = math.atan2(c, b)
    apart = length * length - level * level
    if apart <= 0.0:
        return 1, (middle if level > 0.0 else middle + math.pi), 0.0
    half = math.atan2(math.sqrt(apart), level)
    return 2, middle + half, middle - half


@kernel
def four_angles(a0, a1, b1, a2, b2, slack, roots):
    """Write the angles t with a0 + a1 cos t + b1 sin t + a2 cos 2t + b2 sin 2t = 0 to `roots` (4,); return how many.

    With z = exp(i t) it is a polynomial of degree four, all roots of which are found at once (Aberth 1973). Those on
    the unit circle are the angles; one off the circle by no more than the slack comes from two that have just met.
    """
    c4, c3, c1, c0 = complex(a2, -b2), complex(a1, -b1), complex(a1, b1), complex(a2, b2)
    c2 = complex(2.0 * a0, 0.0)
    z0, z1, z2, z3 = complex(0.9, 0.4), complex(-0.5, 0.95), complex(-0.95, -0.45), complex(0.4, -1.05)
    for _ in range(ROUNDS):
        d0 = _shift(c4, c3, c2, c1, c0, z0, z1, z2, z3)
        d1 = _shift(c4, c3, c2, c1, c0, z1, z0 - d0, z2, z3)
        d2 = _shift(c4, c3, c2, c1, c0, z2, z0 - d0, z1 - d1, z3)
        d3 = _shift(c4, c3, c2, c1, c0, z3, z0 - d0, z1 - d1, z2 - d2)
        z0, z1, z2, z3 = z0 - d0, z1 - d1, z2 - d2, z3 - d3
        if _size(d0) + _size(d1) + _size(d2) + _size(d3) < SETTLED:
            break
    count = 0
    for z in (z0, z1, z2, z3):
        off = z.real * z.real + z.imag * z.imag - 1.0
        if abs(off) <= 2.0 * slack:
            roots[count] = math.atan2(z.imag, z.real)
            count += 1
    return count


@inlined
def _shift(c4, c3, c2, c1, c0, z, u, v, w):
    """Return by how much Aberth's iteration takes off a root, given the three others."""
    value = (((c4 * z + c3) * z + c2) * z + c1) * z + c0
    slope = ((4.0 * c4 * z + 3.0 * c3) * z + 2.0 * c2) * z + c1
    a, b, c = z - u, z - v, z - w
    # 1 / a + 1 / b + 1 / c with one division; multiplied out, so that two roots that coincide do no harm
    product = a * b * c
    divisor = slope * product - value * (a * b + b * c + c * a)
    size = _size(divisor)
    if not size > 0.0:
        return complex(0.0, 0.0)
    numerator = value * product * complex(divisor.real, -divisor.imag)
    return complex(numerator.real / size, numerator.imag / size)


@inlined
def _size(z):
    """Return the square of the absolute value."""
    return z.real * z.real + z.imag * z.imag
