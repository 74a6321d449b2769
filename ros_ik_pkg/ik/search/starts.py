"""The starts of the attempts after the first: well-spread configurations, those nearest to the target first.

The configurations are points of the R_d sequence (Roberts 2018, the generalised golden ratio) between the joint
limits, so they are the same on every machine; their poses are computed once per arm. A descent that begins at the
start whose pose is nearest the target converges in eight to nine of ten cases and takes five steps
(docs/performance.md).
"""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import compiled, kernel
from ros_ik_pkg.ik.kernel.data_layout import joints_size, make_joints, unpack_model
from ros_ik_pkg.ik.kernel.numba_insides import on_its_own
from ros_ik_pkg.ik.kinematics.forward import walk
from ros_ik_pkg.ik.kinematics.pose_error import quaternion

COUNT = 1024  # even, for data_layout.pack_model
HALF_TURN = math.pi
WIDE_SLIDE = 200.0  # times the length of the arm: a slide that is longer counts as endless


def make_starts(geometry, model):
    """Return (n + 7, COUNT) float32: rows of joint positions [rad, m], tip position [m] and quaternion."""
    lower, upper = sampling_range(geometry)
    q = np.ascontiguousarray(lower + (upper - lower) * r_sequence(COUNT, len(lower)))
    largest = np.finfo(np.float32).max
    rows = np.clip(np.hstack([q, reach_poses(model, q)]).T, -largest, largest)
    return np.ascontiguousarray(rows, dtype=np.float32)


def r_sequence(count, dimensions):
    """Return (count, dimensions) points of the R_d sequence in [0, 1)."""
    ratio = 2.0
    for _ in range(64):
        ratio = (1.0 + ratio) ** (1.0 / (dimensions + 1))
    steps = ratio ** -np.arange(1.0, dimensions + 1.0)
    return np.mod(0.5 + np.outer(np.arange(1.0, count + 1.0), steps), 1.0)


def sampling_range(geometry):
    """Return the lower and upper bounds of the starts: one turn for a joint that may turn round or is unlimited.

    For a slide that is unlimited or much longer than the arm it is 2 pi times the length of the arm.
    """
    lower, upper = geometry.lower.copy(), geometry.upper.copy()
    slides = set(geometry.variable[geometry.prismatic > 0].tolist())
    scale = max(1.0, float(np.linalg.norm(geometry.placements[1:, 9:], axis=1).sum()))
    for i in range(len(lower)):
        if i in slides:
            if 0.5 * upper[i] - 0.5 * lower[i] > WIDE_SLIDE * scale:
                lower[i], upper[i] = near_zero(lower[i], upper[i], HALF_TURN * scale)
        elif geometry.wraps[i] or not math.isfinite(upper[i] - lower[i]):
            lower[i], upper[i] = one_turn(lower[i], upper[i])
    return lower, upper


def near_zero(lower, upper, half):
    """Return the range of length 2 half that is nearest to zero between limits that are further apart."""
    middle = min(max(0.0, lower + half), upper - half)
    return middle - half, middle + half


def one_turn(lower, upper):
    """Return a range of one turn that lies between the limits."""
    if math.isfinite(lower) and math.isfinite(upper):
        return 0.5 * (lower + upper) - HALF_TURN, 0.5 * (lower + upper) + HALF_TURN
    if math.isfinite(lower):
        return lower, lower + 2.0 * HALF_TURN
    if math.isfinite(upper):
        return upper - 2.0 * HALF_TURN, upper
    return -HALF_TURN, HALF_TURN


@compiled
def reach_poses(model, q):
    """Return (m, 7): tip position [m] and unit quaternion (w, x, y, z) of each configuration (m, n)."""
    poses = np.empty((len(q), 7))
    _write_poses(model, q, np.empty(joints_size(model)), poses)
    return poses


@kernel
def _write_poses(model, q, memory, poses):
    """Write position and quaternion of each configuration."""
    geometry, _, _ = unpack_model(model)
    joints = make_joints(model, memory)
    for k in range(len(q)):
        R, p = walk(geometry, q[k], joints)
        w, x, y, z = quaternion(R)
        length = math.sqrt(w * w + x * x + y * y + z * z)
        poses[k, 0], poses[k, 1], poses[k, 2] = p
        poses[k, 3], poses[k, 4], poses[k, 5], poses[k, 6] = w / length, x / length, y / length, z / length


@kernel
def nearest_start(scores):
    """Return the index of the nearest start that was not used yet.

    Non-negative floats have the same order as their bits, and the compiler compares integers sixteen at a time. The
    first of several equal scores wins.
    """
    on_its_own()
    bits = scores.view(np.int32)
    least = bits[0]
    for k in range(1, len(bits)):
        least = min(least, bits[k])
    count = np.int32(len(bits))  # of 32 bits too, so that as many are compared at once
    best = count
    for k in range(count):
        best = min(best, np.int32(k) if bits[k] == least else count)
    return best


@kernel
def distance_of(starts, k, task):
    """Return the norm of the twist error of start k, all rows counted."""
    first = starts.shape[0] - 7
    w, x, y, z = quaternion(task.R)
    length = math.sqrt(w * w + x * x + y * y + z * z)
    s = starts[first:, k]
    dx, dy, dz = s[0] - task.p[0], s[1] - task.p[1], s[2] - task.p[2]
    cosine = abs(s[3] * w + s[4] * x + s[5] * y + s[6] * z) / length
    angle = 2.0 * math.acos(min(1.0, cosine))
    return math.sqrt(dx * dx + dy * dy + dz * dz + angle * angle)


@kernel
def next_start(starts, attempt, first, work):
    """Write the start of attempt 1, 2, ... to work.q: the nearest unused one; `first` is the nearest of all."""
    m = starts.shape[1]
    if attempt <= m:
        best = first if attempt == 1 else nearest_start(work.scores)
        work.scores[best] = np.inf
        for i in range(len(work.q)):
            work.q[i] = starts[i, best]
    else:  # all used: new combinations of their coordinates
        for i in range(len(work.q)):
            work.q[i] = starts[i, (attempt * (2 * i + 1) + i * (attempt // m)) % m]


@kernel
def score_starts(starts, task, scale, scores):
    """Write how far each start is from the target: 4 |dp|^2 / scale^2 + 2 (1 - |<quaternions>|).

    Position rows of weight 0 in base axes are left out, and the orientation if one of its rows has weight 0. Single
    precision and no branches, so that eight starts are scored at once.
    """
    on_its_own()
    first = starts.shape[0] - 7
    w, x, y, z = quaternion(task.R)
    weights = task.weights
    turned = 2.0 * (weights[3] > 0.0 and weights[4] > 0.0 and weights[5] > 0.0)
    per_length = turned / math.sqrt(w * w + x * x + y * y + z * z)
    qw, qx, qy, qz = (
        np.float32(w * per_length), np.float32(x * per_length), np.float32(y * per_length), np.float32(z * per_length),
    )  # fmt: skip
    sx = 2.0 / scale * (weights[0] > 0.0 or task.in_tip_axes > 0.0)
    sy = 2.0 / scale * (weights[1] > 0.0 or task.in_tip_axes > 0.0)
    sz = 2.0 / scale * (weights[2] > 0.0 or task.in_tip_axes > 0.0)
    px, py, pz = np.float32(sx * task.p[0]), np.float32(sy * task.p[1]), np.float32(sz * task.p[2])
    sx, sy, sz, rest = np.float32(sx), np.float32(sy), np.float32(sz), np.float32(turned)
    for k in range(len(scores)):
        dx, dy, dz = sx * starts[first, k] - px, sy * starts[first + 1, k] - py, sz * starts[first + 2, k] - pz
        dot = (
            qw * starts[first + 3, k] + qx * starts[first + 4, k]
            + qy * starts[first + 5, k] + qz * starts[first + 6, k]
        )  # fmt: skip
        scores[k] = abs(rest + dx * dx + dy * dy + dz * dz - abs(dot))  # rounding can make it negative
