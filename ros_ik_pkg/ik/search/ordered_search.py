"""The search for two tasks in strict order: of the configurations that hold the demanded rows, that which comes nearest
to the wished ones.

Descents in order begin from the starts that promise to come nearer than the best so far. Each ends in a local optimum,
of which an arm has a handful: elbow up or down, a joint at a limit or another. A descent from the seed is the last, if
the seed is near the target, so that a solution there stands unless another is better.

If the pose may be one that can be reached whole, a descent by the selected method comes first: such a pose is reached
as if all rows were demanded.
"""

from __future__ import annotations

import math

from ros_ik_pkg.ik.descent.acceptance import ACCEPTED, judge
from ros_ik_pkg.ik.descent.descent import CONVERGED, descend
from ros_ik_pkg.ik.descent.ordered import descend_in_order, measure_in_order
from ros_ik_pkg.ik.kernel.clock import passed
from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.linalg import assign
from ros_ik_pkg.ik.kinematics.forward import walk
from ros_ik_pkg.ik.kinematics.task import look_at_error
from ros_ik_pkg.ik.search.ordered_starts import TURN, aim, score_ordered_starts, take_ordered_start
from ros_ik_pkg.ik.search.reach import out_of_reach
from ros_ik_pkg.ik.search.search import FIRST, HURRIED, LOOK, PATIENT
from ros_ik_pkg.ik.search.solutions import keep_solution, rank_solution
from ros_ik_pkg.ik.search.starts import nearest_start
from ros_ik_pkg.ik.step.limits import clip, unwrap
from ros_ik_pkg.ik.step.methods import joint_step_cap
from ros_ik_pkg.methods import HURRIED_STRIDE

MOST_DESCENTS = 40  # of one search
WITHOUT_NEWS = 7  # descents in a row that bring nothing nearer: enough if starts cannot promise how near they come
MOST_STEPS = 60  # of one descent
BETTER = 0.995  # factor by which a wish must be nearer to count as nearer: else the solution near the seed stands
APART = 0.5  # rad or m of one joint between two starts, and between a start and an optimum
WHOLE = 0.01  # score of the best start, beyond the margin, up to which the pose may be one that can be reached whole
BESIDE = 0.1  # of the reach, or rad: a seed that is nearer than that to the demanded rows has a descent of its own
AT_AXIS = 4.0  # factor on the margin close to the first axis, where small motions turn the tip much
TURNED_OVER = 1.15  # times the best wish: worth a descent after a joint went from one limit to the other
FIRST_CUT = 0.3  # score beyond that of the nearest start, up to which starts are looked at first
MOST_CUTS = 8
ALIKE = 1e-3  # scores this near are alike: which of them are looked at does not matter


@inlined
def search_in_order(
    geometry, starts, free, reach, pose, task, wish, tuning, preferences, stop_time, solutions, work, recorder
):
    """Search from work.q; leave the best configuration there and return (steps, attempts, number of solutions).

    If there are none, nothing was found that is accepted, and work.q is where the search began.

    `pose` is the task with all rows, `task` that with the demanded ones. With choice 'nearest' and 'all' the solutions
    are those that are equally near to the wish, by their distance from the reference.
    """
    steps, attempts, found, last_news, best = 0, 0, 0, 0, math.inf
    budget = min(tuning.max_attempts, float(MOST_DESCENTS))
    first = int(tuning.choice) == FIRST
    assign(work.seed, work.q)
    if out_of_reach(geometry, reach, task, tuning):
        return 0, 0, 0
    scale = reach.lengths[1] if reach.lengths[1] < math.inf else 1.0
    beside = away(geometry, task, wish, scale, work) < BESIDE
    goal = aim(geometry, free, pose)
    score_ordered_starts(geometry, starts, free, goal, work.scores)
    nearest, promising = nearest_start(work.scores), promise(wish)
    perhaps = beside or promising <= 0.0 or work.scores[nearest] < WHOLE + free[2]
    if perhaps and budget > 1.0 and int(tuning.max_iterations) > 0:
        steps, whole = reach_whole(geometry, pose, tuning, preferences, stop_time, work, recorder)
        attempts = 1
        if whole and first:
            assign(solutions.rows[0], work.q)
            return steps, attempts, 1
    at_axis = free[0] > 0.0 and goal[0][0] < 0.5 * free[3]
    margin = free[2] * (AT_AXIS if at_axis else 1.0)
    from_seed = beside or not first or promising <= 0.0 or tuning.max_joint_jump > 0.0
    last, seeded, over, held, least, cut, count = budget < 2.0, False, False, False, work.scores[nearest], -1.0, 0
    while budget > 0.0:
        over = over and turn_over(geometry, free, at_axis and held, task, wish, TURNED_OVER * best, work)
        if seeded and not over:
            break
        if not over:
            k = -1
            if not last:
                enough = worth(best, promising, margin)
                k, cut, count = next_ordered_start(
                    geometry, starts, free, goal, wish, nearest, least, enough, cut, count, work
                )
                nearest = -1
            seeded = k < 0
            if seeded and found > 0 and not from_seed:
                break
            if seeded:
                assign(work.q, work.seed)
            else:
                take_ordered_start(geometry, starts, free, goal, k, work)
                if tuning.respect_limits > 0.0:
                    clip(geometry, work.q)
                work.scores[k] = math.inf
                leave_out(geometry, starts, free, goal, wish.picks, count, work)
        stands = seeded and not over
        cap = best / BETTER if stands or not first else best
        held, taken, norm = descend_in_order(
            geometry, task, wish, tuning, cap, min(int(tuning.max_iterations), MOST_STEPS), stop_time, attempts, work,
            recorder,
        )  # fmt: skip
        steps += taken
        attempts += 1
        over = not over and attempts < budget
        if held:
            leave_out(geometry, starts, free, goal, wish.picks, count, work)
            unwrap(geometry, work.q, preferences.reference)
            R, p = walk(geometry, work.q, work.joints)
            position_error, orientation_error, _, _, norm = measure_in_order(task, wish, R, p, work)
            if judge(tuning, preferences, position_error, orientation_error, work.q) == ACCEPTED:
                if norm < BETTER * best or (stands and norm < best / BETTER):
                    best, last_news = norm, attempts
                    found = 0 if first or norm < BETTER * best else found
                if found == 0 or (not first and norm <= best / BETTER):
                    rank = rank_solution(work.q, ACCEPTED, preferences)
                    found = keep_solution(geometry, work.q, rank, solutions, found)
        fulfilled = found > 0 and best <= min(tuning.position_tolerance, tuning.orientation_tolerance)
        if (fulfilled and first) or passed(stop_time, work.clock):
            break
        last = attempts + 1 >= budget or (promising <= 0.0 and attempts - last_news >= WITHOUT_NEWS)
    assign(work.q, solutions.rows[0] if found > 0 else work.seed)
    return steps, attempts, found


@inlined
def away(geometry, task, wish, scale, work):
    """Return how far work.q is from the demanded rows: the sum of the distance over `scale` and the angle [rad]."""
    R, p = walk(geometry, work.q, work.joints)
    position_error, orientation_error, _, _, _ = measure_in_order(task, wish, R, p, work)
    return position_error / scale + orientation_error


@inlined
def turn_over(geometry, free, first_too, task, wish, worth, work):
    """Turn the last joint from one limit to the other, or if that is at none and `first_too` the first; return whether
    the wish is below `worth` then. If not, or if neither is at a limit, work.q stays.

    The angle beyond the limits that would suit the wish best is between the two, so each may be a local optimum.
    """
    i, first = int(geometry.variable[len(geometry.variable) - 1]), int(geometry.variable[0])
    if not (free[1] > 0.0 and at_limit(geometry, i, work.q)):
        i = first
        if not (first_too and at_limit(geometry, i, work.q)):
            return False
    before = work.q[i]
    work.q[i] = geometry.lower[i] if before >= geometry.upper[i] else geometry.upper[i]
    R, p = walk(geometry, work.q, work.joints)
    _, _, _, _, norm = measure_in_order(task, wish, R, p, work)
    if not norm < worth:
        work.q[i] = before
    return norm < worth


@inlined
def at_limit(geometry, i, q):
    """Return whether joint i is at a limit."""
    return q[i] <= geometry.lower[i] or q[i] >= geometry.upper[i]


@inlined
def next_ordered_start(geometry, starts, free, goal, wish, nearest, least, enough, cut, count, work):
    """Return the start with the lowest score below `enough`, -1 if there is none, and the cut and number of the picks,
    which are the starts that were looked at.

    `nearest` is the first of all, or -1 after that; `least` is its score.
    """
    if nearest >= 0:
        return nearest, cut, count
    k = pick(work.scores, wish.picks, count, enough)
    for _ in range(MOST_CUTS):
        if k >= 0 or not cut < min(enough, 4.0):
            break
        cut = min(enough, least + FIRST_CUT if cut < 0.0 else 2.0 * cut - least + FIRST_CUT)
        count, cut = collect(cut, least, wish.picks, work.scores)
        leave_out(geometry, starts, free, goal, wish.picks, count, work)
        k = pick(work.scores, wish.picks, count, enough)
    return k, cut, count


@inlined
def reach_whole(geometry, pose, tuning, preferences, stop_time, work, recorder):
    """Descend from work.q to the whole pose by the selected method; return the steps, and whether that is accepted.

    A descent that is still far off after LOOK steps is left, as a search for all rows leaves it for a start.
    """
    hurry = tuning.may_hurry > 0.0
    patience, progress = HURRIED if hurry else PATIENT
    assign(work.weights, pose.weights)
    status, steps, position_error, orientation_error, _, _ = descend(
        geometry, pose, tuning, joint_step_cap(tuning, HURRIED_STRIDE if hurry else 1.0), patience, progress,
        stop_time, 0, 0, LOOK if hurry else -1, work, recorder,
    )  # fmt: skip
    if status != CONVERGED:
        return steps, False
    if unwrap(geometry, work.q, preferences.reference):
        position_error, orientation_error, _, _, _ = look_at_error(geometry, pose, work)
    return steps, judge(tuning, preferences, position_error, orientation_error, work.q) == ACCEPTED


@kernel
def promise(wish):
    """Return the weight of the orientation if its three rows are all that is wished for, alike: then the score of a
    start promises how near a descent from there comes. Else 0."""
    w, bound = wish.task.weights, wish.task.tolerances
    alike = w[3] == w[4] == w[5] and w[0] + w[1] + w[2] + bound[3] + bound[4] + bound[5] == 0.0
    return w[3] if alike else 0.0


@kernel
def worth(best, weight, margin):
    """Return the score up to which starts are worth a descent if the best wish has the norm `best` so far."""
    if not best < math.inf or weight <= 0.0:
        return math.inf
    sine = math.sin(0.5 * min(best / weight, math.pi))
    return sine * sine + margin


@kernel
def collect(most, least, picks, scores):
    """Write the starts with scores below `most` to picks; return their number and `most`, less if there are too many.

    `least` is less than all scores.
    """
    while True:
        count = 0
        for k in range(len(scores)):
            if scores[k] < most:
                if count < len(picks):
                    picks[count] = k
                count += 1
        if count <= len(picks) or not most > least + ALIKE:
            return min(count, len(picks)), most
        most = 0.5 * (least + most)


@kernel
def pick(scores, picks, count, most):
    """Return the start among the picks with the lowest score below `most`, -1 if there is none."""
    best, least = -1, most
    for m in range(count):
        k = int(picks[m])
        if scores[k] < least:
            best, least = k, scores[k]
    return best


@kernel
def leave_out(geometry, starts, free, goal, picks, count, work):
    """Leave those picks out that are near work.q: in the joints that the starts cover, and in how far the first joint
    has to turn for the goal."""
    first, last, n = int(geometry.variable[0]), int(geometry.variable[len(geometry.variable) - 1]), len(work.q)
    _, _, _, azimuth = goal
    for m in range(count):
        k, gap = int(picks[m]), 0.0
        for i in range(n):
            if not ((i == first and free[0] > 0.0) or (i == last and free[1] > 0.0)):
                gap = max(gap, abs(starts[i, k] - work.q[i]))
        if free[0] > 0.0:
            turn = azimuth - starts[n + 7, k] - geometry.multiplier[0] * (work.q[first] - starts[first, k])
            gap = max(gap, abs(turn - TURN * math.floor(turn / TURN + 0.5)))
        if gap < APART:
            work.scores[k] = math.inf
