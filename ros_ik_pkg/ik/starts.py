"""Where the attempts after the first begin: well-spread configurations, those that reach near the target first.

The configurations are points of the R_d sequence (Roberts 2018, the generalised golden ratio) between the joint
limits, so they are the same on every machine; their poses are computed once per arm. A descent that begins at the
start whose pose is nearest the target holds four to nine times of ten and takes five steps (docs/performance.md).
"""

from __future__ import annotations

import math
import numpy as np

from ros_ik_pkg.ik.compiled import compiled, kernel
from ros_ik_pkg.ik.kinematics import walk
from ros_ik_pkg.ik.linalg import assign
from ros_ik_pkg.ik.pose_error import quaternion
from ros_ik_pkg.ik.records import Geometry, Starts

COUNT = 1024
HALF_TURN = math.pi


def make_starts(geometry):
    """Spread COUNT configurations over the joint ranges and compute where they reach."""
    lower, upper = sampling_range(Geometry(*geometry))
    q = np.ascontiguousarray(lower + (upper - lower) * r_sequence(COUNT, len(lower)))
    poses = reach_poses(geometry, q)
    centre = poses[:, :3].mean(axis=0)
    spread = max(float(np.sqrt(np.mean(np.sum((poses[:, :3] - centre) ** 2, axis=1)))), 1e-6)
    single = [np.ascontiguousarray(part.T, dtype=np.float32) for part in (poses[:, :3] / spread, poses[:, 3:])]
    return Starts(q, *single, spread)


def r_sequence(count, dimensions):
    """Return (count, dimensions) points of the R_d sequence in [0, 1)."""
    ratio = 2.0
    for _ in range(64):
        ratio = (1.0 + ratio) ** (1.0 / (dimensions + 1))
    steps = ratio ** -np.arange(1.0, dimensions + 1.0)
    return np.mod(0.5 + np.outer(np.arange(1.0, count + 1.0), steps), 1.0)


def sampling_range(geometry):
    """Return lower and upper ends between which starts lie: one turn where a joint may turn round or has no end."""
    lower, upper = geometry.lower.copy(), geometry.upper.copy()
    for i in range(len(lower)):
        if geometry.wraps[i] or not math.isfinite(upper[i] - lower[i]):
            lower[i], upper[i] = one_turn(lower[i], upper[i])
    return lower, upper


def one_turn(lower, upper):
    """Return a range of one turn (2 pi m where the joint slides) that lies between the limits."""
    if math.isfinite(lower) and math.isfinite(upper):
        return 0.5 * (lower + upper) - HALF_TURN, 0.5 * (lower + upper) + HALF_TURN
    if math.isfinite(lower):
        return lower, lower + 2.0 * HALF_TURN
    if math.isfinite(upper):
        return upper - 2.0 * HALF_TURN, upper
    return -HALF_TURN, HALF_TURN


@compiled
def reach_poses(geometry, q):
    """Return (m, 7): tip position [m] and unit quaternion (w, x, y, z) of each configuration (m, n)."""
    arm = Geometry(*geometry)
    axes = np.empty((len(arm.prismatic), 6))
    poses = np.empty((len(q), 7))
    for k in range(len(q)):
        R, p = walk(arm, q[k], axes)
        w, x, y, z = quaternion(R)
        length = math.sqrt(w * w + x * x + y * y + z * z)
        poses[k, 0], poses[k, 1], poses[k, 2] = p
        poses[k, 3], poses[k, 4], poses[k, 5], poses[k, 6] = w / length, x / length, y / length, z / length
    return poses


@kernel
def next_start(starts, task, attempt, work):
    """Write the start of attempt 1, 2, ... to work.q: the nearest that was not used yet."""
    m = len(starts.q)
    if attempt == 1:
        score_starts(starts, task, work.scores)
    if attempt <= m:
        best = 0
        for k in range(1, m):
            if work.scores[k] < work.scores[best]:
                best = k
        work.scores[best] = np.inf
        assign(work.q, starts.q[best])
    else:
        for i in range(len(work.q)):  # all used: new combinations of their coordinates
            work.q[i] = starts.q[(attempt * (2 * i + 1) + i * (attempt // m)) % m, i]


@kernel
def score_starts(starts, task, scores):
    """Write how far each start is from the target: 4 |dp|^2 / spread^2 + 2 (1 - |<quaternions>|), rows of weight 0
    left out. Single precision and no branches, so that eight starts are scored at once."""
    w, x, y, z = quaternion(task.R)
    length = math.sqrt(w * w + x * x + y * y + z * z)
    qw, qx, qy, qz = np.float32(w / length), np.float32(x / length), np.float32(y / length), np.float32(z / length)
    px, py, pz = (
        np.float32(task.p[0] / starts.spread),
        np.float32(task.p[1] / starts.spread),
        np.float32(task.p[2] / starts.spread),
    )
    weights = task.weights
    wx, wy, wz = np.float32(4 * (weights[0] > 0)), np.float32(4 * (weights[1] > 0)), np.float32(4 * (weights[2] > 0))
    wr = np.float32(2 * (weights[3] > 0 and weights[4] > 0 and weights[5] > 0))
    positions, quaternions, one = starts.positions, starts.quaternions, np.float32(1)
    for k in range(len(scores)):
        dx, dy, dz = positions[0, k] - px, positions[1, k] - py, positions[2, k] - pz
        dot = (
            quaternions[0, k] * qw + quaternions[1, k] * qx + quaternions[2, k] * qy + quaternions[3, k] * qz
        )
        scores[k] = wx * dx * dx + wy * dy * dy + wz * dz * dz + wr * (one - abs(dot))
