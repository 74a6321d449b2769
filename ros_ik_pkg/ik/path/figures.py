"""Errors of the tip along a joint path and its distance from singularities; compiled."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik.descent.recorder import singular_figures
from ros_ik_pkg.ik.kernel.compiled import compiled, kernel
from ros_ik_pkg.ik.kernel.data_layout import TUNABLES, buffer_size, make_records, tuning_of, unpack_model
from ros_ik_pkg.ik.kernel.linalg import assign
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.kinematics.task import look, look_at_error, make_task
from ros_ik_pkg.ik.path.edges import pose_between
from ros_ik_pkg.ik.path.timing import quintic

PLACES = 8  # parts of an interval; the tip is compared with its line at their ends
NEAREST_STEPS = 3  # iterations for the place on the line that is nearest to the tip


@compiled
def pose_figures(model, numbers, poses, q):
    """Return position error [m], orientation error [rad] and the task's sigma_min at each row of q (N, n): (N, 3)."""
    out = np.empty((len(q), 3))
    _pose_figures(model, numbers, poses, q, out, np.empty(3 + buffer_size(model)))
    return out


@kernel
def _pose_figures(model, numbers, poses, q, out, memory):
    """Implement `pose_figures`."""
    geometry, _, _ = unpack_model(model)
    integers, buffer = shaped(memory, 0, (3,)).view(np.int64), shaped(memory, 3, (buffer_size(model),))
    work, recorder, _ = make_records(
        model, buffer, shaped(memory, 0, (0,)).view(np.float32), integers, shaped(memory, 0, (0, 0)), 0
    )
    weights, tolerances = shaped(numbers, TUNABLES, (6,)), shaped(numbers, TUNABLES + 6, (6,))
    for k in range(len(q)):
        task = make_task(shaped(poses, 16 * k, (4, 4)), weights, tolerances, tuning_of(numbers).task_frame)
        assign(work.weights, weights)
        assign(work.q, q[k])
        out[k, 0], out[k, 1], _, _ = look(geometry, task, work)
        out[k, 2] = singular_figures(work.columns, work.weights, recorder)[0]


@compiled
def line_errors(model, numbers, poses, turns, q, durations, v, a):
    """Return the largest distance of the tip from its line in each interval of the motion, (N - 1, 2) [m, rad]."""
    out = np.zeros((len(durations), 2))
    n = q.shape[1]
    _line_errors(model, numbers, poses, turns, q, durations, v, a, out, np.empty(3 + buffer_size(model) + 16 + n))
    return out


@kernel
def _line_errors(model, numbers, poses, turns, q, durations, v, a, out, memory):
    """Implement `line_errors`: the tip is compared with the nearest place on its line; if the task leaves its position
    free, with the place at the same share of the joint step."""
    geometry, _, _ = unpack_model(model)
    n, size = q.shape[1], buffer_size(model)
    integers, buffer = shaped(memory, 0, (3,)).view(np.int64), shaped(memory, 3, (size,))
    work, _, _ = make_records(
        model, buffer, shaped(memory, 0, (0,)).view(np.float32), integers, shaped(memory, 0, (0, 0)), 0
    )
    pose = shaped(memory, 3 + size, (4, 4))
    weights, tolerances = shaped(numbers, TUNABLES, (6,)), shaped(numbers, TUNABLES + 6, (6,))
    placed = weights[0] > 0.0 and weights[1] > 0.0 and weights[2] > 0.0
    for k in range(len(durations)):
        start, end = shaped(poses, 16 * k, (4, 4)), shaped(poses, 16 * k + 16, (4, 4))
        length = 0.0
        for i in range(3):
            length += (end[i, 3] - start[i, 3]) ** 2
        for place in range(1, PLACES):
            t, along, square = durations[k] * place / PLACES, 0.0, 0.0
            for j in range(n):
                c = quintic(q[k, j], v[k, j], a[k, j], q[k + 1, j], v[k + 1, j], a[k + 1, j], durations[k])
                work.q[j] = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))))
                along += (work.q[j] - q[k, j]) * (q[k + 1, j] - q[k, j])
                square += (q[k + 1, j] - q[k, j]) ** 2
            fraction = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
            for step in range(NEAREST_STEPS):
                pose_between(poses, turns, k, fraction, pose)
                task = make_task(pose, weights, tolerances, tuning_of(numbers).task_frame)
                assign(work.weights, weights)
                position_error, orientation_error, _, _, p = look_at_error(geometry, task, work)
                if not (placed and length > 0.0) or step == NEAREST_STEPS - 1:
                    break
                ahead = 0.0
                for i in range(3):
                    ahead += (p[i] - pose[i, 3]) * (end[i, 3] - start[i, 3])
                fraction = min(max(fraction + ahead / length, 0.0), 1.0)
            out[k, 0], out[k, 1] = max(out[k, 0], position_error), max(out[k, 1], orientation_error)
