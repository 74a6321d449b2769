"""The compiled entry point for two tips: the search of `search.py` for a pair of chains, compiled at its first call.

Solving one chain neither compiles nor loads any of it. It has no trace and no objectives for the null space.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

import ros_ik_pkg.ik.descent.pair
import ros_ik_pkg.ik.search.pair_starts
import ros_ik_pkg.ik.step.pair  # noqa: F401 the variants of a pair are known once these are imported
from ros_ik_pkg.ik.collision.obstruction import make_obstruction, obstruction_size
from ros_ik_pkg.ik.kernel.clock import now
from ros_ik_pkg.ik.kernel.compiled import entry_point, inlined, kernel
from ros_ik_pkg.ik.kernel.data_layout import Preferences, Solutions, tuning_of, unpack_model
from ros_ik_pkg.ik.kernel.linalg import ROWS, assign, fill
from ros_ik_pkg.ik.kernel.numba_insides import shaped, small_loops
from ros_ik_pkg.ik.kernel.pair_layout import (
    PairGeometry,
    PairReach,
    PairStarts,
    make_pair_workspace,
    pair_memory_size,
)
from ros_ik_pkg.ik.kinematics.pair import make_pair_task
from ros_ik_pkg.ik.search.entry import (
    ATTEMPTS,
    COMPLETENESS,
    FOUND,
    JOINT_DISTANCE,
    JOINT_WEIGHTS,
    LIMITS_MASK,
    NOT_AN_ARGUMENT,
    ORIENTATION_ERROR,
    POSITION_ERROR,
    SEED_CLIPPED,
    STATUS,
    STEPS,
    TIME,
    TOLERANCES,
    WEIGHTS,
    WIDTH,
    finite,
    is_pose,
    largest_gap,
)
from ros_ik_pkg.ik.search.search import search
from ros_ik_pkg.ik.step.limits import bring_inside, limits_mask
from ros_ik_pkg.ik.step.weights import scale_joints

VECTOR, MATRIX = types.Array(types.float64, 1, 'C'), types.Array(types.float64, 2, 'C')
TARGETS = 3  # poses: the first tip's target, the second's, and the first's in the base frame


@entry_point(
    types.bool_,
    [VECTOR] * 2 + [types.Array(types.float32, 2, 'C')] + [VECTOR] * 2 + [MATRIX] + [VECTOR] * 4 + [MATRIX] * 2,
)
def solve_pair(first, second, starts, layout, numbers, targets, wanted, seed, reference, row, answers, touching):
    """Solve one pair of targets (12, 4) from a seed (n,); write q and the figures to `row`.

    Returns False if an argument is invalid, as `solve_one` does. `first` and `second` are packed chains over the same
    variables, the first followed by a packed scene if contact counts. `starts` are those of `make_pair_starts`;
    `layout` is the size of their groups, then the side of each variable. `wanted` (2,) is 0 for a tip without a
    target. `answers` and `touching` are as in `solve_range`.
    """
    n, m = int(first[0]), starts.shape[1]
    groups = m // int(layout[0])
    scores = np.empty(2 * m + groups, np.float32)
    memory = np.empty(3 + pair_memory_size(first, second) + obstruction_size(first) + max(1, len(answers)) * (n + 1)
                      + 2 * ROWS)  # fmt: skip
    _solve_pair(first, second, starts, layout, numbers, targets, wanted, seed, reference, row, answers, touching,
                scores, memory)  # fmt: skip
    return row[n + STATUS] >= 0.0


@kernel
def _solve_pair(
    first, second, starts, layout, numbers, targets, wanted, seed, reference, row, answers, touching, scores, memory
):
    """Implement `solve_pair`."""
    small_loops()
    n, m = int(first[0]), starts.shape[1]
    integers = shaped(memory, 0, (3,)).view(np.int64)
    a = 3 + pair_memory_size(first, second)
    b = a + obstruction_size(first)
    kept = max(1, len(answers))
    c = b + kept * (n + 1)
    one, ranks = shaped(memory, b, (kept, n)), shaped(memory, b + kept * n, (kept,))
    weights, tolerances = shaped(memory, c, (2, ROWS)), shaped(numbers, TOLERANCES, (ROWS,))
    joint_weights = shaped(numbers, JOINT_WEIGHTS + 1, (int(numbers[JOINT_WEIGHTS]),))
    weighted = len(joint_weights) == n
    work = make_pair_workspace(
        first, second, shaped(memory, 3, (a - 3,)), shaped(scores, 2 * m, (len(scores) - 2 * m,)), integers,
        n if weighted else 0,
    )  # fmt: skip
    began = now(work.clock)
    q, figures = shaped(row, 0, (n,)), shaped(row, n, (WIDTH,))
    fill(figures, math.nan)
    figures[STATUS] = NOT_AN_ARGUMENT
    for k in range(TARGETS):
        if not is_pose(shaped(targets, 16 * k, (4, 4))):
            return
    if not (len(seed) == n and len(reference) == n and finite(seed) and finite(reference)):
        return
    if not (weighted or len(joint_weights) == 0):
        return
    tuning = tuning_of(numbers)
    geometry, reach = pair_of(first, second)
    scale_joints(joint_weights, work.scales)
    for r in range(ROWS):
        weights[0, r], weights[1, r] = wanted[0] * numbers[WEIGHTS + r], wanted[1] * numbers[WEIGHTS + r]
    assign(work.first.weights, weights[0])
    assign(work.second.weights, weights[1])
    assign(work.q, seed)
    figures[SEED_CLIPPED] = tuning.respect_limits > 0.0 and bring_inside(geometry, work.q)
    obstruction = make_obstruction(first, shaped(memory, a, (b - a,)), touching, touching)
    fill(ranks, math.inf)
    fill(obstruction.ranks, math.inf)
    task = make_pair_task(targets, weights[0], weights[1], tolerances, tuning.task_frame)
    from_starts = PairStarts(
        shaped(starts, 0, (n, m)), shaped(starts, n * m, (7, m)), shaped(starts, (n + 7) * m, (7, m)),
        shaped(layout, 1, (n,)), int(layout[0]), shaped(scores, 0, (m,)), shaped(scores, m, (m,)),
    )  # fmt: skip
    preferences = Preferences(reference, joint_weights, reference, obstruction)
    solutions = Solutions(answers if len(answers) > 0 else one, ranks)
    status, steps, attempts, found, position_error, orientation_error, known = search(
        geometry, from_starts, reach, task, tuning, preferences, began, solutions, work, None
    )
    assign(q, work.q)
    figures[STATUS], figures[FOUND], figures[STEPS], figures[ATTEMPTS] = status, found, steps, attempts
    figures[POSITION_ERROR], figures[ORIENTATION_ERROR] = position_error, orientation_error
    figures[JOINT_DISTANCE] = largest_gap(q, reference)
    figures[LIMITS_MASK], figures[COMPLETENESS] = limits_mask(geometry, q), known
    figures[TIME] = now(work.clock) - began


@inlined
def pair_of(first, second):
    """Return the geometry and the reach of two packed chains."""
    one, reach, _ = unpack_model(first)
    other, other_reach, _ = unpack_model(second)
    lengths = reach.lengths if reach.lengths[1] > other_reach.lengths[1] else other_reach.lengths
    return PairGeometry(one, other, one.lower, one.upper, one.wraps), PairReach(reach, other_reach, lengths)
