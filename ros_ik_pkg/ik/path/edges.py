"""Whether the joints can move in a straight line from one pose of a path to the next while the tip stays on its line.

Where the joints bend (near a singularity the joints of a straight line of the tip do), the way is cut into 2, 4, ...
parts: at each cut the joints are brought back to the line.
"""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import compiled, inlined, kernel
from ros_ik_pkg.ik.kernel.data_layout import TUNABLES, buffer_size, make_records, tuning_of, unpack_model
from ros_ik_pkg.ik.kernel.linalg import assign
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.kinematics.pose_error import difference, rotation_log
from ros_ik_pkg.ik.kinematics.task import look_at_error, make_task
from ros_ik_pkg.ik.search.entry import STATUS, WIDTH, memory_size, solve_rows

MOST_PARTS = 64
UNEVEN = 3.0  # one part may take this many times an equal share of the joint step
SMALL_ANGLE = 1e-8  # rad


@inlined
def edge_memory_size(model):
    """Return how many numbers `make_edge_memory` cuts up."""
    n = int(model[0])
    return memory_size(model, 1) + 3 + buffer_size(model) + 5 * n + WIDTH + 32


@compiled
def rotation_vectors(poses):
    """Return (N - 1, 3): the rotation from each pose to the next, axis times angle in base axes; poses (4 N, 4)."""
    count = len(poses) // 4
    out = np.empty((max(0, count - 1), 3))
    _write_rotation_vectors(poses, out)
    return out


@kernel
def _write_rotation_vectors(poses, out):
    """Implement `rotation_vectors`."""
    for k in range(len(out)):
        a, b = shaped(poses, 16 * k, (4, 4)), shaped(poses, 16 * k + 16, (4, 4))
        out[k, 0], out[k, 1], out[k, 2] = rotation_log(difference(rows_of(b), rows_of(a)))


@inlined
def rows_of(T):
    """Return the rotation of a pose, row by row."""
    return T[0, 0], T[0, 1], T[0, 2], T[1, 0], T[1, 1], T[1, 2], T[2, 0], T[2, 1], T[2, 2]


@kernel
def pose_between(poses, turns, k, fraction, pose):
    """Write the pose that lies a fraction of the way from pose k to the next: positions linear, orientation SLERP.

    R = exp(fraction * w) R_k by the formula of Rodrigues.
    """
    a, b = shaped(poses, 16 * k, (4, 4)), shaped(poses, 16 * k + 16, (4, 4))
    x, y, z = fraction * turns[k, 0], fraction * turns[k, 1], fraction * turns[k, 2]
    angle = math.sqrt(x * x + y * y + z * z)
    if angle > SMALL_ANGLE:
        s, c = math.sin(angle) / angle, (1.0 - math.cos(angle)) / (angle * angle)
    else:
        s, c = 1.0, 0.5
    for j in range(3):
        u, v, w = a[0, j], a[1, j], a[2, j]
        cx, cy, cz = y * w - z * v, z * u - x * w, x * v - y * u
        pose[0, j] = u + s * cx + c * (y * cz - z * cy)
        pose[1, j] = v + s * cy + c * (z * cx - x * cz)
        pose[2, j] = w + s * cz + c * (x * cy - y * cx)
        pose[j, 3] = a[j, 3] + fraction * (b[j, 3] - a[j, 3])
        pose[3, j] = 0.0
    pose[3, 3] = 1.0


@kernel
def on_line(model, numbers, pose, q, tolerance, angle_tolerance, memory):
    """Return whether the tip at q (n,) is within both tolerances of a pose, the task's own tolerances allowed for."""
    geometry, _, _ = unpack_model(model)
    integers, buffer = shaped(memory, 0, (3,)).view(np.int64), shaped(memory, 3, (buffer_size(model),))
    nothing = shaped(memory, 0, (0, 0))
    work, _, _ = make_records(model, buffer, shaped(memory, 0, (0,)).view(np.float32), integers, nothing, 0)
    weights, tolerances = shaped(numbers, TUNABLES, (6,)), shaped(numbers, TUNABLES + 6, (6,))
    task = make_task(pose, weights, tolerances, tuning_of(numbers).task_frame)
    assign(work.weights, weights)
    assign(work.q, q)
    position_error, orientation_error, _, _, _ = look_at_error(geometry, task, work)
    return position_error <= tolerance and orientation_error <= angle_tolerance


@kernel
def parts_of_edge(model, continuing, poses, turns, k, a, b, bounds, between, memory):
    """Return into how many parts the way from joints a at pose k to joints b at the next is cut, 0 if there is none.

    Between the cuts the joints move in straight lines, whose middles are within tolerance of the line of the tip.
    `bounds` (4,): the tolerances [m, rad], the longest step of a joint [rad or m], parts at most. The joints at the
    cuts are written to `between` (MOST_PARTS - 1, n).
    """
    n = len(a)
    size = memory_size(model, 1)
    used = 3 + buffer_size(model)
    rest, scratch = shaped(memory, 0, (size,)), shaped(memory, size, (used,))
    before, after = shaped(memory, size + used, (n,)), shaped(memory, size + used + n, (n,))
    middle = shaped(memory, size + used + 2 * n, (n,))
    out = shaped(memory, size + used + 3 * n, (1, n + WIDTH))
    pose = shaped(memory, size + used + 4 * n + WIDTH, (4, 4))
    nothing = shaped(memory, 0, (0, 0))
    largest = 0.0
    for j in range(n):
        largest = max(largest, abs(b[j] - a[j]))
    parts = 1
    while parts <= bounds[3]:
        assign(before, a)
        good = True
        for p in range(1, parts + 1):
            if p == parts:
                assign(after, b)
            else:
                for j in range(n):
                    after[j] = before[j] + (b[j] - before[j]) / (parts - p + 1)
                pose_between(poses, turns, k, p / parts, pose)
                solve_rows(model, continuing, pose, after, after, out, nothing, nothing, nothing, rest)
                if out[0, n + STATUS] != 0.0:
                    good = False
                    break
                for j in range(n):
                    after[j] = out[0, j]
                assign(between[p - 1], after)
            step = 0.0
            for j in range(n):
                step = max(step, abs(after[j] - before[j]))
                middle[j] = 0.5 * (before[j] + after[j])
            pose_between(poses, turns, k, (p - 0.5) / parts, pose)
            if parts > 1 and step > UNEVEN * largest / parts:
                good = False
                break
            if not on_line(model, continuing, pose, middle, bounds[0], bounds[1], scratch):
                good = False
                break
            assign(before, after)
        if good:
            return parts
        parts *= 2
    return 0


@compiled
def count_parts(model, continuing, poses, turns, q, bounds, parts):
    """Write to `parts` (N - 1,) int64 into how many parts each edge of a joint path q (N, n) is cut."""
    memory, between = np.empty(edge_memory_size(model)), np.empty((MOST_PARTS, q.shape[1]))
    for k in range(len(parts)):
        parts[k] = parts_of_edge(model, continuing, poses, turns, k, q[k], q[k + 1], bounds, between, memory)


@compiled
def cut_edges(model, continuing, poses, turns, q, bounds, parts, rows, places, cut_poses):
    """Write the joint path with all cuts to `rows` (sum of parts + 1, n), their poses, and where they are: k + fraction
    of the way to pose k + 1."""
    memory, between = np.empty(edge_memory_size(model)), np.empty((MOST_PARTS, q.shape[1]))
    at = 0
    for k in range(len(parts)):
        parts_of_edge(model, continuing, poses, turns, k, q[k], q[k + 1], bounds, between, memory)
        for p in range(parts[k]):
            assign(rows[at], between[p - 1] if p > 0 else q[k])
            places[at] = k + p / parts[k]
            pose_between(poses, turns, k, p / parts[k], cut_poses[at])
            at += 1
    assign(rows[at], q[len(parts)])
    places[at] = len(parts)
    cut_poses[at] = poses[4 * len(parts) :]
