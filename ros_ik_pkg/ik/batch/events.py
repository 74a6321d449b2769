"""What happens to one lane: it takes a target, starts again, is done or gives the target up."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik.batch.records import LIVE, MARK, MARK_STEP, MOVES, NEAREST, NORM, PATIENCE, STEP
from ros_ik_pkg.ik.descent.descent import CONVERGED
from ros_ik_pkg.ik.kernel.clock import now
from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kernel.linalg import assign, fill
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.kinematics.forward import walk
from ros_ik_pkg.ik.kinematics.pose_error import twist_error
from ros_ik_pkg.ik.kinematics.task import make_task, within_tolerances
from ros_ik_pkg.ik.search.entry import (
    ATTEMPTS,
    FOUND,
    JOINT_DISTANCE,
    ORIENTATION_ERROR,
    POSITION_ERROR,
    STATUS,
    STEPS,
    TIME,
    WIDTH,
    finite,
    is_pose,
    largest_gap,
)
from ros_ik_pkg.ik.search.reach import out_of_reach
from ros_ik_pkg.ik.search.search import HURRIED, HURRIED_ATTEMPTS, PATIENT
from ros_ik_pkg.ik.search.starts import distance_of, nearest_start, next_start, score_starts
from ros_ik_pkg.ik.step.limits import bring_inside, clip, unwrap

HANDED_OVER = -3.0  # status of a row that `solve_range` is to solve
MOST_ATTEMPTS = HURRIED_ATTEMPTS  # in a lane: those after that are patient


class Start(NamedTuple):
    """What `next_start` writes to."""

    q: np.ndarray  # (n,)
    scores: np.ndarray  # (m,)


@inlined
def take_target(w, batch, desk, lanes):
    """Put the next target into lane w, at its seed; the lane is empty if there is none."""
    n = len(desk.q)
    lanes.figure_of[LIVE, w] = 0.0
    while lanes.figure_of[LIVE, w] == 0.0 and desk.next[0] < len(batch.out):
        k = desk.next[0]
        desk.next[0] += 1
        desk.row[w] = k
        desk.steps[w], desk.attempts[w], desk.nearest[w], desk.began[w] = 0, 0, -1, desk.solved[0]
        T, seed = shaped(batch.targets, 16 * k, (4, 4)), shaped(batch.seeds, k * n, (n,))
        good = is_pose(T) and finite(seed) and finite(shaped(batch.references, k * n, (n,)))
        if not good or out_of_reach(batch.geometry, batch.reach, task_of(k, batch), batch.tuning):
            hand_over(w, batch, desk)
            continue
        assign(desk.q, seed)
        bring_inside(batch.geometry, desk.q)
        for i in range(3):
            lanes.goal_of[9 + i, w] = T[i, 3]
            for j in range(3):
                lanes.goal_of[3 * i + j, w] = T[i, j]
        begin_descent(w, PATIENT[0], desk, lanes)
        lanes.figure_of[LIVE, w] = 1.0


@inlined
def task_of(k, batch):
    """Return the task of target k."""
    T = shaped(batch.targets, 16 * k, (4, 4))
    return make_task(T, batch.weights, batch.tolerances, batch.tuning.task_frame)


@inlined
def begin_descent(w, patience, desk, lanes):
    """Let lane w descend from desk.q."""
    figure = lanes.figure_of
    for i in range(len(desk.q)):
        lanes.q_of[i, w] = desk.q[i]
    figure[STEP, w], figure[PATIENCE, w], figure[MARK, w], figure[NEAREST, w] = 0.0, patience, math.inf, math.inf


@inlined
def start_again(w, pausing, batch, desk, lanes):
    """Give up the descent of lane w for one from the nearest start that is left, unless it pauses and is nearer than
    that; return False if the target needs more than a lane does."""
    figure, scores, task = lanes.figure_of, desk.scores[w], task_of(desk.row[w], batch)
    if desk.nearest[w] < 0:
        score_starts(batch.starts, task, batch.scale, scores)
        desk.nearest[w] = nearest_start(scores)
    if pausing and figure[NORM, w] < distance_of(batch.starts, desk.nearest[w], task):
        figure[PATIENCE, w], figure[MOVES, w] = HURRIED[0], 1.0
        figure[MARK, w], figure[MARK_STEP, w], figure[NEAREST, w] = figure[NORM, w], figure[STEP, w], figure[NORM, w]
        return True
    desk.steps[w] += int(figure[STEP, w])
    desk.attempts[w] += 1
    if figure[NEAREST, w] <= batch.close or desk.attempts[w] == MOST_ATTEMPTS:
        return False
    next_start(batch.starts, desk.attempts[w], desk.nearest[w], Start(desk.q, scores))
    clip(batch.geometry, desk.q)
    begin_descent(w, HURRIED[0], desk, lanes)
    return True


@inlined
def finish(w, batch, desk, joints, lanes):
    """Bring the solution of lane w to the nearest whole turns, and write it if the kinematics of `solve` agree that it
    is one; return whether they do."""
    n, k = len(desk.q), desk.row[w]
    if lanes.figure_of[STEP, w] == 0.0:
        return False  # `descend` refines a start that is within tolerance
    reference, task = shaped(batch.references, k * n, (n,)), task_of(k, batch)
    for i in range(n):
        desk.q[i] = lanes.q_of[i, w]
    unwrap(batch.geometry, desk.q, reference)
    R, p = walk(batch.geometry, desk.q, joints)
    x, y, z, rx, ry, rz = twist_error(task.R, task.p, R, p)
    position, orientation = math.sqrt(x * x + y * y + z * z), math.sqrt(rx * rx + ry * ry + rz * rz)
    if not within_tolerances(position, orientation, batch.tuning):
        return False
    row = shaped(batch.out, k * (n + WIDTH) + n, (WIDTH,))
    assign(shaped(batch.out, k * (n + WIDTH), (n,)), desk.q)
    fill(row, math.nan)
    row[STATUS], row[FOUND] = CONVERGED, 1.0
    row[STEPS], row[ATTEMPTS] = desk.steps[w] + lanes.figure_of[STEP, w], desk.attempts[w] + 1
    row[POSITION_ERROR], row[ORIENTATION_ERROR] = position, orientation
    row[JOINT_DISTANCE] = largest_gap(desk.q, reference)
    desk.solved[0] = now(desk.clock)
    row[TIME] = desk.solved[0] - desk.began[w]
    return True


@inlined
def hand_over(w, batch, desk):
    """Leave the target of lane w, if there is one, to `solve_range`."""
    if desk.row[w] >= 0:
        batch.out[desk.row[w], len(desk.q) + STATUS] = HANDED_OVER
