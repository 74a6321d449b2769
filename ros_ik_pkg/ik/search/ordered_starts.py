"""Where descents for two tasks in strict order begin: configurations near the target but for the first and last joint.

Most arms turn as a whole about their first axis, and the last joint only turns the tool. So the starts cover the joints
in between, more densely than they could cover all, some of them at limits, where many optima are. For each the best
angles of the two are known in closed form: the first brings the tip into the half plane of the target, and the last
brings the orientation as near as it can. An arm of another kind has starts over its first or last joint too.

A start also knows, to first order, how far the joints in between turn the tip while they bring it to the position of
the target by the shortest motion. So its score promises how near a descent from there comes.
"""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.numba_insides import on_its_own
from ros_ik_pkg.ik.kernel.vectors import rotated_back
from ros_ik_pkg.ik.kinematics.forward import walk
from ros_ik_pkg.ik.kinematics.pose_error import quaternion
from ros_ik_pkg.ik.search.starts import r_sequence, reach_poses, sampling_range

COUNT = 2048  # even
TURN = 2.0 * math.pi
NEAR_AXIS = 0.1  # of the reach: a tip that is further from the last axis moves too much when that turns
POSE, SLOPES = 8, 12  # rows of a start after its joint positions: the pose, and derivatives of the quaternion
AT_A_LIMIT = 0.05  # share of the starts that have a joint at its lower limit, and at its upper one
DENSE = 3.0  # joints that the starts cover on most arms; with more they are sparse, and promise less than is near them
MARGIN = 0.03  # of the score, on such arms
TRUSTED = 0.2  # of the reach, on such arms: a start that is further away promises nothing
DIFFERENCE = 1e-5  # rad or m, of a joint
LARGEST_STEP = 0.5  # rad or m, by which a start is led to the goal
CAREFUL = 0.05  # of the reach: a joint that moves the tip less per radian is not trusted to


def make_ordered_starts(geometry, model, length):
    """Return starts (4 n + 20, COUNT) float32, and (4,): whether the first and the last joint are left out of them, by
    how much more than its score a start may miss the wish, and the distance [m] beyond which it promises nothing.

    Rows: joint positions [rad, m], tip position [m], quaternion w x y z, azimuth [rad]; then the derivatives of the
    quaternion and of the joint positions by the tip position, x y z of each. If the first joint is left out they are
    in its frame, position and quaternion turned to the azimuth 0. `length` [m] is the reach of the arm.
    """
    last = len(geometry.prismatic) - 1
    turns = [
        not geometry.prismatic[k] and np.count_nonzero(geometry.variable == geometry.variable[k]) == 1
        for k in (0, last)
    ]
    off_axis = math.hypot(*geometry.placements[-1, 9:11])
    free = np.array([turns[0], turns[1] and last > 0 and off_axis < NEAR_AXIS * length], dtype=np.float64)
    lower, upper = sampling_range(geometry)
    covered = np.ones(len(lower), bool)
    for left_out, joint in zip(free, (0, last)):
        covered[int(geometry.variable[joint])] &= not left_out
    q = np.tile(np.clip(0.0, lower, upper), (COUNT, 1))
    if np.any(covered):
        shares = r_sequence(COUNT, int(np.count_nonzero(covered)))
        shares = np.clip((1.0 + 2.0 * AT_A_LIMIT) * shares - AT_A_LIMIT, 0.0, 1.0)
        q[:, covered] = lower[covered] + (upper - lower)[covered] * shares
    tip, turned, azimuth = poses_ahead(geometry, model, q, free)
    by_joint = np.zeros((7, len(lower), COUNT))  # derivatives of position and quaternion
    for i in np.flatnonzero(covered):
        moved = q.copy()
        moved[:, i] += DIFFERENCE
        there, other, _ = poses_ahead(geometry, model, moved, free)
        other *= np.sign(np.sum(turned * other, axis=0))
        by_joint[:, i] = (np.vstack([there, other]) - np.vstack([tip, turned])) / DIFFERENCE
    J = by_joint[:3].transpose(2, 0, 1)
    reach = length if 0.0 < length < math.inf else 1.0
    square = J @ J.transpose(0, 2, 1) + (CAREFUL * reach) ** 2 * np.eye(3)
    joints_by_tip = np.linalg.solve(square, J).transpose(1, 2, 0)  # (3, n, COUNT)
    turned_by_tip = np.einsum('wnk,xnk->xwk', by_joint[3:], joints_by_tip)
    largest = np.finfo(np.float32).max
    slopes = [turned_by_tip.reshape(-1, COUNT), joints_by_tip.reshape(-1, COUNT)]
    rows = np.clip(np.vstack([q.T, tip, turned, azimuth, *slopes]), -largest, largest)
    joints = int(np.count_nonzero(covered))
    apart = max(1.0, joints / DENSE * COUNT ** (2.0 / DENSE - 2.0 / max(joints, 1)))  # the square, over that of DENSE
    trust = [MARGIN * apart**1.25, TRUSTED * apart**0.25 * reach]
    return np.ascontiguousarray(rows, dtype=np.float32), np.append(free, trust)


def poses_ahead(geometry, model, q, free):
    """Return tip positions (3, m), quaternions (4, m) and azimuths (m,) of configurations (m, n)."""
    poses = reach_poses(model, np.ascontiguousarray(q))
    tip, turned = poses[:, :3].T, poses[:, 3:].T
    if not free[0]:
        return tip, turned, np.zeros(len(q))
    rotation, origin = geometry.placements[0, :9].reshape(3, 3), geometry.placements[0, 9:]
    x, y, z = rotation.T @ (tip - origin[:, None])
    azimuth = np.arctan2(y, x)
    first = np.array(quaternion(rotation.ravel())) * [1.0, -1.0, -1.0, -1.0]
    back = np.array([np.cos(-0.5 * azimuth), np.zeros(len(q)), np.zeros(len(q)), np.sin(-0.5 * azimuth)])
    ahead = product(product(back, first / np.linalg.norm(first)), turned)
    return np.array([np.hypot(x, y), np.zeros(len(q)), z]), ahead, azimuth


def product(a, b):
    """Return the product of quaternions w x y z."""
    return np.array([
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ])  # fmt: skip


@inlined
def aim(geometry, free, task):
    """Return what the starts are compared with: position [m], two unit quaternions, and azimuth [rad].

    The second quaternion is the first after half a turn about the last axis, zeros unless the last joint is left out;
    then the first is that of the last joint in the middle of its range.
    """
    R, p, azimuth = task.R, task.p, 0.0
    if free[0] > 0.0:
        F = geometry.placements[0]
        x, y, z = rotated_back(F, (p[0] - F[9], p[1] - F[10], p[2] - F[11]))
        azimuth, r = math.atan2(y, x), math.sqrt(x * x + y * y)
        c, s = math.cos(azimuth), math.sin(azimuth)
        a, b = rotated_back(F, (R[0], R[3], R[6])), rotated_back(F, (R[1], R[4], R[7]))
        d = rotated_back(F, (R[2], R[5], R[8]))
        p = (r, 0.0, z)
        R = (
            c * a[0] + s * a[1], c * b[0] + s * b[1], c * d[0] + s * d[1],
            c * a[1] - s * a[0], c * b[1] - s * b[0], c * d[1] - s * d[0], a[2], b[2], d[2],
        )  # fmt: skip
    w, x, y, z = quaternion(R)
    k = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = k * w, k * x, k * y, k * z
    G = geometry.placements[len(geometry.placements) - 1]
    ax, ay, az = free[1] * G[6], free[1] * G[7], free[1] * G[8]  # the last axis in the tip frame
    bw, bx, by, bz = (
        -x * ax - y * ay - z * az, w * ax + y * az - z * ay, w * ay + z * ax - x * az, w * az + x * ay - y * ax,
    )  # fmt: skip
    middle, _ = last_range(geometry, free)
    c, s = math.cos(0.5 * middle), math.sin(0.5 * middle)
    back = (c * w - s * bw, c * x - s * bx, c * y - s * by, c * z - s * bz)
    half_turned = (c * bw + s * w, c * bx + s * x, c * by + s * y, c * bz + s * z)
    return p, back, half_turned, azimuth


@inlined
def last_range(geometry, free):
    """Return the middle of the range of the last joint beyond its position in the starts, and half the range, at most
    half a turn [rad]; that also unless the last joint is left out of the starts."""
    last = len(geometry.prismatic) - 1
    i, m = int(geometry.variable[last]), geometry.multiplier[last]
    middle, half = 0.5 * (geometry.lower[i] + geometry.upper[i]), 0.5 * (geometry.upper[i] - geometry.lower[i])
    if not (free[1] > 0.0 and abs(m) * half < math.pi):
        return 0.0, math.pi
    return m * (middle - min(max(0.0, geometry.lower[i]), geometry.upper[i])), abs(m) * half


@kernel
def score_ordered_starts(geometry, starts, free, goal, scores):
    """Write how far each start is from the goal: sin^2(angle / 2) + (|dp| / free[3])^4.

    The angle is the least that the last joint allows where the joints in between have brought the tip by dp to the
    position of the goal, up to terms of higher order. What an azimuth is beyond the limits of the first joint counts as
    a distance.

    Single precision and no branches, so that eight starts are scored at once.
    """
    on_its_own()
    first, i = joints_of(starts), int(geometry.variable[0])
    middle, half = 0.0, TURN
    if free[0] > 0.0 and geometry.upper[i] - geometry.lower[i] < TURN:
        middle, half = 0.5 * (geometry.lower[i] + geometry.upper[i]), 0.5 * (geometry.upper[i] - geometry.lower[i])
    p, a, b, azimuth = goal
    px, py, pz = np.float32(p[0]), np.float32(p[1]), np.float32(p[2])
    aw, ax, ay, az = np.float32(a[0]), np.float32(a[1]), np.float32(a[2]), np.float32(a[3])
    bw, bx, by, bz = np.float32(b[0]), np.float32(b[1]), np.float32(b[2]), np.float32(b[3])
    turn, per_turn, half_turn = np.float32(TURN), np.float32(1.0 / TURN), np.float32(0.5)
    sign = geometry.multiplier[0]
    ahead, room = np.float32(azimuth - sign * (middle - starts[i, 0])), np.float32(abs(sign) * half)
    factor, one, zero = np.float32(1.0 / (free[3] * free[3])), np.float32(1.0), np.float32(0.0)
    _, last_half = last_range(geometry, free)
    c, s = np.float32(math.cos(0.5 * last_half)), np.float32(math.sin(0.5 * last_half))
    d = first + POSE
    for k in range(len(scores)):
        dx, dy, dz = px - starts[first, k], py - starts[first + 1, k], pz - starts[first + 2, k]
        w = starts[first + 3, k] + dx * starts[d, k] + dy * starts[d + 4, k] + dz * starts[d + 8, k]
        x = starts[first + 4, k] + dx * starts[d + 1, k] + dy * starts[d + 5, k] + dz * starts[d + 9, k]
        y = starts[first + 5, k] + dx * starts[d + 2, k] + dy * starts[d + 6, k] + dz * starts[d + 10, k]
        z = starts[first + 6, k] + dx * starts[d + 3, k] + dy * starts[d + 7, k] + dz * starts[d + 11, k]
        u, v = aw * w + ax * x + ay * y + az * z, bw * w + bx * x + by * y + bz * z
        outside = max(c * abs(v) - s * abs(u), zero)  # of the limits of the last joint
        gap = ahead - starts[first + 7, k]
        gap -= turn * np.float32(math.floor(gap * per_turn + half_turn))
        beyond = px * max(abs(gap) - room, zero)
        far = factor * (dx * dx + dy * dy + dz * dz + beyond * beyond)
        square = w * w + x * x + y * y + z * z
        scores[k] = far * far + max(one - (u * u + v * v - outside * outside) / square, zero)


@inlined
def joints_of(starts):
    """Return the number of joint positions in a start."""
    return (starts.shape[0] - POSE - SLOPES) // 4


@inlined
def take_ordered_start(geometry, starts, free, goal, k, work):
    """Write start k, led to the goal, to work.q; joints may be outside their limits."""
    q, n, last = work.q, len(work.q), len(geometry.prismatic) - 1
    p, a, b, azimuth = goal
    d, e = n + POSE, n + POSE + SLOPES
    x, y, z = p[0] - starts[n, k], p[1] - starts[n + 1, k], p[2] - starts[n + 2, k]
    for i in range(n):
        step = x * starts[e + i, k] + y * starts[e + n + i, k] + z * starts[e + 2 * n + i, k]
        q[i] = starts[i, k] + min(max(step, -LARGEST_STEP), LARGEST_STEP)
    if free[1] > 0.0:
        s, t = 0.0, 0.0
        for r in range(4):
            turned = starts[n + 3 + r, k] + x * starts[d + r, k] + y * starts[d + 4 + r, k] + z * starts[d + 8 + r, k]
            s += a[r] * turned
            t += b[r] * turned
        middle, _ = last_range(geometry, free)
        angle = 2.0 * math.atan2(-t, s)
        angle -= TURN * math.floor(angle / TURN + 0.5)
        q[int(geometry.variable[last])] += (middle + angle) / geometry.multiplier[last]
    if free[0] > 0.0:
        _, tip = walk(geometry, q, work.joints)
        F = geometry.placements[0]
        x, y, _ = rotated_back(F, (tip[0] - F[9], tip[1] - F[10], tip[2] - F[11]))
        turn_by(geometry, 0, azimuth - math.atan2(y, x), q)


@inlined
def turn_by(geometry, joint, angle, q):
    """Turn a joint by an angle [rad], or by one that differs from it by whole turns, as near the middle of its range
    as that allows."""
    i = int(geometry.variable[joint])
    angle = q[i] + angle / geometry.multiplier[joint]
    middle = 0.5 * (geometry.lower[i] + geometry.upper[i])
    if abs(middle) < math.inf:
        angle -= TURN * math.floor((angle - middle) / TURN + 0.5)
    q[i] = angle
