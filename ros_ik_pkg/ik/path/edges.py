"""Whether the joints can move from one pose of a path to the next while the tip stays on its line.

If the joints bend (near a singularity they do while the tip goes straight), the edge is cut where it is needed: at each
cut the joints are brought back to the line.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import compiled, inlined, kernel
from ros_ik_pkg.ik.kernel.data_layout import TUNABLES, buffer_size, make_records, tuning_of, unpack_model
from ros_ik_pkg.ik.kernel.linalg import assign
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.kinematics.pose_error import difference, rotation_log
from ros_ik_pkg.ik.kinematics.task import look_at_error, make_task
from ros_ik_pkg.ik.search.entry import STATUS, WIDTH

MOST_PARTS = 64
DEEPEST = 10  # halvings of an edge
LOOK_STEP = 0.15  # rad or m of the joint that moves most, between two looks at the tip
FAR = 1.0  # rad or m: joints that move this far are near a singularity, or on two branches that nothing joins
STRAY = 0.05  # rad or m that a cut may be away from the middle of its part, more than the joints move on the edge
SMALL_ANGLE = 1e-8  # rad


class EdgeWork(NamedTuple):
    """The memory of parts_of_edge."""

    scratch: np.ndarray  # of a look at the tip
    start: np.ndarray  # (n,) joints at the start of a part
    middle: np.ndarray  # (n,)
    out: np.ndarray  # (1, n + WIDTH)
    pose: np.ndarray  # (4, 4)
    waiting: np.ndarray  # (DEEPEST + 1, n) joints at the ends of parts
    fractions: np.ndarray  # (DEEPEST + 1,) of the edge that these ends are at
    nothing: np.ndarray  # (0, 0)


@inlined
def edge_sizes(model):
    """Return how many numbers each array of an EdgeWork has."""
    n = int(model[0])
    return 3 + buffer_size(model), n, n, n + WIDTH, 16, (DEEPEST + 1) * n, DEEPEST + 1


@kernel
def edge_memory_size(model):
    """Return how many numbers an EdgeWork has."""
    total = 0
    for size in edge_sizes(model):
        total += size
    return total


@inlined
def make_edge_work(model, memory):
    """Cut an EdgeWork from a block of memory; to be called by kernels only."""
    n = int(model[0])
    scratch, start, middle, out, pose, waiting, _ = edge_sizes(model)
    c = scratch + start
    d = c + middle
    e = d + out
    f = e + pose
    return EdgeWork(
        shaped(memory, 0, (scratch,)), shaped(memory, scratch, (n,)), shaped(memory, c, (n,)),
        shaped(memory, d, (1, n + WIDTH)), shaped(memory, e, (4, 4)), shaped(memory, f, (DEEPEST + 1, n)),
        shaped(memory, f + waiting, (DEEPEST + 1,)), shaped(memory, 0, (0, 0)),
    )  # fmt: skip


@compiled
def rotation_vectors(poses):
    """Return the rotation from each pose to the next (N - 1, 3), axis times angle in base axes; poses (4 N, 4)."""
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
    """Write the pose at a fraction of the way from pose k to the next: position linear, orientation by SLERP.

    R = exp(fraction * w) R_k, by the formula of Rodrigues.
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
    """Return whether the tip at q (n,) is within both tolerances of a pose, besides the tolerances of the task."""
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
def parts_of_edge(model, solve, continuing, poses, turns, k, a, b, bounds, cuts, memory):
    """Return into how many parts the edge from joints a at pose k to joints b at the next is cut, 0 if there is none.

    In each part the joints move in a straight line that keeps the tip on its line. A part that does not is halved: the
    joints at its middle are solved on the line. `bounds` (4,): the tolerances [m, rad], the longest step of a joint
    [rad or m], parts at most. `cuts` (MOST_PARTS, n + 1) receives the joints at the end of each part, and the fraction
    of the edge that they are at.
    """
    n = len(a)
    work, ends = make_edge_work(model, memory), cuts[:, n]
    largest, waiting, parts = 0.0, 1, 0
    for j in range(n):
        largest = max(largest, abs(b[j] - a[j]))
    if largest > FAR and not stays_near(model, continuing, poses, turns, k, a, b, bounds, work):
        return 0
    # The ends of the parts that are still to be looked at, the nearest last.
    assign(work.waiting[0], b)
    work.fractions[0] = 1.0
    assign(work.start, a)
    done = 0.0
    while waiting > 0:
        end, after = work.fractions[waiting - 1], work.waiting[waiting - 1]
        if keeps_to_line(model, continuing, poses, turns, k, work.start, done, after, end, bounds, work):
            assign(cuts[parts, :n], after)
            assign(work.start, after)
            ends[parts] = done = end
            parts, waiting = parts + 1, waiting - 1
        elif parts + waiting >= bounds[3] or waiting > DEEPEST:
            return 0
        else:
            half = 0.5 * (done + end)
            for j in range(n):
                work.middle[j] = 0.5 * (work.start[j] + after[j])
            pose_between(poses, turns, k, half, work.pose)
            nothing = work.nothing
            solve(model, continuing, work.pose, work.middle, work.middle, work.out, nothing, nothing, nothing)
            if work.out[0, n + STATUS] != 0.0:
                return 0
            for j in range(n):
                if abs(work.out[0, j] - work.middle[j]) > largest + STRAY:
                    return 0
                work.waiting[waiting, j] = work.out[0, j]
            work.fractions[waiting] = half
            waiting += 1
    return parts


@kernel
def stays_near(model, numbers, poses, turns, k, a, b, bounds, work):
    """Return whether the tip stays near edge k in the middle of a straight motion of the joints from a to b: about as
    near as the edge is long, since near a singularity joints can move far while the tip hardly moves."""
    square, angle = 0.0, 0.0
    for i in range(3):
        square += (poses[4 * k + 4 + i, 3] - poses[4 * k + i, 3]) ** 2
        angle += turns[k, i] ** 2
    for j in range(len(a)):
        work.middle[j] = 0.5 * (a[j] + b[j])
    pose_between(poses, turns, k, 0.5, work.pose)
    length = bounds[0] + 2.0 * math.sqrt(square)
    return on_line(model, numbers, work.pose, work.middle, length, bounds[1] + 2.0 * math.sqrt(angle), work.scratch)


@kernel
def keeps_to_line(model, numbers, poses, turns, k, a, first, b, last, bounds, work):
    """Return whether the tip is on its line between two fractions of edge k, while the joints move straight from a to
    b: in the middle, and if a joint moves far at more places."""
    n, step = len(a), 0.0
    for j in range(n):
        step = max(step, abs(b[j] - a[j]))
    places = 2
    while step > places * LOOK_STEP:
        places *= 2
    for i in range(1, places):
        # The middle first, because it is where a straight motion of the joints is worst.
        place = (i + places // 2 - 2) % (places - 1) + 1
        part = place / places
        for j in range(n):
            work.middle[j] = a[j] + part * (b[j] - a[j])
        pose_between(poses, turns, k, first + part * (last - first), work.pose)
        if not on_line(model, numbers, work.pose, work.middle, bounds[0], bounds[1], work.scratch):
            return False
    return True


@compiled
def count_parts(model, solve, continuing, poses, turns, q, bounds, parts):
    """Write the number of parts of each edge of a joint path q (N, n) to `parts` (N - 1,) int64, 0 if it is no edge."""
    memory, cuts = np.empty(edge_memory_size(model)), np.empty((MOST_PARTS, q.shape[1] + 1))
    for k in range(len(parts)):
        parts[k] = parts_of_edge(model, solve, continuing, poses, turns, k, q[k], q[k + 1], bounds, cuts, memory)


@compiled
def cut_edges(model, solve, continuing, poses, turns, q, bounds, parts, rows, places, cut_poses):
    """Write the joint path with all cuts to `rows` (sum of parts + 1, n), their poses to `cut_poses`, and their places
    to `places`: k + the fraction of the way to pose k + 1."""
    n = q.shape[1]
    memory, cuts = np.empty(edge_memory_size(model)), np.empty((MOST_PARTS, n + 1))
    assign(rows[0], q[0])
    places[0] = 0.0
    cut_poses[0] = poses[:4]
    at = 1
    for k in range(len(parts)):
        parts_of_edge(model, solve, continuing, poses, turns, k, q[k], q[k + 1], bounds, cuts, memory)
        for p in range(parts[k]):
            last = p == parts[k] - 1
            assign(rows[at], q[k + 1] if last else cuts[p, :n])
            places[at] = k + 1 if last else k + cuts[p, n]
            pose_between(poses, turns, k, places[at] - k, cut_poses[at])
            if last:
                cut_poses[at] = poses[4 * k + 4 : 4 * k + 8]
            at += 1
