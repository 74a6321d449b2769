"""Found solutions: their rank by distance from the reference, the list of distinct ones."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import kernel
from ros_ik_pkg.ik.kernel.linalg import assign
from ros_ik_pkg.ik.step.limits import TURN

SAME_ANSWER = 1e-2  # rad or m between two answers that count as one
TOO_FAR = 1e9  # added to the distance of answers beyond max_joint_jump: they come last


@kernel
def rank_answer(q, reference, joint_weights, max_joint_jump):
    """Return the distance of q from the reference, weighted if there are weights, plus TOO_FAR beyond the jump."""
    square, largest = 0.0, 0.0
    for i in range(len(q)):
        gap = abs(q[i] - reference[i])
        largest = max(largest, gap)
        weighted = gap * joint_weights[i] if len(joint_weights) > 0 else gap
        square += weighted * weighted
    beyond = max_joint_jump > 0.0 and largest > max_joint_jump
    return min(math.sqrt(square), 0.5 * TOO_FAR) + (TOO_FAR if beyond else 0.0)


@kernel
def keep_answer(geometry, q, rank, answers, ranks, found):
    """Insert q by rank unless it is there already; return how many answers there are now."""
    for k in range(found):
        if same_answer(geometry, q, answers[k]):
            return found
    if found == len(answers):
        if rank >= ranks[found - 1]:
            return found
        found -= 1
    k = found
    while k > 0 and ranks[k - 1] > rank:
        assign(answers[k], answers[k - 1])
        ranks[k] = ranks[k - 1]
        k -= 1
    assign(answers[k], q)
    ranks[k] = rank
    return found + 1


@kernel
def same_answer(geometry, q, other):
    """Return whether two answers differ by less than SAME_ANSWER in every joint, whole turns aside."""
    for i in range(len(q)):
        gap = q[i] - other[i]
        if geometry.wraps[i]:
            gap -= TURN * math.floor(gap / TURN + 0.5)
        if abs(gap) > SAME_ANSWER:
            return False
    return True


@kernel
def count_near(ranks, found):
    """Return how many of the answers are within max_joint_jump."""
    count = 0
    for k in range(found):
        count += ranks[k] < TOO_FAR
    return count
