"""Attempts until one holds: from the seed, then from starts near the target; deadline, choice among answers."""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.descent.closest_approach import approach
from ros_ik_pkg.ik.descent.descent import CONVERGED, DEADLINE, DIVERGED, OSCILLATING, PAUSED, STALLED, descend
from ros_ik_pkg.ik.descent.objectives import NONE
from ros_ik_pkg.ik.descent.self_motion import settle
from ros_ik_pkg.ik.kernel.clock import passed
from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kernel.linalg import assign
from ros_ik_pkg.ik.kinematics.task import holds, look_at_error, tolerated_norm, with_slack
from ros_ik_pkg.ik.search.reach import out_of_reach
from ros_ik_pkg.ik.search.solutions import TOO_FAR, count_near, keep_answer, rank_answer
from ros_ik_pkg.ik.search.starts import distance_of, nearest_start, next_start, score_starts
from ros_ik_pkg.ik.solution import Status
from ros_ik_pkg.ik.step.limits import clip, unwrap
from ros_ik_pkg.ik.step.methods import TRANSPOSE, joint_step_cap

UNREACHABLE = int(Status.UNREACHABLE)
JOINT_JUMP = int(Status.JOINT_JUMP)
FIRST, NEAREST, ALL = range(3)
BY_METHOD, TO_TOLERANCE, FROM_SEED = range(3)  # kinds of attempts
CLOSE = 2.0  # times the norm that the tolerances allow: a descent that came so near may have missed what they allow

# An attempt among many is given up when its error does not fall by a tenth within five steps: starting elsewhere
# is cheaper (docs/performance.md). A lone one and those of a hard target get their chance.
HURRIED = (5, 0.9)
STRIDE = 2.0  # a hurried attempt takes steps so much longer than a method's own cap: a quarter fewer of them
PATIENT = (20, 0.999)
# So is one from a seed that after this many steps is still further from the target than the nearest start.
LOOK = 2
HURRIED_ATTEMPTS = 50
ATTEMPTS_OUT_OF_REACH = 8  # to find the closest approach of a target that is provably out of reach
ATTEMPTS_WITHOUT_NEWS = 40  # before the nearest answer, or the list of all, counts as complete
ATTEMPTS_NO_NEARER = 100  # before a target counts as out of reach: of 80000 reachable ones none took 70 in all
NEARER = 0.999  # by which factor an approach must be nearer to count


@inlined
def search(geometry, starts, reach, task, tuning, reference, preferences, began, answers, ranks, work, recorder):
    """Search from work.q since the time `began`; leave the answer, or the closest approach, in work.q.

    Returns (status, steps, attempts, number of answers, position error [m], orientation error [rad]). `answers`
    (k, n) and `ranks` (k,) receive the k nearest distinct answers that were found.

    An attempt is a descent by the selected method, or (TO_TOLERANCE, FROM_SEED) by Levenberg-Marquardt.
    """
    lone, transpose = int(tuning.max_attempts) == 1, int(tuning.method) == TRANSPOSE
    hopeless = out_of_reach(geometry, reach, task, tuning)
    hurried = 0 if lone or hopeless or transpose else HURRIED_ATTEMPTS
    near_seed = int(tuning.choice) != FIRST or tuning.max_joint_jump > 0.0
    may_leave_seed = hurried > 0 and task.plain > 0.0 and not near_seed
    # A seed that the search does not leave for a start is nearer than all of them, and gets its chance.
    first_hurried = 1 if near_seed or may_leave_seed else 0
    stop_time = began + tuning.deadline if tuning.deadline > 0.0 else math.inf
    scale = reach.lengths[1] if reach.lengths[1] < math.inf else 1.0
    budget = min(tuning.max_attempts, ATTEMPTS_OUT_OF_REACH) if hopeless else tuning.max_attempts
    close = CLOSE * tolerated_norm(task, tuning)
    best_norm, failure = math.inf, CONVERGED
    steps, found, news, nearer, first, late = 0, 0, 0, 0, -1, False
    taken, attempts, restarts, kind, later = 0, 0, 0, BY_METHOD, BY_METHOD
    assign(work.seed, work.q)
    if budget < 1.0:  # no descents: the closest approach from the seed alone
        failure = STALLED
        assign(work.best, work.q)
    while budget >= 1.0:
        if kind == BY_METHOD:
            hurry = attempts < hurried
            patience, progress = HURRIED if hurry and attempts >= first_hurried else PATIENT
            cap = joint_step_cap(tuning, STRIDE if hurry else 1.0)
            pause = LOOK if attempts == 0 and taken == 0 and may_leave_seed else -1
            status, taken, position_error, orientation_error, norm, nearest = descend(
                geometry, task, tuning, cap, patience, progress, stop_time,
                np.int64(attempts), np.int64(taken), pause, work, recorder,  # as literals they would compile it twice
            )  # fmt: skip
            if status == PAUSED:
                score_starts(starts, task, scale, work.scores)
                first, status = nearest_start(work.scores), STALLED
                if norm < distance_of(starts, first, task):
                    continue  # the seed keeps its descent
        else:
            slack = 1.0 if kind == TO_TOLERANCE else 0.0
            eased = with_slack(task, slack * tuning.position_tolerance, slack * tuning.orientation_tolerance)
            taken = approach(geometry, eased, tuning, stop_time, attempts, work, recorder)
            position_error, orientation_error, nearest, _, _ = look_at_error(geometry, task, work)
            status = CONVERGED if holds(position_error, orientation_error, tuning) else STALLED
        steps += taken
        attempts += 1
        if status == CONVERGED:
            moved = unwrap(geometry, work.q, reference)
            if recorder is not None and int(tuning.null_space) != NONE:
                posture = preferences.posture
                steps += settle(
                    geometry, task, tuning, posture, reference, stop_time, attempts - 1, taken, work, recorder
                )
                unwrap(geometry, work.q, reference)
            if moved or int(tuning.null_space) != NONE:
                position_error, orientation_error, _, _, _ = look_at_error(geometry, task, work)
            rank = rank_answer(work.q, reference, preferences.joint_weights, tuning.max_joint_jump)
            if int(tuning.choice) == FIRST and rank < TOO_FAR and holds(position_error, orientation_error, tuning):
                assign(answers[0], work.q)
                return CONVERGED, steps, attempts, 1, position_error, orientation_error
            before, count = ranks[0], found
            if holds(position_error, orientation_error, tuning):
                count = keep_answer(geometry, work.q, rank, answers, ranks, found)
            else:  # by a rounding of whole turns
                best_norm, failure = 0.0, STALLED
                assign(work.best, work.q)
            if count > found or ranks[0] < before:
                news = attempts
            found = count
        elif not nearest > NEARER * best_norm:  # by a rounding only, it is not worth another posture
            nearer, best_norm, failure = attempts, nearest, status
            assign(work.best, work.near)
        settled = found > 0 and attempts - news >= ATTEMPTS_WITHOUT_NEWS
        settled = settled or (found == 0 and attempts - nearer >= ATTEMPTS_NO_NEARER)
        late = status == DEADLINE or passed(stop_time, work.clock)
        if attempts >= budget or settled or late:
            break
        if kind == BY_METHOD and status != CONVERGED and nearest <= close and not transpose:
            kind = later = TO_TOLERANCE
            assign(work.q, work.near)
            continue
        if near_seed and restarts == 0 and kind != FROM_SEED and not transpose:
            kind = FROM_SEED
            assign(work.q, work.seed)
            continue
        if restarts == 0 and first < 0:
            score_starts(starts, task, scale, work.scores)
            first = nearest_start(work.scores)
        restarts += 1
        taken, kind = 0, BY_METHOD if restarts % 2 == 0 else later
        next_start(starts, restarts, first, work)
        if tuning.respect_limits > 0.0:  # starts are kept in single precision
            clip(geometry, work.q)
    if found == 0 and not lone:
        assign(work.q, work.best)
        # What the transpose method cannot do shall not be done for it.
        if not late and (int(tuning.method) != TRANSPOSE or budget < 1.0):
            steps += approach(geometry, task, tuning, stop_time, attempts, work, recorder)
            late = passed(stop_time, work.clock)
            # How the descents ended says nothing of where the approach came to rest.
            failure = STALLED if failure in (DIVERGED, OSCILLATING) else failure
        position_error, orientation_error, _, _, _ = look_at_error(geometry, task, work)
        if holds(position_error, orientation_error, tuning):
            unwrap(geometry, work.q, reference)
            rank = rank_answer(work.q, reference, preferences.joint_weights, tuning.max_joint_jump)
            found = keep_answer(geometry, work.q, rank, answers, ranks, 0)
        else:
            failure = DEADLINE if late else UNREACHABLE if hopeless else failure
    if found > 0:
        assign(work.q, answers[0])
        failure = CONVERGED if ranks[0] < TOO_FAR else JOINT_JUMP
    position_error, orientation_error, _, _, _ = look_at_error(geometry, task, work)
    if failure == CONVERGED and not holds(position_error, orientation_error, tuning):
        failure = STALLED
    return failure, steps, attempts, count_near(ranks, found), position_error, orientation_error
