"""The search: attempts from the seed, then from starts near the target, until a solution is accepted.

An attempt is a descent by the selected method or, in two cases, by Levenberg-Marquardt: TO_TOLERANCE starts from an
iterate that is so close that the tolerances may allow a solution; FROM_SEED starts from the seed if a solution near it
is wanted, or if the descent from there ran out of steps. The result of an attempt is finished (whole turns,
self-motion) and judged (`acceptance.py`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ros_ik_pkg.ik.descent.acceptance import ACCEPTED, BEYOND_TOLERANCE, TOUCHING, judge
from ros_ik_pkg.ik.descent.closest_approach import approach
from ros_ik_pkg.ik.descent.descent import (
    CONVERGED,
    DEADLINE,
    DIVERGED,
    MAX_ITERATIONS,
    OSCILLATING,
    PAUSED,
    STALLED,
    descend,
)
from ros_ik_pkg.ik.descent.objectives import NONE
from ros_ik_pkg.ik.descent.self_motion import settle
from ros_ik_pkg.ik.kernel.clock import passed
from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kernel.linalg import assign, fill
from ros_ik_pkg.ik.kinematics.task import look_at_error, tolerated_norm, with_slack, within_tolerances
from ros_ik_pkg.ik.search.reach import out_of_reach
from ros_ik_pkg.ik.search.solutions import (
    NOT_ACCEPTED,
    count_accepted,
    keep_solution,
    keep_touching,
    rank_solution,
    take_touching,
)
from ros_ik_pkg.ik.search.starts import distance_of, nearest_start, next_start, score_starts
from ros_ik_pkg.ik.solution import Status
from ros_ik_pkg.ik.step.limits import clip, unwrap
from ros_ik_pkg.ik.step.methods import joint_step_cap
from ros_ik_pkg.methods import HURRIED_STRIDE

UNREACHABLE = int(Status.UNREACHABLE)
JOINT_JUMP = int(Status.JOINT_JUMP)
COLLISION = int(Status.COLLISION)
FIRST, NEAREST, ALL = range(3)
BY_METHOD, TO_TOLERANCE, FROM_SEED = range(3)  # kinds of attempts

# Patience of an attempt: the number of steps within which its error must fall below this factor of its last mark.
# Hurried attempts are abandoned early, because starting elsewhere is cheaper (docs/performance.md).
HURRIED = (5, 0.9)
PATIENT = (20, 0.999)
HURRIED_ATTEMPTS = 50  # later attempts are patient: the target is hard
LOOK = 2  # steps after which the seed is abandoned if it is still further from the target than the nearest start
CLOSE = 2.0  # TO_TOLERANCE is tried below this multiple of the error norm that the tolerances allow
ATTEMPTS_OUT_OF_REACH = 8  # to find the closest approach to a target that is provably out of reach
ATTEMPTS_WITHOUT_NEWS = 40  # after which the nearest solution, or the list of all, counts as complete
ATTEMPTS_NO_CLOSER = 100  # after which the search gives up: none of 80000 reachable targets took more than 70 in all
CLOSER = 0.999  # factor by which the error of a closest approach must fall to count as closer


class Plan(NamedTuple):
    """How the search treats one target."""

    budget: float  # attempts at most
    hurried: int  # how many of them are hurried
    near_seed: bool  # whether a solution near the seed is wanted
    may_leave_seed: bool  # whether the first descent may be abandoned for a start that is nearer to the target
    finish_by_lm: bool  # whether Levenberg-Marquardt may continue where the method fails
    hopeless: bool  # whether the target is provably out of reach
    close: float  # error norm of a descent from which TO_TOLERANCE is tried
    stop_time: float  # [s]


@inlined
def make_plan(geometry, reach, task, tuning, began):
    """Return the plan for a task."""
    hopeless = out_of_reach(geometry, reach, task, tuning)
    hurried = 0 if int(tuning.max_attempts) == 1 or hopeless or tuning.may_hurry == 0.0 else HURRIED_ATTEMPTS
    near_seed = int(tuning.choice) != FIRST or tuning.max_joint_jump > 0.0
    return Plan(
        min(tuning.max_attempts, ATTEMPTS_OUT_OF_REACH) if hopeless else tuning.max_attempts,
        hurried,
        near_seed,
        hurried > 0 and task.plain > 0.0 and not near_seed,
        tuning.finish_by_lm > 0.0,
        hopeless,
        CLOSE * tolerated_norm(task, tuning),
        began + tuning.deadline if tuning.deadline > 0.0 else math.inf,
    )


@inlined
def search(geometry, starts, reach, task, tuning, preferences, began, solutions, work, recorder):
    """Search from work.q; leave the solution, or the closest approach, in work.q. `began` is when the solve began [s].

    Returns (status, steps, attempts, number of accepted solutions, position error [m], orientation error [rad]).
    `solutions` receives the nearest distinct solutions, `preferences.obstruction` those that touch something.
    """
    plan = make_plan(geometry, reach, task, tuning, began)
    scale = reach.lengths[1] if reach.lengths[1] < math.inf else 1.0
    best_norm, status_of_best = math.inf, STALLED
    steps, found, touching, last_news, last_closer, nearest_of_starts, late = 0, 0, 0, 0, 0, -1, False
    taken, attempts, restarts, kind, eased, near_seed = 0, 0, 0, BY_METHOD, False, plan.near_seed
    assign(work.seed, work.q)
    assign(work.best, work.q)
    while attempts < plan.budget:
        if kind == BY_METHOD:
            hurry = attempts < plan.hurried
            # The seed's own descent is patient if a solution near it is wanted, or if it is no longer FAR.
            from_near = plan.near_seed or (plan.may_leave_seed and taken == 0)
            patient = not hurry or (attempts == 0 and from_near)
            patience, progress = PATIENT if patient else HURRIED
            cap = joint_step_cap(tuning, HURRIED_STRIDE if hurry else 1.0)
            pause = LOOK if attempts == 0 and taken == 0 and plan.may_leave_seed else -1
            status, taken, position_error, orientation_error, norm, nearest = descend(
                geometry, task, tuning, cap, patience, progress, plan.stop_time,
                attempts, taken, pause, work, recorder,
            )  # fmt: skip
            if status == PAUSED:
                score_starts(starts, task, scale, work.scores)
                nearest_of_starts, status = nearest_start(work.scores), STALLED
                if norm < distance_of(starts, nearest_of_starts, task):
                    continue  # the descent from the seed goes on
        else:
            slack = 1.0 if kind == TO_TOLERANCE else 0.0
            taken, status, position_error, orientation_error, nearest = approach_within(
                geometry, task, tuning, slack, plan, attempts, work, recorder
            )
        steps += taken
        attempts += 1
        if status == CONVERGED:
            more, moved = finish(geometry, task, tuning, preferences, plan, attempts - 1, taken, work, recorder)
            steps += more
            if moved:
                position_error, orientation_error, _, _, _ = look_at_error(geometry, task, work)
            verdict = judge(tuning, preferences, position_error, orientation_error, work.q)
            if verdict == TOUCHING and plan.near_seed:
                more, verdict, position_error, orientation_error = get_clear(
                    geometry, task, tuning, preferences, plan, attempts - 1, taken, work, recorder
                )
                steps += more
            if verdict == ACCEPTED and int(tuning.choice) == FIRST:
                assign(solutions.rows[0], work.q)
                return CONVERGED, steps, attempts, 1, position_error, orientation_error
            if verdict == BEYOND_TOLERANCE:  # by the rounding of whole turns
                best_norm, status_of_best = 0.0, STALLED
                assign(work.best, work.q)
            elif verdict == TOUCHING:
                rank, known = rank_solution(work.q, ACCEPTED, preferences), touching
                touching = keep_touching(geometry, work.q, rank, preferences.obstruction, touching)
                last_closer = attempts if touching > known else last_closer
            else:
                before, rank = solutions.ranks[0], rank_solution(work.q, verdict, preferences)
                count = keep_solution(geometry, work.q, rank, solutions, found)
                if count > found or solutions.ranks[0] < before:
                    last_news = attempts
                found = count
        elif not nearest > CLOSER * best_norm:
            last_closer, best_norm, status_of_best = attempts, nearest, status
            assign(work.best, work.near)
        late = status == DEADLINE or passed(plan.stop_time, work.clock)
        complete = found > 0 and attempts - last_news >= ATTEMPTS_WITHOUT_NEWS
        in_vain = found == 0 and attempts - last_closer >= ATTEMPTS_NO_CLOSER
        if late or complete or in_vain or attempts >= plan.budget:
            break
        # Choose where the next attempt begins
        if attempts == 1 and status == MAX_ITERATIONS:  # it was on its way to a solution near the seed
            near_seed = True
        if kind == BY_METHOD and status != CONVERGED and nearest <= plan.close and plan.finish_by_lm:
            kind, eased = TO_TOLERANCE, True
            assign(work.q, work.near)
        elif near_seed and restarts == 0 and kind != FROM_SEED and plan.finish_by_lm:
            kind = FROM_SEED
            assign(work.q, work.seed)
        else:
            if restarts == 0 and nearest_of_starts < 0:
                score_starts(starts, task, scale, work.scores)
                nearest_of_starts = nearest_start(work.scores)
            restarts += 1
            kind = TO_TOLERANCE if eased and restarts % 2 == 1 else BY_METHOD
            next_start(starts, restarts, nearest_of_starts, work)
            if tuning.respect_limits > 0.0:  # starts are kept in single precision
                clip(geometry, work.q)
        taken = 0
    if found == 0 and touching == 0 and int(tuning.max_attempts) != 1:
        assign(work.q, work.best)
        if not late and (plan.finish_by_lm or plan.budget < 1.0):
            more, late = come_closest(geometry, task, tuning, plan, attempts, work, recorder)
            steps += more
            # How the descents ended says nothing about where the approach came to rest.
            status_of_best = STALLED if status_of_best in (DIVERGED, OSCILLATING) else status_of_best
        unwrap(geometry, work.q, preferences.reference)
        position_error, orientation_error, _, _, _ = look_at_error(geometry, task, work)
        verdict = judge(tuning, preferences, position_error, orientation_error, work.q)
        if verdict == TOUCHING:
            rank = rank_solution(work.q, ACCEPTED, preferences)
            touching = keep_touching(geometry, work.q, rank, preferences.obstruction, touching)
        elif verdict != BEYOND_TOLERANCE:
            found = keep_solution(geometry, work.q, rank_solution(work.q, verdict, preferences), solutions, found)
        else:
            status_of_best = DEADLINE if late else UNREACHABLE if plan.hopeless else status_of_best
    for k in range(touching):
        if not (found > 0 and solutions.ranks[0] < NOT_ACCEPTED) and not passed(plan.stop_time, work.clock):
            take_touching(preferences.obstruction, k, work.q)
            more, verdict, _, _ = get_clear(
                geometry, task, tuning, preferences, plan, attempts, 0, work, recorder
            )
            steps += more
            if verdict == ACCEPTED:
                found = keep_solution(geometry, work.q, rank_solution(work.q, verdict, preferences), solutions, found)
    if found > 0 and (solutions.ranks[0] < NOT_ACCEPTED or touching == 0):
        assign(work.q, solutions.rows[0])
        status_of_best = CONVERGED if solutions.ranks[0] < NOT_ACCEPTED else JOINT_JUMP
    elif touching > 0:
        take_touching(preferences.obstruction, 0, work.q)
        status_of_best = COLLISION
    position_error, orientation_error, _, _, _ = look_at_error(geometry, task, work)
    return (
        status_of_best, steps, attempts, count_accepted(solutions.ranks, found), position_error, orientation_error,
    )  # fmt: skip


@inlined
def finish(geometry, task, tuning, preferences, plan, attempt, taken, work, recorder):
    """Turn the joints of a solution in work.q by whole turns towards the reference, then apply null_space by
    self-motion; return (steps, whether it moved)."""
    moved = unwrap(geometry, work.q, preferences.reference)
    steps = 0
    if recorder is not None and int(tuning.null_space) != NONE:
        steps = settle(geometry, task, tuning, preferences, False, plan.stop_time, attempt, taken, work, recorder)
        unwrap(geometry, work.q, preferences.reference)
        moved = True
    return steps, moved


@inlined
def get_clear(geometry, task, tuning, preferences, plan, attempt, taken, work, recorder):
    """Move work.q, which touches, away from contact by self-motion; return (steps, verdict, position error [m],
    orientation error [rad])."""
    steps = 0
    if recorder is not None:
        steps = settle(geometry, task, tuning, preferences, True, plan.stop_time, attempt, taken, work, recorder)
        unwrap(geometry, work.q, preferences.reference)
    position_error, orientation_error, _, _, _ = look_at_error(geometry, task, work)
    verdict = judge(tuning, preferences, position_error, orientation_error, work.q)
    return steps, verdict, position_error, orientation_error


@inlined
def approach_within(geometry, task, tuning, slack, plan, attempt, work, recorder):
    """Approach the target from work.q by Levenberg-Marquardt, with `slack` times the tolerances left free; return
    (steps, status, position error [m], orientation error [rad], error norm)."""
    eased = with_slack(task, slack * tuning.position_tolerance, slack * tuning.orientation_tolerance)
    steps = approach(geometry, eased, tuning, plan.stop_time, attempt, work, recorder)
    position_error, orientation_error, norm, _, _ = look_at_error(geometry, task, work)
    status = CONVERGED if within_tolerances(position_error, orientation_error, tuning) else STALLED
    return steps, status, position_error, orientation_error, norm


@inlined
def come_closest(geometry, task, tuning, plan, attempt, work, recorder):
    """Move work.q, the best iterate, to the closest approach; return (steps, whether the deadline has passed).

    Joint weights are ignored: they would slow down the joints that the last millimetre needs.
    """
    fill(work.scales, 1.0)
    steps, status, _, _, norm = approach_within(geometry, task, tuning, 0.0, plan, attempt, work, recorder)
    if status != CONVERGED and norm <= plan.close and attempt == 0:  # without attempts it was not tried
        more, _, _, _, _ = approach_within(geometry, task, tuning, 1.0, plan, attempt + 1, work, recorder)
        steps += more
    return steps, passed(plan.stop_time, work.clock)
