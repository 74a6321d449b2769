"""Where searches for two tips begin, and what proves a pair of targets out of reach.

Few random starts are near both targets. But once the shared variables are fixed, the arms are independent. So the
starts come in groups with the same shared variables, and within a group the nearest start of one arm is combined with
the nearest start of the other. Without shared variables there is one group.
"""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel, variant_of
from ros_ik_pkg.ik.kernel.linalg import fill
from ros_ik_pkg.ik.kernel.pair_layout import PairGeometry, PairStarts, PairTask
from ros_ik_pkg.ik.search.reach import out_of_reach
from ros_ik_pkg.ik.search.starts import (
    distance_of,
    nearest_start,
    next_start,
    r_sequence,
    reach_poses,
    sampling_range,
    score_starts,
)

GROUP = 64  # starts with the same shared variables
MANY_STARTS = 64 * GROUP
FEW_STARTS = 1024  # without shared variables, or for a relative target


def make_pair_starts(chains, first_model, second_model, shared, count, group):
    """Return (n + 14, count) float32: rows of joint positions [rad, m], then the poses of both tips, 7 rows each.

    `chains` are the Geometry of both, `shared` (n,) says whether a variable moves both tips, and `group` starts have
    the same shared variables.
    """
    ranges = [sampling_range(chain) for chain in chains]
    lower, upper = np.maximum(ranges[0][0], ranges[1][0]), np.minimum(ranges[0][1], ranges[1][1])
    shares = r_sequence(count, len(shared))
    if shared.any():
        shares[:, shared] = np.repeat(r_sequence(count // group, int(shared.sum())), group, axis=0)
    q = np.ascontiguousarray(lower + (upper - lower) * shares)
    largest = np.finfo(np.float32).max
    rows = np.clip(np.hstack([q, reach_poses(first_model, q), reach_poses(second_model, q)]).T, -largest, largest)
    return np.ascontiguousarray(rows, dtype=np.float32)


@variant_of(out_of_reach, PairGeometry)
def pair_out_of_reach(geometry, reach, task, tuning):
    """Return whether no configuration can reach one of the targets."""
    first = out_of_reach(geometry.first, reach.first, task.first, tuning)
    return first or out_of_reach(geometry.second, reach.second, task.second, tuning)


@variant_of(score_starts, PairTask)
def score_pair_starts(starts, task, scale, scores):
    """Write how far the best combination of each group is from the targets."""
    score_starts(starts.first, task.first_in_base, scale, starts.first_scores)
    score_starts(starts.second, task.second, scale, starts.second_scores)
    for k in range(len(scores)):
        score_group(starts, k, scores)


@kernel
def score_group(starts, k, scores):
    """Write how far the best unused combination of group k is from the targets."""
    a, b = best_of_group(starts.first_scores, starts.group, k), best_of_group(starts.second_scores, starts.group, k)
    scores[k] = max(starts.first_scores[a] + starts.second_scores[b], np.float32(0.0))  # rounding can be below zero


@kernel
def best_of_group(scores, group, k):
    """Return the start of group k with the lowest score."""
    best = k * group
    for i in range(k * group + 1, (k + 1) * group):
        if scores[i] < scores[best]:
            best = i
    return best


@variant_of(distance_of, PairStarts)
def distance_of_pair(starts, k, task):
    """Return the norm of both twist errors of the best combination of group k."""
    a, b = best_of_group(starts.first_scores, starts.group, k), best_of_group(starts.second_scores, starts.group, k)
    first, second = distance_of(starts.first, a, task.first_in_base), distance_of(starts.second, b, task.second)
    return math.sqrt(first * first + second * second)


@variant_of(next_start, PairStarts)
def next_pair_start(starts, attempt, first, work):
    """Write the start of attempt 1, 2, ... to work.q: the best unused combination; that of group `first` is the best
    of all. Of the two starts in it one is marked as used, in turn that of the first and of the second arm."""
    k = first if attempt == 1 else nearest_start(work.scores)
    if not work.scores[k] < np.inf:  # all used
        fill(work.scores, np.float32(0.0))
        fill(starts.first_scores, np.float32(0.0))
        fill(starts.second_scores, np.float32(0.0))
    a, b = best_of_group(starts.first_scores, starts.group, k), best_of_group(starts.second_scores, starts.group, k)
    combine_starts(starts, a, b, work.q)
    if attempt % 2 == 1:
        starts.first_scores[a] = np.inf
    else:
        starts.second_scores[b] = np.inf
    score_group(starts, k, work.scores)


@inlined
def combine_starts(starts, a, b, q):
    """Write start a to q, but take the variables that move only the second tip from start b."""
    for i in range(len(q)):
        q[i] = starts.q[i, b if starts.side[i] == 2.0 else a]
