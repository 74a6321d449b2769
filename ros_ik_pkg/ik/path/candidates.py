"""Candidates of every pose of a path: solutions continued from the neighbouring poses, and newly found ones.

One descent from a solution continues it to the next pose, so a branch costs two or three iterations at each pose. A
search for all solutions, at regular intervals and where a branch is lost, finds branches that begin; they are
continued backwards too.
"""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import compiled, kernel
from ros_ik_pkg.ik.kernel.data_layout import unpack_model
from ros_ik_pkg.ik.kernel.linalg import assign
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.search.entry import FOUND, STATUS, WIDTH
from ros_ik_pkg.ik.search.solutions import same_solution
from ros_ik_pkg.ik.step.limits import TURN

SEARCH_EVERY = 50  # poses between two searches for all solutions
SEARCH_AGAIN = 5  # least poses between two searches if branches are lost


@compiled
def find_candidates(model, solve, continuing, searching, poses, seed, spacing, first, stop, candidates, counts, since):
    """Write the candidates of poses `first` to `stop` - 1; those of pose `first` - 1 are known.

    Parameters
    ----------
    model : packed arm; joints that may turn a whole turn have no limits in it, so that branches do not end there
    solve : `solve_range.as_argument()`
    continuing, searching : SolveOptions.numbers of a single descent, and of a search for all solutions
    poses : (4 N, 4) poses of the tip in the base frame
    seed : (n,) where the search at the first pose starts
    spacing : how far the candidates of a pose are apart, in the joint that differs most [rad or m]; 0 for all solutions
    candidates : (N, m, n) out
    counts : (N,) int64 out, number of candidates of each pose
    since : (1,) int64, poses since the last search for all solutions; kept between calls

    """
    m, n = candidates.shape[1:]
    memory = np.empty(n + n + WIDTH + m * n)
    _find(model, solve, continuing, searching, poses, seed, spacing, first, stop, candidates, counts, since, memory)


@kernel
def _find(model, solve, continuing, searching, poses, seed, spacing, first, stop, candidates, counts, since, memory):
    """Implement `find_candidates`."""
    geometry, _, _ = unpack_model(model)
    m, n = candidates.shape[1:]
    start = shaped(memory, 0, (n,))
    out = shaped(memory, n, (1, n + WIDTH))
    answers, nothing = shaped(memory, 2 * n + WIDTH, (m, n)), shaped(memory, 0, (0, 0))
    for k in range(first, stop):
        pose, count, before, lost = shaped(poses, 16 * k, (4, 4)), 0, 0, False
        if k > 0:
            before = counts[k - 1]
            for c in range(before):
                assign(start, candidates[k - 1, c])
                solve(model, continuing, pose, start, start, out, nothing, nothing, nothing)
                if out[0, n + STATUS] == 0.0:
                    count = add(geometry, out, candidates[k], count, spacing)
                else:
                    lost = True
        since[0] += 1
        again = lost and (count == 0 or since[0] >= SEARCH_AGAIN)
        if k == 0 or since[0] >= SEARCH_EVERY or again:
            since[0] = 0
            assign(start, seed if k == 0 or before == 0 else candidates[k - 1, 0])
            solve(model, searching, pose, start, start, out, answers, nothing, nothing)
            known = count
            for a in range(int(out[0, n + FOUND])):
                assign(out[0], answers[a])
                count = add(geometry, out, candidates[k], count, spacing)
            counts[k] = count
            for c in range(known, count):
                continue_backwards(
                    model, solve, geometry, continuing, poses, k, c, spacing, candidates, counts, start, out
                )
        counts[k] = count


@kernel
def continue_backwards(model, solve, geometry, continuing, poses, k, c, spacing, candidates, counts, start, out):
    """Continue candidate c of pose k to the poses before it, until it meets a known candidate or ends."""
    n, nothing = len(start), shaped(start, 0, (0, 0))
    assign(start, candidates[k, c])
    for i in range(k - 1, -1, -1):
        solve(model, continuing, shaped(poses, 16 * i, (4, 4)), start, start, out, nothing, nothing, nothing)
        if out[0, n + STATUS] != 0.0:
            return
        count = add(geometry, out, candidates[i], counts[i], spacing)
        if count == counts[i]:
            return
        counts[i] = count
        for j in range(n):
            start[j] = out[0, j]


@kernel
def add(geometry, out, candidates, count, spacing):
    """Append the solution in out[0] unless it is known or there is no room; return the new number of candidates."""
    q = out[0, : candidates.shape[1]]
    if count == len(candidates):
        return count
    for c in range(count):
        if same_solution(geometry, q, candidates[c]) or is_near(geometry, q, candidates[c], spacing):
            return count
    assign(candidates[count], q)
    return count + 1


@kernel
def is_near(geometry, q, other, spacing):
    """Return whether no joint is `spacing` or more apart, not counting whole turns."""
    for j in range(len(q)):
        step = abs(q[j] - other[j])
        if geometry.wraps[j]:
            step -= TURN * math.floor(step / TURN + 0.5)
        if abs(step) >= spacing:
            return False
    return True


@compiled
def normalise(candidates, counts, lower, upper, wraps):
    """Bring joints that may turn a whole turn to within a turn above the lower limit, without limits to [-pi, pi)."""
    for k in range(len(counts)):
        for c in range(counts[k]):
            for j in range(len(lower)):
                if wraps[j]:
                    low = lower[j] if lower[j] > -math.inf else -0.5 * TURN
                    q = candidates[k, c, j]
                    candidates[k, c, j] = q - TURN * math.floor((q - low) / TURN)
