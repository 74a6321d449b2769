"""A certain lower bound of the distance between two convex bodies, by GJK.

A body is the convex hull of a few points, rounded by a radius. GJK (Gilbert, Johnson, Keerthi 1988) looks for the
point of the Minkowski difference A - B that is nearest to the origin. Its simplex only proposes directions: for every
direction v, the bodies are at least min v . (a - b) / |v| apart, and this number is the bound. So an error of the
simplex can make the bound too small, but never too large.
"""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel

MOST_STEPS = 24
CLOSE_ENOUGH = 1e-7  # [m] between bounds that count as one
ROUNDING = 1e-12  # [m]
FLAT = 1e-9  # [m] height below which a tetrahedron counts as flat
SCRATCH = 28  # numbers of workspace: 4 points of A - B, 4 of A, 4 weights


@kernel
def furthest(vertices, first, count, x, y, z):
    """Return which of `count` vertices (3, m), from `first` on, is furthest in a direction."""
    best, most = first, -math.inf
    for k in range(first, first + count):
        along = x * vertices[0, k] + y * vertices[1, k] + z * vertices[2, k]
        if along > most:
            best, most = k, along
    return best


@kernel
def corner(vertices, first, count, pose, x, y, z):
    """Return the point of a body that is furthest in a direction, both in the base frame; `pose` (12,) is the body's
    rotation row by row and position [m]."""
    k = furthest(
        vertices, first, count,
        pose[0] * x + pose[3] * y + pose[6] * z,
        pose[1] * x + pose[4] * y + pose[7] * z,
        pose[2] * x + pose[5] * y + pose[8] * z,
    )  # fmt: skip
    a, b, c = vertices[0, k], vertices[1, k], vertices[2, k]
    return (
        pose[0] * a + pose[1] * b + pose[2] * c + pose[9],
        pose[3] * a + pose[4] * b + pose[5] * c + pose[10],
        pose[6] * a + pose[7] * b + pose[8] * c + pose[11],
    )


@kernel
def hull_distance(vertices, first_a, count_a, pose_a, first_b, count_b, pose_b, clear, touch, guess, out, work):
    """Return (lower, upper) bounds of the distance of two hulls [m], both 0 if they overlap.

    It stops as soon as lower > `clear` or upper <= `touch`. `guess` (3,) is a first direction from B to A. `out` (6,)
    receives the best known nearest points of A and of B.
    """
    x, y, z = guess
    lower, upper, size = 0.0, math.inf, 0
    for _ in range(MOST_STEPS):
        length = math.sqrt(x * x + y * y + z * z)
        if not length > 0.0:
            return 0.0, 0.0
        ax, ay, az = corner(vertices, first_a, count_a, pose_a, -x, -y, -z)
        bx, by, bz = corner(vertices, first_b, count_b, pose_b, x, y, z)
        wx, wy, wz = ax - bx, ay - by, az - bz
        lower = max(lower, (x * wx + y * wy + z * wz) / length - ROUNDING)
        if lower > clear or upper - lower <= CLOSE_ENOUGH or known(work, size, wx, wy, wz):
            break
        put(work, size, wx, wy, wz, ax, ay, az)
        size = shrink(work, size + 1)
        x, y, z = combine(work, size, 0)
        near = math.sqrt(x * x + y * y + z * z)
        if size == 4 or near <= CLOSE_ENOUGH:
            return 0.0, 0.0
        upper = min(upper, near)
        if upper <= touch:
            break
    if size > 0:
        px, py, pz = combine(work, size, 12)
        x, y, z = combine(work, size, 0)
        out[0], out[1], out[2] = px, py, pz
        out[3], out[4], out[5] = px - x, py - y, pz - z
    return lower, upper


@kernel
def known(work, size, x, y, z):
    """Return whether a point of A - B is in the simplex already."""
    for k in range(size):
        if work[3 * k] == x and work[3 * k + 1] == y and work[3 * k + 2] == z:
            return True
    return False


@kernel
def put(work, k, x, y, z, ax, ay, az):
    """Write point k of the simplex, and the point of A that it comes from."""
    work[3 * k], work[3 * k + 1], work[3 * k + 2] = x, y, z
    work[12 + 3 * k], work[13 + 3 * k], work[14 + 3 * k] = ax, ay, az


@kernel
def combine(work, size, start):
    """Return the weighted sum of the simplex's points, of A - B (`start` 0) or of A (12)."""
    x, y, z = 0.0, 0.0, 0.0
    for k in range(size):
        weight = work[24 + k]
        x += weight * work[start + 3 * k]
        y += weight * work[start + 3 * k + 1]
        z += weight * work[start + 3 * k + 2]
    return x, y, z


@kernel
def shrink(work, size):
    """Drop the points that the simplex's nearest point to the origin does not need and write the weights of the
    others; return their number, 4 if the origin is inside."""
    if size == 1:
        work[24] = 1.0
        return 1
    if size == 2:
        a, b = on_segment(work, 0, 1)
        return keep(work, a, b, 0.0, 0, 1, 1)
    if size == 3:
        return keep_triangle(work, 0, 1, 2)
    return shrink_tetrahedron(work)


@kernel
def shrink_tetrahedron(work):
    """Implement `shrink` for four points, by the nearest of the faces that have the origin on their outer side."""
    nearest, best = math.inf, -1
    for face in range(4):
        i, j, k, opposite = face_of(face)
        if beyond(work, i, j, k, opposite):
            a, b, c = on_triangle(work, i, j, k)
            square = 0.0
            for r in range(3):
                value = a * work[3 * i + r] + b * work[3 * j + r] + c * work[3 * k + r]
                square += value * value
            if square < nearest:
                nearest, best = square, face
    if best < 0:
        return 4
    i, j, k, _ = face_of(best)
    return keep_triangle(work, i, j, k)


@kernel
def face_of(face):
    """Return the three corners of a face of the tetrahedron, and the fourth one."""
    if face == 0:
        return 0, 1, 2, 3
    if face == 1:
        return 0, 1, 3, 2
    if face == 2:
        return 0, 2, 3, 1
    return 1, 2, 3, 0


@kernel
def beyond(work, i, j, k, opposite):
    """Return whether face i j k separates the origin from the fourth corner, or the tetrahedron is flat."""
    ux, uy, uz = work[3 * j] - work[3 * i], work[3 * j + 1] - work[3 * i + 1], work[3 * j + 2] - work[3 * i + 2]
    vx, vy, vz = work[3 * k] - work[3 * i], work[3 * k + 1] - work[3 * i + 1], work[3 * k + 2] - work[3 * i + 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    here = -(nx * work[3 * i] + ny * work[3 * i + 1] + nz * work[3 * i + 2])
    there = here + nx * work[3 * opposite] + ny * work[3 * opposite + 1] + nz * work[3 * opposite + 2]
    return not (here * there > 0.0 and abs(there) > FLAT * math.sqrt(nx * nx + ny * ny + nz * nz))


@kernel
def on_segment(work, i, j):
    """Return the weights of points i and j in their segment's nearest point to the origin."""
    along, square = 0.0, 0.0
    for r in range(3):
        edge = work[3 * j + r] - work[3 * i + r]
        along -= edge * work[3 * i + r]
        square += edge * edge
    t = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
    return 1.0 - t, t


@kernel
def on_triangle(work, i, j, k):
    """Return the weights of points i, j, k in their triangle's nearest point to the origin (Ericson 2005, 5.1.5)."""
    d1, d2, d3, d4, d5, d6 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for r in range(3):
        a, b, c = work[3 * i + r], work[3 * j + r], work[3 * k + r]
        d1 -= (b - a) * a
        d2 -= (c - a) * a
        d3 -= (b - a) * b
        d4 -= (c - a) * b
        d5 -= (b - a) * c
        d6 -= (c - a) * c
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        t = d1 / (d1 - d3) if d1 > d3 else 0.0
        return 1.0 - t, t, 0.0
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = d2 / (d2 - d6) if d2 > d6 else 0.0
        return 1.0 - t, 0.0, t
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        whole = (d4 - d3) + (d5 - d6)
        t = (d4 - d3) / whole if whole > 0.0 else 0.0
        return 0.0, 1.0 - t, t
    whole = va + vb + vc
    return va / whole, vb / whole, vc / whole


@kernel
def keep_triangle(work, i, j, k):
    """Keep those of three points that their triangle's nearest point to the origin needs."""
    a, b, c = on_triangle(work, i, j, k)
    return keep(work, a, b, c, i, j, k)


@kernel
def keep(work, a, b, c, i, j, k):
    """Move the points i < j < k whose weights are above 0 to the front; return how many there are."""
    size = 0
    for turn in range(3):
        weight, place = (a, i) if turn == 0 else (b, j) if turn == 1 else (c, k)
        if weight > 0.0:
            for r in range(3):
                work[3 * size + r] = work[3 * place + r]
                work[12 + 3 * size + r] = work[12 + 3 * place + r]
            work[24 + size] = weight
            size += 1
    return size


@inlined
def segment_distance(one, other, guess):
    """Return a lower bound of the distance of two segments, whose ends follow the first three numbers of each (9,).

    `guess` receives the direction between their nearest points (Ericson 2005, 5.1.9), which the bound holds along.
    """
    a, e, b, c, f = 0.0, 0.0, 0.0, 0.0, 0.0
    for r in range(3):
        u, v, w = one[6 + r] - one[3 + r], other[6 + r] - other[3 + r], one[3 + r] - other[3 + r]
        a, e, b, c, f = a + u * u, e + v * v, b + u * v, c + u * w, f + v * w
    apart = a * e - b * b
    s = min(max((b * f - c * e) / apart, 0.0), 1.0) if apart > 1e-12 * a * e else 0.0
    t = (b * s + f) / e if e > 0.0 else 0.0
    if not 0.0 <= t <= 1.0 or e == 0.0:
        t = min(max(t, 0.0), 1.0)
        s = min(max((b * t - c) / a, 0.0), 1.0) if a > 0.0 else 0.0
    square, first, second, third, fourth = 0.0, 0.0, 0.0, 0.0, 0.0
    for r in range(3):
        guess[r] = one[3 + r] + s * (one[6 + r] - one[3 + r]) - other[3 + r] - t * (other[6 + r] - other[3 + r])
        square += guess[r] * guess[r]
        first, second = first + guess[r] * one[3 + r], second + guess[r] * one[6 + r]
        third, fourth = third + guess[r] * other[3 + r], fourth + guess[r] * other[6 + r]
    if not square > 0.0:
        guess[0] = 1.0
        return 0.0
    return (min(first, second) - max(third, fourth)) / math.sqrt(square)
