"""The compiled entry of a batch: the search of `search.py` for LANES targets side by side.

A lane does what `search` does for most targets: a descent from the seed, which is left for the nearest start if that
is nearer, then hurried descents from further starts. All lanes step together; `events.py` has what happens to one of
them. A target that needs more than that is handed over to `search`, which begins with it again.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from ros_ik_pkg.ik.batch.events import finish, hand_over, start_again, take_target
from ros_ik_pkg.ik.batch.kinematics import look_around_lanes, look_at_errors
from ros_ik_pkg.ik.batch.records import (
    LIVE,
    MARK,
    MARK_STEP,
    MOVES,
    NEAREST,
    NORM,
    PATIENCE,
    STEP,
    Batch,
    Desk,
    lanes_size,
    make_lanes,
)
from ros_ik_pkg.ik.batch.step import take_steps
from ros_ik_pkg.ik.descent.descent import FAR
from ros_ik_pkg.ik.kernel.clock import now
from ros_ik_pkg.ik.kernel.compiled import entry_point, inlined, kernel
from ros_ik_pkg.ik.kernel.data_layout import joints_size, make_joints, tuning_of, unpack_model
from ros_ik_pkg.ik.kernel.linalg import ROWS, fill
from ros_ik_pkg.ik.kernel.numba_insides import on_stack, shaped, small_loops
from ros_ik_pkg.ik.kernel.wide import LANES, bits_of, smaller, where
from ros_ik_pkg.ik.kinematics.task import make_task, tolerated_norm
from ros_ik_pkg.ik.search.entry import TOLERANCES, WEIGHTS
from ros_ik_pkg.ik.search.search import CLOSE, HURRIED, LOOK, PATIENT
from ros_ik_pkg.ik.step.methods import joint_step_cap
from ros_ik_pkg.methods import HURRIED_STRIDE


@entry_point(types.void, [types.Array(types.float64, d, 'C') for d in (1, 1, 2, 1, 1, 2)])
def solve_lanes(model, numbers, targets, seeds, references, out):
    """Do what `solve_range` does for N targets and the usual options, LANES targets at a time.

    The status of a row is CONVERGED or HANDED_OVER. Of the figures it has those that a BatchSolution keeps.
    """
    n, m = int(model[0]), int(model[2])
    row, steps, attempts, nearest = np.full((4, LANES), -1)
    desk = Desk(
        row, steps, attempts, nearest, np.empty((LANES, m), np.float32), np.empty(LANES), np.empty(1),
        np.zeros(1, np.int64), np.empty(2, np.int64), np.empty(n),
    )  # fmt: skip
    memory = on_stack(lanes_size(model))
    fill_lanes(model, numbers, targets, seeds, references, out, desk, np.empty(joints_size(model)), memory)


@kernel
def fill_lanes(model, numbers, targets, seeds, references, out, desk, joints_memory, memory):
    """Implement `solve_lanes`."""
    small_loops()
    geometry, reach, starts = unpack_model(model)
    tuning = tuning_of(numbers)
    weights, tolerances = shaped(numbers, WEIGHTS, (ROWS,)), shaped(numbers, TOLERANCES, (ROWS,))
    scale = reach.lengths[1] if reach.lengths[1] < math.inf else 1.0
    first = make_task(shaped(targets, 0, (4, 4)), weights, tolerances, tuning.task_frame)
    batch = Batch(
        geometry, reach, starts, tuning, weights, tolerances, scale, CLOSE * tolerated_norm(first, tuning),
        targets, seeds, references, out,
    )  # fmt: skip
    lanes, joints = make_lanes(model, memory, weights), make_joints(model, joints_memory)
    # At first every lane is lost: it has no target to hand over, and takes one.
    figures = lanes.figures
    fill(figures, 1.0)
    fill(lanes.goals, 0.0)
    fill(lanes.q, math.nan)
    desk.solved[0] = now(desk.clock)
    cap = joint_step_cap(tuning, HURRIED_STRIDE)
    near, aligned = tuning.position_tolerance**2, tuning.orientation_tolerance**2
    live = figures[LIVE] > 0.0
    while bits_of(live):
        position, orientation, p, too_large = look_at_errors(geometry, lanes)
        look_around_lanes(geometry, lanes, p)
        norm, step, patience = math.sqrt(position + orientation), figures[STEP], figures[PATIENCE]
        lost = too_large | ~(norm < math.inf) | (step >= tuning.max_iterations)
        arrived = (position <= near) & (orientation <= aligned)
        patient = patience > HURRIED[0]
        pausing = patient & (step >= LOOK) & (step <= LOOK) & (norm > FAR)
        better = norm < where(patient, PATIENT[1], HURRIED[1]) * figures[MARK]
        stuck = ~better & (step - figures[MARK_STEP] >= patience)
        events = live & (lost | arrived | pausing | stuck)
        figures[NORM], figures[NEAREST] = norm, smaller(norm, figures[NEAREST])
        figures[MARK], figures[MARK_STEP] = where(better, norm, figures[MARK]), where(better, step, figures[MARK_STEP])
        figures[MOVES] = where(events, 0.0, 1.0)
        some = bits_of(events)
        if some:
            some_lost, some_arrived, some_pausing = bits_of(lost), bits_of(arrived), bits_of(pausing)
            for w in range(LANES):
                if not is_set(some, w):
                    continue
                solved, stays = False, False
                if not is_set(some_lost, w):
                    if is_set(some_arrived, w):
                        solved = finish(w, batch, desk, joints, lanes)
                    else:
                        stays = start_again(w, is_set(some_pausing, w), batch, desk, lanes)
                if not (solved or stays):
                    hand_over(w, batch, desk)
                if not stays:
                    take_target(w, batch, desk, lanes)
            live = figures[LIVE] > 0.0
        take_steps(geometry, tuning, cap, norm, figures[MOVES] > 0.0, lanes)
        figures[STEP] = figures[STEP] + figures[MOVES]


@inlined
def is_set(bits, w):
    """Return whether bit w is set."""
    return (bits >> w) & 1 != 0
