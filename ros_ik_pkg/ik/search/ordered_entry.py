"""The compiled entry for two tasks in strict order; nothing of it is asked for if all rows are demanded.

It is for one chain, and does not look for solutions where the usual search has to: `ordered_solver` calls that then.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from ros_ik_pkg.ik.collision.obstruction import make_obstruction, obstruction_size
from ros_ik_pkg.ik.descent.descent import CONVERGED
from ros_ik_pkg.ik.descent.ordered import measure_in_order
from ros_ik_pkg.ik.kernel.clock import now
from ros_ik_pkg.ik.kernel.compiled import entry_point, kernel
from ros_ik_pkg.ik.kernel.data_layout import (
    Geometry,
    Preferences,
    Solutions,
    buffer_size,
    make_records,
    tuning_of,
    unpack_model,
)
from ros_ik_pkg.ik.kernel.linalg import ROWS, assign, fill
from ros_ik_pkg.ik.kernel.numba_insides import shaped, small_loops
from ros_ik_pkg.ik.kernel.ordered_layout import make_wish, wish_size
from ros_ik_pkg.ik.kinematics.forward import walk
from ros_ik_pkg.ik.kinematics.task import make_task, with_weights
from ros_ik_pkg.ik.search.entry import (
    ATTEMPTS,
    FOUND,
    JOINT_DISTANCE,
    JOINT_WEIGHTS,
    LIMITS_MASK,
    ORIENTATION_ERROR,
    POSITION_ERROR,
    SEED_CLIPPED,
    STATUS,
    STEPS,
    TIME,
    TOLERANCES,
    WEIGHTS,
    WIDTH,
    WISHED_ORIENTATION_ERROR,
    WISHED_POSITION_ERROR,
    WISHED_ROWS,
    largest_gap,
    open_row,
)
from ros_ik_pkg.ik.search.ordered_search import search_in_order
from ros_ik_pkg.ik.search.solutions import forget_touching
from ros_ik_pkg.ik.step.limits import bring_inside, limits_mask
from ros_ik_pkg.ik.step.weights import scale_joints

NOT_FOUND = -3.0  # status of a row for which no descent in order ended where the demanded rows hold
VECTOR, MATRIX = types.Array(types.float64, 1, 'C'), types.Array(types.float64, 2, 'C')
STARTS = types.Array(types.float32, 2, 'C')


@entry_point(types.int64, [VECTOR] * 2 + [types.int64, STARTS, VECTOR, MATRIX] + [VECTOR] * 2 + [MATRIX] * 4)
def solve_in_order(model, numbers, wished_rows, starts, free, targets, seeds, references, out, answers, touching, rows):
    """Solve N targets of which some rows are wished for only; the arguments are those of `solve_range`, and:

    wished_rows: a number whose bit r is set if row r is wished for. starts, free: those of `make_ordered_starts`.
    """
    n = int(model[0])
    size = 3 + buffer_size(model) + starts.shape[1] // 2 + obstruction_size(model) + 2 * ROWS + 2 * n + wish_size(n)
    memory = np.empty(size + max(1, len(answers)))
    return _solve_in_order(
        model, numbers, wished_rows, starts, free, targets, seeds, references, out, answers, touching, rows, memory
    )


@kernel
def _solve_in_order(
    model, numbers, wished_rows, starts, free, targets, seeds, references, out, answers, touching, rows, memory
):
    """Implement `solve_in_order`. Its memory: three integers, a workspace, scores of the starts, an Obstruction,
    weights of demanded and wished rows, limits, a Wish, ranks of answers."""
    small_loops()
    n = out.shape[1] - WIDTH
    whole_geometry, reach, _ = unpack_model(model)
    a = 3 + buffer_size(model)
    b = a + starts.shape[1] // 2
    c = b + obstruction_size(model)
    d = c + 2 * ROWS + 2 * n
    f = d + wish_size(n)
    integers, buffer = shaped(memory, 0, (3,)).view(np.int64), shaped(memory, 3, (a - 3,))
    scores, ranks = shaped(memory, a, (b - a,)).view(np.float32), shaped(memory, f, (len(memory) - f,))
    obstruction = make_obstruction(model, shaped(memory, b, (c - b,)), touching, rows)
    integers[2] = 0
    tuning = tuning_of(numbers)
    weights, tolerances = shaped(numbers, WEIGHTS, (ROWS,)), shaped(numbers, TOLERANCES, (ROWS,))
    joint_weights = shaped(numbers, JOINT_WEIGHTS + 1, (int(numbers[JOINT_WEIGHTS]),))
    held, wished = shaped(memory, c, (ROWS,)), shaped(memory, c + ROWS, (ROWS,))
    for r in range(ROWS):
        wished[r] = weights[r] if wished_rows >> r & 1 else 0.0
        held[r] = weights[r] - wished[r]
    lower, upper = shaped(memory, c + 2 * ROWS, (n,)), shaped(memory, c + 2 * ROWS + n, (n,))
    posture = len(numbers) - JOINT_WEIGHTS - 1 - len(joint_weights)
    fits = len(joint_weights) in (0, n) and posture in (0, n)
    work, recorder, one = make_records(model, buffer, scores, integers, rows, len(joint_weights) if fits else 0)
    kept = answers if len(answers) > 0 else one
    for k in range(len(out)):
        began = now(work.clock)
        q, row, T, reference, good = open_row(k, n, targets, seeds, references, out)
        if not (fits and good):
            continue
        assign(work.q, q)
        row[SEED_CLIPPED] = tuning.respect_limits > 0.0 and bring_inside(whole_geometry, work.q)
        geometry = within_jump(whole_geometry, tuning, reference, lower, upper)
        if tuning.respect_limits > 0.0 and tuning.max_joint_jump > 0.0:
            bring_inside(geometry, work.q)
        fill(ranks, math.inf)
        forget_touching(obstruction)
        scale_joints(joint_weights, work.scales)
        task = make_task(T, held, tolerances, tuning.task_frame)
        pose = make_task(T, weights, tolerances, tuning.task_frame)
        preferences = Preferences(reference, joint_weights, reference, obstruction)
        wish = make_wish(with_weights(task, wished), n, shaped(memory, d, (f - d,)))
        stop_time = began + tuning.deadline if tuning.deadline > 0.0 else math.inf
        steps, attempts, found = search_in_order(
            geometry, starts, free, reach, pose, task, wish, tuning, preferences, stop_time, Solutions(kept, ranks),
            work, recorder,
        )  # fmt: skip
        R, p = walk(geometry, work.q, work.joints)
        position, orientation, wished_position, wished_orientation, _ = measure_in_order(task, wish, R, p, work)
        assign(q, work.q)
        row[STATUS], row[FOUND] = CONVERGED if found > 0 else NOT_FOUND, found
        row[STEPS], row[ATTEMPTS] = steps, attempts
        row[POSITION_ERROR] = math.hypot(position, wished_position)
        row[ORIENTATION_ERROR] = math.hypot(orientation, wished_orientation)
        row[JOINT_DISTANCE] = largest_gap(q, reference)
        row[LIMITS_MASK] = limits_mask(whole_geometry, q)
        row[WISHED_ROWS] = wished_rows
        row[WISHED_POSITION_ERROR], row[WISHED_ORIENTATION_ERROR] = wished_position, wished_orientation
        row[TIME] = now(work.clock) - began
    return integers[2]


@kernel
def within_jump(geometry, tuning, reference, lower, upper):
    """Return the geometry with limits, in `lower` and `upper`, that are no further from the reference than a joint may
    jump: so the wish is as near as that allows."""
    jump = tuning.max_joint_jump if tuning.max_joint_jump > 0.0 else math.inf
    for i in range(len(lower)):
        lower[i] = max(geometry.lower[i], min(reference[i] - jump, geometry.upper[i]))
        upper[i] = min(geometry.upper[i], max(reference[i] + jump, geometry.lower[i]))
    return Geometry(
        geometry.placements, geometry.prismatic, geometry.variable, geometry.multiplier, geometry.offset, lower, upper,
        geometry.wraps,
    )  # fmt: skip
