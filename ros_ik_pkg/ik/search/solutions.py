"""The list of distinct solutions of a search, ranked by their distance from the reference."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.descent.acceptance import ACCEPTED
from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.linalg import assign, fill
from ros_ik_pkg.ik.step.limits import TURN

SAME_SOLUTION = 1e-2  # rad or m between two solutions that count as one
NEARER = 1e-4  # in rank: by how much one of two that count as one must be better to be the one that is kept
NOT_ACCEPTED = 1e9  # added to the rank of a solution that is kept but not accepted, so that it comes last


@kernel
def rank_solution(q, verdict, preferences):
    """Return the distance of q from the reference, weighted by the joint weights; add NOT_ACCEPTED if q is not."""
    square = 0.0
    for i in range(len(q)):
        gap = q[i] - preferences.reference[i]
        if len(preferences.joint_weights) > 0:
            gap *= preferences.joint_weights[i]
        square += gap * gap
    return min(math.sqrt(square), 0.5 * NOT_ACCEPTED) + (0.0 if verdict == ACCEPTED else NOT_ACCEPTED)


@kernel
def keep_solution(geometry, q, rank, solutions, found):
    """Insert q by its rank unless it is in the list; return the number of solutions. A solution that is NEARER replaces
    the same one."""
    rows, ranks = solutions.rows, solutions.ranks
    k = 0
    while k < found and not same_solution(geometry, q, rows[k]):
        k += 1
    if k < found:
        if not rank < ranks[k] - NEARER:
            return found
    elif found < len(rows):
        found += 1
    elif rank >= ranks[found - 1]:
        return found
    else:
        k = found - 1
    while k > 0 and ranks[k - 1] > rank:
        assign(rows[k], rows[k - 1])
        ranks[k] = ranks[k - 1]
        k -= 1
    assign(rows[k], q)
    ranks[k] = rank
    return found


@inlined
def keep_touching(geometry, q, rank, obstruction, found):
    """Insert q into the list of configurations that touch, if there is one; return their number."""
    if obstruction is None:
        return found
    return keep_solution(geometry, q, rank, obstruction, found)


@inlined
def forget_touching(obstruction):
    """Empty the list of configurations that touch."""
    if obstruction is not None:
        fill(obstruction.ranks, math.inf)


@inlined
def take_touching(obstruction, k, q):
    """Write the k-th nearest of the configurations that touch to q."""
    if obstruction is not None:
        assign(q, obstruction.rows[k])


@kernel
def same_solution(geometry, q, other):
    """Return whether two solutions differ by less than SAME_SOLUTION in every joint, apart from whole turns."""
    for i in range(len(q)):
        gap = q[i] - other[i]
        if geometry.wraps[i]:
            gap -= TURN * math.floor(gap / TURN + 0.5)
        if abs(gap) > SAME_SOLUTION:
            return False
    return True


@kernel
def count_accepted(ranks, found):
    """Return how many of the solutions are accepted."""
    count = 0
    for k in range(found):
        count += ranks[k] < NOT_ACCEPTED
    return count
