"""The compiled entry points: every solve, alone or in a batch, with or without a trace, goes through `solve_rows`."""

from __future__ import annotations

import math

import numpy as np
from numba import types

import ros_ik_pkg.ik.kinematics.usual
import ros_ik_pkg.ik.step.usual  # noqa: F401 the variants for solve_usual are known once these are imported
from ros_ik_pkg.ik.collision.obstruction import make_obstruction, obstruction_size
from ros_ik_pkg.ik.descent.descent import CONVERGED
from ros_ik_pkg.ik.descent.objectives import NONE
from ros_ik_pkg.ik.descent.recorder import singular_figures
from ros_ik_pkg.ik.kernel.clock import now
from ros_ik_pkg.ik.kernel.compiled import entry_point, inlined, kernel
from ros_ik_pkg.ik.kernel.data_layout import (
    TUNABLES,
    Preferences,
    buffer_size,
    make_records,
    make_solutions,
    packed_size,
    tuning_of,
    unpack_model,
)
from ros_ik_pkg.ik.kernel.linalg import ROWS, assign, fill
from ros_ik_pkg.ik.kernel.numba_insides import on_stack, shaped, small_loops
from ros_ik_pkg.ik.kinematics.task import look, make_task
from ros_ik_pkg.ik.search.search import FIRST, NOT_COMPILED, search
from ros_ik_pkg.ik.search.solutions import forget_touching
from ros_ik_pkg.ik.solution import FIGURES
from ros_ik_pkg.ik.step.limits import bring_inside, limits_mask
from ros_ik_pkg.ik.step.methods import ADAPTIVE_DLS
from ros_ik_pkg.ik.step.weights import scale_joints

# Status of a row with an invalid target, seed or reference, or with lists per joint of the wrong length
NOT_AN_ARGUMENT = -1.0
# Offsets of the lists in the numbers of SolveOptions: two lists of six, then the joint weights, preceded by their
# count, and the posture. The last two may be empty.
WEIGHTS = TUNABLES
TOLERANCES = WEIGHTS + ROWS
JOINT_WEIGHTS = TOLERANCES + ROWS
ROTATION_TOLERANCE = 1e-3  # largest component of R R^T - I that still counts as a rotation


STATUS, FOUND, STEPS, ATTEMPTS, POSITION_ERROR, ORIENTATION_ERROR = (
    FIGURES.index(name)
    for name in ('status', 'found', 'iterations', 'attempts', 'position_error', 'orientation_error')
)
JOINT_DISTANCE, SIGMA_MIN, LIMITS_MASK, SEED_CLIPPED, COMPLETENESS, TIME = (
    FIGURES.index(name)
    for name in ('joint_distance', 'sigma_min', 'limits_mask', 'seed_clipped', 'completeness', 'solve_time')
)
WISHED_ROWS, WISHED_POSITION_ERROR, WISHED_ORIENTATION_ERROR = (
    FIGURES.index(name) for name in ('wished_rows', 'wished_position_error', 'wished_orientation_error')
)
WIDTH = len(FIGURES)


ONE_TARGET = (
    [types.Array(types.float64, 1, 'C')] * 2  # an arm's and SolveOptions' numbers
    + [types.Array(types.float64, d, 'A', readonly=True) for d in (2, 1)]  # any strides, so Python checks none
    + [types.Array(types.float64, 1, 'C')]
)


@entry_point(types.bool_, ONE_TARGET)
def solve_usual(model, numbers, target, seed, row):
    """Solve as `solve_one` does, if `is_usual` holds and a descent by the default method leads to a solution; else the
    status is NOT_COMPILED.

    It compiles in half of the time, so a node uses it until `solve_one` is compiled.
    """
    return _solve_one(model, numbers, target, seed, row, None)


@entry_point(types.bool_, ONE_TARGET)
def solve_one(model, numbers, target, seed, row):
    """Solve one target (4, 4) from a seed (n,), which is also the reference; write q and the figures to `row`.

    Returns False if an argument is invalid (NOT_AN_ARGUMENT; a wrong shape counts too) or NOT_COMPILED applies. It
    takes fewer arrays than `solve_range`, because each array that is passed into compiled code costs 0.06 us.
    """
    return _solve_one(model, numbers, target, seed, row, shaped(row, 0, (0, 0)))


@inlined
def _solve_one(model, numbers, target, seed, row, rows):
    """Implement `solve_one`; `rows` is an empty trace, or None to leave out what solve_usual leaves out."""
    n = len(row) - WIDTH
    if target.shape != (4, 4) or len(seed) != n:
        return False
    memory = on_stack(16 + n + memory_size(model, 1))
    goal, start = shaped(memory, 0, (4, 4)), shaped(memory, 16, (n,))
    for i in range(4):
        for j in range(4):
            goal[i, j] = target[i, j]
    for i in range(n):
        start[i] = seed[i]
    out, nothing = shaped(row, 0, (1, len(row))), shaped(row, 0, (0, 0))
    rest = shaped(memory, 16 + n, (len(memory) - 16 - n,))
    solve_rows(model, numbers, goal, start, start, out, nothing, nothing, rows, rest)
    return row[n + STATUS] >= 0.0


@entry_point(types.int64, [types.Array(types.float64, d, 'C') for d in (1, 1, 2, 1, 1, 2, 2, 2, 2)])
def solve_range(model, numbers, targets, seeds, references, out, answers, touching, rows):
    """Solve N targets (4 N, 4) from seeds (N n,) against references (N n,); return the number of iterates.

    Row k of `out` (N, n + len(FIGURES)) receives q, then the figures. `answers` (k, n) receives the k nearest
    solutions of the last target, `touching` (MOST_TOUCHING, n) the configurations that reach the last target but are
    not clear of contact, and `rows` every iterate until it is full. Each of the three may have length 0. `model` is a
    packed arm, followed by a packed scene if contact counts; `numbers` are those of SolveOptions.
    """
    memory = np.empty(memory_size(model, max(1, len(answers))))
    return solve_rows(model, numbers, targets, seeds, references, out, answers, touching, rows, memory)


@inlined
def memory_size(model, answers):
    """Return how many float64 solve_rows needs, in one block because each allocation takes time."""
    return 3 + buffer_size(model) + int(model[2]) // 2 + obstruction_size(model) + answers


@kernel
def solve_rows(model, numbers, targets, seeds, references, out, answers, touching, rows, memory):
    """Implement `solve_range`. `memory` holds three integers, a workspace, the scores of the starts, an Obstruction
    and the ranks of the answers."""
    small_loops()
    n = out.shape[1] - WIDTH
    geometry, reach, starts = unpack_model(model)
    a = 3 + buffer_size(model)
    b = a + starts.shape[1] // 2
    c = b + obstruction_size(model)
    integers, buffer = shaped(memory, 0, (3,)).view(np.int64), shaped(memory, 3, (a - 3,))
    scores, ranks = shaped(memory, a, (b - a,)).view(np.float32), shaped(memory, c, (len(memory) - c,))
    obstruction = make_obstruction(model, shaped(memory, b, (c - b,)), touching, rows)
    integers[2] = 0
    tuning = tuning_of(numbers)
    weights, tolerances = shaped(numbers, WEIGHTS, (ROWS,)), shaped(numbers, TOLERANCES, (ROWS,))
    joint_weights = shaped(numbers, JOINT_WEIGHTS + 1, (int(numbers[JOINT_WEIGHTS]),))
    posture = shaped(numbers, len(numbers) - n, (n,))
    given = len(numbers) - JOINT_WEIGHTS - 1 - len(joint_weights)
    fits = given in (0, n) and len(joint_weights) in (0, n)
    work, recorder, one = make_records(model, buffer, scores, integers, rows, len(joint_weights) if fits else 0)
    solutions = make_solutions(answers, one, ranks, rows)
    for k in range(len(out)):
        began = now(work.clock)
        q, row, T, reference, good = open_row(k, n, targets, seeds, references, out)
        if not (fits and good):
            continue
        assign(work.q, q)
        row[SEED_CLIPPED] = tuning.respect_limits > 0.0 and bring_inside(geometry, work.q)
        fill(ranks, math.inf)
        forget_touching(obstruction)
        scale_joints(joint_weights, work.scales)
        task = make_task(T, weights, tolerances, tuning.task_frame)
        if rows is None and not is_usual(model, tuning, task):
            row[STATUS] = NOT_COMPILED
            continue
        assign(work.weights, weights)
        preferences = Preferences(reference, joint_weights, posture if given > 0 else reference, obstruction)
        status, steps, attempts, found, position_error, orientation_error, known = search(
            geometry, starts, reach, task, tuning, preferences, began, solutions, work, recorder
        )
        assign(q, work.q)
        row[STATUS], row[FOUND], row[STEPS], row[ATTEMPTS] = status, found, steps, attempts
        row[POSITION_ERROR], row[ORIENTATION_ERROR] = position_error, orientation_error
        row[JOINT_DISTANCE] = largest_gap(q, reference)
        row[LIMITS_MASK], row[COMPLETENESS] = limits_mask(geometry, q), known
        if rows is not None and status != CONVERGED:
            row[SIGMA_MIN] = sigma_min(geometry, task, work, recorder)
        row[TIME] = now(work.clock) - began
    return integers[2]


@kernel
def is_usual(model, tuning, task):
    """Return whether the first solution by the default method is wanted, for all six rows, without more wishes."""
    by_default = int(tuning.method) == ADAPTIVE_DLS and tuning.adaptive_dls_damping > 0.0
    first = int(tuning.choice) == FIRST and tuning.max_joint_jump <= 0.0
    alone = int(tuning.null_space) == NONE and len(model) == packed_size(model)
    return by_default and first and alone and task.plain > 0.0


@inlined
def open_row(k, n, targets, seeds, references, out):
    """Return q (n,) and figures of row k of `out`, its target (4, 4) and reference (n,), and whether its arguments are
    valid; q is the seed, and the status NOT_AN_ARGUMENT."""
    q, row = shaped(out, k * (n + WIDTH), (n,)), shaped(out, k * (n + WIDTH) + n, (WIDTH,))
    T, seed = shaped(targets, 16 * k, (4, 4)), shaped(seeds, k * n, (n,))
    reference = shaped(references, k * n, (n,))
    assign(q, seed)
    fill(row, math.nan)
    row[STATUS] = NOT_AN_ARGUMENT
    return q, row, T, reference, is_pose(T) and finite(seed) and finite(reference)


@kernel
def finite(values):
    """Return whether all components of a vector are finite."""
    for i in range(len(values)):
        if not abs(values[i]) < math.inf:
            return False
    return True


@kernel
def is_pose(T):
    """Return whether T (4, 4) is finite and has a right-handed rotation and the last row 0 0 0 1."""
    for i in range(3):
        if not abs(T[i, 3]) < math.inf or T[3, i] != 0.0:
            return False
        for j in range(3):
            dot = T[i, 0] * T[j, 0] + T[i, 1] * T[j, 1] + T[i, 2] * T[j, 2]
            if not abs(dot - (i == j)) < ROTATION_TOLERANCE:
                return False
    handed = (
        T[0, 0] * (T[1, 1] * T[2, 2] - T[1, 2] * T[2, 1])
        - T[0, 1] * (T[1, 0] * T[2, 2] - T[1, 2] * T[2, 0])
        + T[0, 2] * (T[1, 0] * T[2, 1] - T[1, 1] * T[2, 0])
    )
    return handed > 0.0 and T[3, 3] == 1.0


@kernel
def largest_gap(q, reference):
    """Return max |q_i - reference_i|."""
    largest = 0.0
    for i in range(len(q)):
        largest = max(largest, abs(q[i] - reference[i]))
    return largest


@kernel
def sigma_min(geometry, task, work, scratch):
    """Return the smallest singular value of the task Jacobian at work.q."""
    look(geometry, task, work)
    return singular_figures(work.columns, work.weights, scratch)[0]
