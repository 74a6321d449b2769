"""Forward kinematics and pose error of LANES configurations at once: what `kinematics/` does for one."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kernel.sincos import LARGE, reduce_angle, sincos_of_rest
from ros_ik_pkg.ik.kernel.vectors import plus_times
from ros_ik_pkg.ik.kernel.wide import bits_of, larger, where, wide
from ros_ik_pkg.ik.kinematics.forward import beyond, fill_columns, tip_of, turned
from ros_ik_pkg.ik.kinematics.pose_error import difference

NEAR_HALF_TURN = 1e-2  # 1 + trace of a rotation; there are 4 degrees left to half a turn
QUARTER_TURN = 0.5 * math.pi
STEEP, FLAT = 1.0 + math.sqrt(2.0), math.sqrt(2.0) - 1.0  # tangents of 3/8 pi and pi/8
# atan x = x + x^3 P(x^2) / Q(x^2) to the last place for |x| <= FLAT (Moshier 1989, Cephes `atan.c`)
P = (
    -6.485021904942025371773e1, -1.228866684490136173410e2, -7.500855792314704667340e1, -1.615753718733365076637e1,
    -8.750608600031904122785e-1,
)  # fmt: skip
Q = (
    1.945506571482613964425e2, 4.853903996359136964868e2, 4.328810604912902668951e2, 1.650270098316988542046e2,
    2.485846490142306297962e1,
)  # fmt: skip


@inlined
def sincos_of_lanes(x):
    """Return (sin x, cos x) of angles below LARGE [rad]."""
    quarter, r = reduce_angle(x)
    sine, cosine = sincos_of_rest(r)
    half = math.floor(0.5 * quarter)
    odd = quarter - 2.0 * half > 0.5
    sine, cosine = where(odd, cosine, sine), where(odd, -sine, cosine)
    turned = half - 2.0 * math.floor(0.5 * half) > 0.5
    return where(turned, -sine, sine), where(turned, -cosine, cosine)


@inlined
def walk_lanes(geometry, lanes):
    """Return rotations (nine numbers, row by row), positions of the tip, and the largest angle without its sign; write
    axes to `lanes`."""
    count, rows = len(geometry.prismatic), geometry.placements
    zero, one = wide(0.0), wide(1.0)
    largest = zero
    for i in range(count):  # in a loop of its own, the constants stay in registers
        angle = joint_values(geometry, lanes, i)
        if geometry.prismatic[i] != 0.0:
            angle = zero
        lanes.sines[i], lanes.cosines[i] = sincos_of_lanes(angle)
        largest = larger(largest, abs(angle))
    x, y, z, p = (one, zero, zero), (zero, one, zero), (zero, zero, one), (zero, zero, zero)
    for i in range(count):
        s, c = lanes.sines[i], lanes.cosines[i]
        p = beyond(p, x, y, z, rows, i)
        # A turn about x alone, as between most joints, takes two thirds of the arithmetic.
        if rows[i, 0] > 0.0 and rows[i, 1] == 0.0 and rows[i, 2] == 0.0:
            u, z = mix(y, z, rows[i, 4], rows[i, 7]), mix(y, z, rows[i, 5], rows[i, 8])
            x, y = mix(x, u, c, s), mix(x, u, -s, c)
        else:
            x, y, z = turned(x, y, z, rows, i, c, s)
        lanes.axes[i, 0], lanes.axes[i, 1], lanes.axes[i, 2] = z
        lanes.axes[i, 3], lanes.axes[i, 4], lanes.axes[i, 5] = p
        if geometry.prismatic[i] != 0.0:
            p = plus_times(p, z, joint_values(geometry, lanes, i))
    R, p = tip_of(p, x, y, z, rows, count)
    return R, p, largest


@inlined
def joint_values(geometry, lanes, i):
    """Return the values of joint i [rad, m]."""
    return lanes.q[int(geometry.variable[i])] * geometry.multiplier[i] + geometry.offset[i]


@inlined
def mix(x, y, a, b):
    """Return x a + y b of two vectors."""
    return x[0] * a + y[0] * b, x[1] * a + y[1] * b, x[2] * a + y[2] * b


@inlined
def rotation_log_of_lanes(R):
    """Return the rotation vectors of R, as `rotation_log` does."""
    w, x, y, z = quaternion_of_lanes(R)
    sign = where(w < 0.0, -1.0, 1.0)
    w, x, y, z = sign * w, sign * x, sign * y, sign * z
    sine = math.sqrt(x * x + y * y + z * z)
    # half the angle is atan(sine / w), brought to |x| <= FLAT from around pi/4 and pi/2
    small, steep = sine <= FLAT * w, sine > STEEP * w
    top = where(small, sine, where(steep, -w, sine - w))
    bottom = where(small, w, where(steep, sine, sine + w))
    tangent = top / bottom
    t = tangent * tangent
    series = 1.0 + t * ((P[0] + t * (P[1] + t * (P[2] + t * (P[3] + t * P[4])))) / (
        Q[0] + t * (Q[1] + t * (Q[2] + t * (Q[3] + t * (Q[4] + t))))
    ))  # fmt: skip
    half = where(steep, QUARTER_TURN, 0.5 * QUARTER_TURN) + tangent * series
    scale = 2.0 * where(small, series, half) / where(small, w, sine)
    return scale * x, scale * y, scale * z


@inlined
def quaternion_of_lanes(R):
    """Return (w, x, y, z), not normalised, as `quaternion` does."""
    w, x, y, z = 1.0 + (R[0] + R[4] + R[8]), R[7] - R[5], R[2] - R[6], R[3] - R[1]
    if bits_of(w < NEAR_HALF_TURN):  # in some lane; in the others these are precise enough
        by_w, by_x, by_y = w >= NEAR_HALF_TURN, (R[0] >= R[4]) & (R[0] >= R[8]), R[4] >= R[8]
        xy, xz, yz = R[1] + R[3], R[2] + R[6], R[5] + R[7]
        w, x, y, z = (
            where(by_w, w, where(by_x, x, where(by_y, y, z))),
            where(by_w, x, where(by_x, 1.0 + R[0] - R[4] - R[8], where(by_y, xy, xz))),
            where(by_w, y, where(by_x, xy, where(by_y, 1.0 - R[0] + R[4] - R[8], yz))),
            where(by_w, z, where(by_x, xz, where(by_y, yz, 1.0 - R[0] - R[4] + R[8]))),
        )
    return w, x, y, z


@inlined
def look_at_errors(geometry, lanes):
    """Write the errors at lanes.q to lanes.e; return the squares of the norms of their two halves [m, rad],
    the positions of the tip, and which lanes have angles that are too large for `sincos_of_lanes`."""
    R, p, largest = walk_lanes(geometry, lanes)
    goal = lanes.goals
    target = (goal[0], goal[1], goal[2], goal[3], goal[4], goal[5], goal[6], goal[7], goal[8])
    rx, ry, rz = rotation_log_of_lanes(difference(target, R))
    x, y, z = goal[9] - p[0], goal[10] - p[1], goal[11] - p[2]
    lanes.e[0], lanes.e[1], lanes.e[2], lanes.e[3], lanes.e[4], lanes.e[5] = x, y, z, rx, ry, rz
    return x * x + y * y + z * z, rx * rx + ry * ry + rz * rz, p, largest >= LARGE


@inlined
def look_around_lanes(geometry, lanes, p):
    """Write the Jacobians where the tips are at p."""
    fill_columns(geometry, lanes.axes, p, lanes.columns)
