"""The search: attempts from the seed, then from starts near the target, until a solution is accepted.

An attempt is a descent by the selected method or, in two cases, by Levenberg-Marquardt: TO_TOLERANCE starts from an
iterate that is so close that the tolerances may allow a solution; FROM_SEED starts from the seed if a solution near it
is wanted, or if the descent from there ran out of steps. The result of an attempt is finished (whole turns,
self-motion) and judged (`acceptance.py`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ros_ik_pkg.ik.branches.six_joints import COMPLETE, STARTS, UNKNOWN, find_branches
from ros_ik_pkg.ik.branches.six_joints import FAMILY as ONE_OF_FAMILY
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
from ros_ik_pkg.ik.solution import BY_EXHAUSTION, BY_PROOF, FAMILY, NOT_KNOWN, Status
from ros_ik_pkg.ik.step.limits import clip, unwrap
from ros_ik_pkg.ik.step.methods import joint_step_cap
from ros_ik_pkg.methods import HURRIED_STRIDE

UNREACHABLE = int(Status.UNREACHABLE)
JOINT_JUMP = int(Status.JOINT_JUMP)
NOT_COMPILED = -2  # status of a target that needs what solve_usual leaves out
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
PER_SOLUTION = 7  # the same of six joints: of equal basins one is missed by all of them once in 1000 times, exp(-7)
FEWEST_ATTEMPTS = 16  # max_attempts from which on a closed form is asked: enough to try all branches
ASK_AFTER = 3  # attempts without a solution, after which the closed form is asked whether there is one
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
    ask_after: int  # attempts without a solution after which a closed form is asked for all branches
    stop_time: float  # [s]


@inlined
def make_plan(geometry, reach, task, tuning, began):
    """Return the plan for a task."""
    hopeless = out_of_reach(geometry, reach, task, tuning)
    hurried = 0 if int(tuning.max_attempts) == 1 or hopeless or tuning.may_hurry == 0.0 else HURRIED_ATTEMPTS
    near_seed = int(tuning.choice) != FIRST or tuning.max_joint_jump > 0.0
    ask_after = 0 if int(tuning.choice) != FIRST else 1 if near_seed else ASK_AFTER
    if tuning.max_attempts < FEWEST_ATTEMPTS or (not near_seed and tuning.may_hurry == 0.0):
        ask_after = -1
    return Plan(
        min(tuning.max_attempts, ATTEMPTS_OUT_OF_REACH) if hopeless else tuning.max_attempts,
        hurried,
        near_seed,
        hurried > 0 and task.plain > 0.0 and not near_seed,
        tuning.finish_by_lm > 0.0,
        hopeless,
        CLOSE * tolerated_norm(task, tuning),
        ask_after,
        began + tuning.deadline if tuning.deadline > 0.0 else math.inf,
    )


@inlined
def search(geometry, starts, reach, task, tuning, preferences, began, solutions, work, recorder):
    """Search from work.q; leave the solution, or the closest approach, in work.q. `began` is when the solve began [s].

    Returns (status, steps, attempts, number of accepted solutions, position error [m], orientation error [rad], what
    is known of other solutions). `solutions` receives the nearest distinct solutions, `preferences.obstruction` those
    that touch something. If `solutions` is None, the status is NOT_COMPILED unless a descent by the method leads to an
    accepted solution, and no other code is compiled.
    """
    plan = make_plan(geometry, reach, task, tuning, began)
    scale = reach.lengths[1] if reach.lengths[1] < math.inf else 1.0
    best_norm, status_of_best = math.inf, STALLED
    steps, found, touching, last_news, last_closer, nearest_of_starts, late = 0, 0, 0, 0, 0, -1, False
    taken, attempts, restarts, kind, eased, near_seed = 0, 0, 0, BY_METHOD, False, plan.near_seed
    branches, tried, certainty, from_branch, all_tried, complete, in_vain = 0, 0, UNKNOWN, False, False, False, False
    assign(work.seed, work.q)
    assign(work.best, work.q)
    if plan.ask_after == 0:
        branches, certainty = ask_for_branches(geometry, scale, task, tuning, preferences, work, recorder)
        if certainty == COMPLETE and branches > 0:
            take_branch(0, work, recorder)
            tried, from_branch = 1, True
    while attempts < plan.budget:
        if kind == BY_METHOD:
            hurry = attempts < plan.hurried
            # The seed's own descent is patient if a solution near it is wanted, or if it is no longer FAR.
            from_near = attempts == 0 and (plan.near_seed or (plan.may_leave_seed and taken == 0))
            patient = not hurry or (certainty != COMPLETE and (from_near or from_branch))
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
        elif solutions is not None:
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
            if solutions is not None and verdict == TOUCHING and plan.near_seed and certainty != COMPLETE:
                more, verdict, position_error, orientation_error = get_clear(
                    geometry, task, tuning, preferences, plan, attempts - 1, taken, work, recorder
                )
                steps += more
            if verdict == ACCEPTED and int(tuning.choice) == FIRST:
                if solutions is not None:
                    assign(solutions.rows[0], work.q)
                return CONVERGED, steps, attempts, 1, position_error, orientation_error, NOT_KNOWN
            if solutions is None:
                break
            if verdict == BEYOND_TOLERANCE:  # by the rounding of whole turns
                best_norm, status_of_best = 0.0, STALLED
                assign(work.best, work.q)
                certainty = STARTS if from_branch else certainty  # there is a solution beside it
            elif verdict == TOUCHING:
                rank, before = rank_solution(work.q, ACCEPTED, preferences), touching
                touching = keep_touching(geometry, work.q, rank, preferences.obstruction, touching)
                last_closer = attempts if touching > before else last_closer
            else:
                before, rank = solutions.ranks[0], rank_solution(work.q, verdict, preferences)
                count = keep_solution(geometry, work.q, rank, solutions, found)
                if count > found or solutions.ranks[0] < before:
                    last_news = attempts
                found = count
        elif not nearest > CLOSER * best_norm:
            last_closer, best_norm, status_of_best = attempts, nearest, status
            assign(work.best, work.near)
        to_tolerance = kind == BY_METHOD and status != CONVERGED and (nearest <= plan.close or from_branch)
        to_tolerance = to_tolerance and plan.finish_by_lm
        if from_branch and status != CONVERGED and not to_tolerance and (nearest <= plan.close or kind == BY_METHOD):
            certainty = STARTS  # too close to say that there is no solution
        if attempts == plan.ask_after:
            branches, certainty = ask_for_branches(geometry, scale, task, tuning, preferences, work, recorder)
        late = status == DEADLINE or passed(plan.stop_time, work.clock)
        quiet = max(ATTEMPTS_WITHOUT_NEWS, PER_SOLUTION * found if certainty == STARTS else 0)
        complete = found > 0 and attempts - last_news >= quiet
        in_vain = found == 0 and attempts - last_closer >= ATTEMPTS_NO_CLOSER
        all_tried = certainty == COMPLETE and tried == branches and not to_tolerance
        enough = all_tried and (found + touching > 0 or attempts >= ATTEMPTS_OUT_OF_REACH)
        if certainty == ONE_OF_FAMILY and tried == branches and found + touching > 0:
            enough = kind == FROM_SEED or restarts > 0
        if late or complete or in_vain or enough or attempts >= plan.budget:
            break
        # Choose where the next attempt begins
        if attempts == 1 and status == MAX_ITERATIONS:  # it was on its way to a solution near the seed
            near_seed = True
        if solutions is None and (to_tolerance or near_seed):
            break
        if to_tolerance:
            kind, eased = TO_TOLERANCE, eased or nearest <= plan.close
            assign(work.q, work.near)
        elif tried < branches:
            kind, from_branch = BY_METHOD, True
            take_branch(tried, work, recorder)
            tried += 1
        elif near_seed and restarts == 0 and kind != FROM_SEED and plan.finish_by_lm and certainty != COMPLETE:
            kind, from_branch = FROM_SEED, False
            assign(work.q, work.seed)
        else:
            if restarts == 0 and nearest_of_starts < 0:
                score_starts(starts, task, scale, work.scores)
                nearest_of_starts = nearest_start(work.scores)
            restarts, from_branch = restarts + 1, False
            kind = TO_TOLERANCE if eased and restarts % 2 == 1 else BY_METHOD
            next_start(starts, restarts, nearest_of_starts, work)
            if tuning.respect_limits > 0.0:  # starts are kept in single precision
                clip(geometry, work.q)
        taken = 0
    if solutions is None:
        return NOT_COMPILED, steps, attempts, 0, math.inf, math.inf, NOT_KNOWN
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
            status_of_best = DEADLINE if late else UNREACHABLE if plan.hopeless or all_tried else status_of_best
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
    known = BY_EXHAUSTION if complete or in_vain else NOT_KNOWN
    if all_tried or status_of_best == UNREACHABLE:
        known = BY_PROOF
    elif certainty == ONE_OF_FAMILY and found + touching > 0:
        known = FAMILY
    return (
        status_of_best, steps, attempts, count_accepted(solutions.ranks, found), position_error, orientation_error,
        known,
    )  # fmt: skip


@inlined
def ask_for_branches(geometry, scale, task, tuning, preferences, work, recorder):
    """Do what `find_branches` says, if that is compiled: for one tip, and not in solve_usual."""
    if recorder is not None:
        return find_branches(geometry, scale, task, tuning, preferences.reference, work)
    return 0, UNKNOWN


@inlined
def take_branch(k, work, recorder):
    """Write the k-th branch to work.q."""
    if recorder is not None:
        assign(work.q, work.branches[k])


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
