"""Where descents for two tasks in strict order begin: configurations near the target but for the first and last joint.

Most arms turn as a whole about their first axis, and the last joint only turns the tool. So the starts cover the joints
in between, more densely than they could cover all, and for each the best angles of the two are known in closed form:
the first brings the tip into the half plane of the target, and the last brings the orientation as near as it can. An
arm of another kind has starts over its first or last joint too.
"""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import kernel
from ros_ik_pkg.ik.kernel.numba_insides import on_its_own
from ros_ik_pkg.ik.kernel.vectors import rotated_back
from ros_ik_pkg.ik.kinematics.pose_error import quaternion
from ros_ik_pkg.ik.search.starts import r_sequence, reach_poses, sampling_range

COUNT = 2048  # even
TURN = 2.0 * math.pi
NEAR_AXIS = 0.1  # of the reach: a tip that is further from the last axis moves too much when that turns
POSE = 8  # rows of a start after its joint positions


def make_ordered_starts(geometry, model, length):
    """Return starts (n + 8, COUNT) float32, and (2,) whether the first and the last joint are left out of them.

    Rows: joint positions [rad, m], tip position [m], quaternion w x y z, and azimuth [rad]. If the first joint is left
    out they are in its frame, position and quaternion turned to the azimuth 0. `length` [m] is the reach of the arm.
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
        q[:, covered] = lower[covered] + (upper - lower)[covered] * shares
    poses = reach_poses(model, np.ascontiguousarray(q))
    tip, turned, azimuth = poses[:, :3].T, poses[:, 3:].T, np.zeros(COUNT)
    if free[0]:
        rotation, origin = geometry.placements[0, :9].reshape(3, 3), geometry.placements[0, 9:]
        x, y, z = rotation.T @ (tip - origin[:, None])
        azimuth = np.arctan2(y, x)
        tip = np.array([np.hypot(x, y), np.zeros(COUNT), z])
        first = np.array(quaternion(rotation.ravel())) * [1.0, -1.0, -1.0, -1.0]
        back = np.array([np.cos(-0.5 * azimuth), np.zeros(COUNT), np.zeros(COUNT), np.sin(-0.5 * azimuth)])
        turned = product(product(back, first / np.linalg.norm(first)), turned)
    largest = np.finfo(np.float32).max
    rows = np.clip(np.vstack([q.T, tip, turned, azimuth]), -largest, largest)
    return np.ascontiguousarray(rows, dtype=np.float32), free


def product(a, b):
    """Return the product of quaternions w x y z."""
    return np.array([
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ])  # fmt: skip


@kernel
def aim(geometry, free, task):
    """Return what the starts are compared with: position [m], unit quaternion, that quaternion after half a turn about
    the last axis (zeros unless the last joint is left out), and azimuth [rad]."""
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
    half_turned = (
        -x * ax - y * ay - z * az, w * ax + y * az - z * ay, w * ay + z * ax - x * az, w * az + x * ay - y * ax,
    )  # fmt: skip
    return p, (w, x, y, z), half_turned, azimuth


@kernel
def score_ordered_starts(geometry, starts, free, goal, scale, scores):
    """Write how far each start is from the goal: |dp|^2 / scale^2 + sin^2(angle / 2), the angle being the least that
    the last joint allows. What an azimuth is beyond the limits of the first joint counts as a distance.

    Single precision and no branches, so that eight starts are scored at once.
    """
    on_its_own()
    first, i = starts.shape[0] - POSE, int(geometry.variable[0])
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
    factor, one, zero = np.float32(1.0 / (scale * scale)), np.float32(1.0), np.float32(0.0)
    for k in range(len(scores)):
        dx, dy, dz = starts[first, k] - px, starts[first + 1, k] - py, starts[first + 2, k] - pz
        w, x, y, z = starts[first + 3, k], starts[first + 4, k], starts[first + 5, k], starts[first + 6, k]
        s, t = aw * w + ax * x + ay * y + az * z, bw * w + bx * x + by * y + bz * z
        gap = ahead - starts[first + 7, k]
        gap -= turn * np.float32(math.floor(gap * per_turn + half_turn))
        beyond = px * max(abs(gap) - room, zero)
        scores[k] = factor * (dx * dx + dy * dy + dz * dz + beyond * beyond) + max(one - s * s - t * t, zero)


@kernel
def take_ordered_start(geometry, starts, free, goal, k, q):
    """Write start k, its first and last joint turned to the goal, to q; these two may be outside their limits."""
    first, last = starts.shape[0] - POSE, len(geometry.prismatic) - 1
    for i in range(len(q)):
        q[i] = starts[i, k]
    _, a, b, azimuth = goal
    if free[0] > 0.0:
        turn_by(geometry, 0, azimuth - starts[first + 7, k], q)
    if free[1] > 0.0:
        s, t = 0.0, 0.0
        for r in range(4):
            s += a[r] * starts[first + 3 + r, k]
            t += b[r] * starts[first + 3 + r, k]
        turn_by(geometry, last, 2.0 * math.atan2(-t, s), q)


@kernel
def turn_by(geometry, joint, angle, q):
    """Turn a joint by an angle [rad], or by one that differs from it by whole turns, as near the middle of its range
    as that allows."""
    i = int(geometry.variable[joint])
    angle = q[i] + angle / geometry.multiplier[joint]
    middle = 0.5 * (geometry.lower[i] + geometry.upper[i])
    if abs(middle) < math.inf:
        angle -= TURN * math.floor((angle - middle) / TURN + 0.5)
    q[i] = angle
