"""Smoother joint paths, compiled: rows solved more exactly; for redundant arms, averages along the path.

The errors that tolerances leave differ from row to row, and would show as accelerations.
"""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import compiled, kernel
from ros_ik_pkg.ik.kernel.linalg import assign
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.path.edges import MOST_PARTS, edge_memory_size, parts_of_edge
from ros_ik_pkg.ik.search.entry import STATUS, WIDTH

MOST_CHANGE = 1e-2  # rad or m that a joint of a row may move when the row is solved more exactly


@compiled
def sharpen(model, solve, exact, poses, q):
    """Solve each row of q (N, n) again from itself with the options `exact`, and keep solutions that are close to it.

    `poses` (4 N, 4) are those of the rows.
    """
    n = q.shape[1]
    _sharpen(model, solve, exact, poses, q, np.empty(2 * n + WIDTH))


@kernel
def _sharpen(model, solve, exact, poses, q, memory):
    """Implement `sharpen`."""
    n = q.shape[1]
    start = shaped(memory, 0, (n,))
    out, nothing = shaped(memory, n, (1, n + WIDTH)), shaped(memory, 0, (0, 0))
    for k in range(len(q)):
        assign(start, q[k])
        solve(model, exact, shaped(poses, 16 * k, (4, 4)), start, start, out, nothing, nothing, nothing)
        near = out[0, n + STATUS] == 0.0
        for j in range(n):
            near = near and abs(out[0, j] - start[j]) < MOST_CHANGE
        if near:
            for j in range(n):
                q[k, j] = out[0, j]


@compiled
def smooth(model, solve, continuing, poses, turns, q, width, most_steps, bounds, fresh):
    """Write the joint path q averaged over `width` poses to either side to `fresh` (N, n); return whether it is valid.

    It is if every pose is solved and every edge keeps to the line. The first and the last row stay.

    The other arguments are those of extend_route.
    """
    count, n = q.shape
    sums = np.zeros((count + 1, n))
    for k in range(count):
        for j in range(n):
            sums[k + 1, j] = sums[k, j] + q[k, j]
    memory = np.empty(2 * n + WIDTH)
    room = np.empty(edge_memory_size(model))
    cuts = np.empty((MOST_PARTS, n + 1))
    return _smooth(
        model, solve, continuing, poses, turns, q, width, most_steps, bounds, fresh, sums, memory, room, cuts
    )


@kernel
def _smooth(model, solve, continuing, poses, turns, q, width, most_steps, bounds, fresh, sums, memory, room, cuts):
    """Implement `smooth`."""
    count, n = q.shape
    start = shaped(memory, 0, (n,))
    out, nothing = shaped(memory, n, (1, n + WIDTH)), shaped(memory, 0, (0, 0))
    assign(fresh[0], q[0])
    for k in range(1, count):
        w = min(width, k, count - 1 - k)
        if w == 0:
            assign(fresh[k], q[k])
        else:
            for j in range(n):
                start[j] = (sums[k + w + 1, j] - sums[k - w, j]) / (2 * w + 1)
            solve(model, continuing, shaped(poses, 16 * k, (4, 4)), start, start, out, nothing, nothing, nothing)
            if out[0, n + STATUS] != 0.0:
                return False
            for j in range(n):
                fresh[k, j] = out[0, j]
        for j in range(n):
            step = abs(fresh[k, j] - fresh[k - 1, j])
            if step > bounds[2] or step > most_steps[k - 1, j]:
                return False
        if parts_of_edge(
            model, solve, continuing, poses, turns, k - 1, fresh[k - 1], fresh[k], bounds, cuts, room
        ) == 0:
            return False
    return True
