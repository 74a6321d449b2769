"""Reconfigurations in the search for the best route, compiled: from one node of a pose to another, off the line."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import kernel
from ros_ik_pkg.ik.step.limits import TURN

RECONFIGURED = -2  # parent -2 - i: from node i of the same pose
BARRED_AROUND = 0.1  # rad or m: a reconfiguration is barred if both its ends are this near to those of a barred one


@kernel
def within(q, upper, wraps, digits, allowed):
    """Write for each row of `digits` whether q plus these turns is within the upper limits; `normalise` has seen to the
    lower ones."""
    total = len(digits)
    allowed[:] = 1
    for j in range(len(q)):
        if wraps[j] and q[j] + TURN * digits[total - 1, j] > upper[j]:
            for u in range(total):
                if q[j] + TURN * digits[u, j] > upper[j]:
                    allowed[u] = 0


@kernel
def reconfigure(
    q, count, upper, wraps, digits, places, weights, most, barred, parents, jumps, costs, fewest, least, allowed,
    tables, back,
):  # fmt: skip
    """Let the nodes of a pose with the fewest reconfigurations lead to all its other nodes with one more.

    q : (m, n), the first `count` rows are the candidates of the pose
    fewest, least : (m,) of the nodes of each candidate, see look_for_best
    barred : (B, 2, n) ends of reconfigurations that are not allowed
    allowed, tables, back : scratch arrays (V,), (n, V), (n, V)

    Among the turns of one candidate, those nearest to a node bound the distance of all. If the bound leaves room for an
    improvement, they are tried first, then the others.
    """
    total, n = len(digits), q.shape[1]
    few = most
    for c in range(count):
        few = min(few, fewest[c])
    if few >= most:
        return
    for c in range(count):
        within(q[c], upper, wraps, digits, allowed)
        done = True
        for u in range(total):
            done = done and (not allowed[u] or jumps[c * total + u] == few)
        for d in range(count):
            if done or fewest[d] != few:
                continue
            find_nearest_turns(q[c], q[d], upper, wraps, digits, places, weights, tables, back)
            for u in range(total):
                node = c * total + u
                if not allowed[u] or jumps[node] == few:
                    continue
                cost = costs[node] if jumps[node] == few + 1 else math.inf
                square, nearest = 0.0, d * total
                for j in range(n):
                    square += tables[j, digits[u, j]]
                    nearest += back[j, digits[u, j]]
                bound = math.sqrt(square)
                if least[d] + bound >= cost:
                    continue
                if (
                    jumps[nearest] == few
                    and costs[nearest] + bound < cost
                    and not is_barred(q, d, nearest - d * total, c, u, upper, digits, barred)
                ):
                    cost = costs[nearest] + bound
                    jumps[node], costs[node], parents[node] = few + 1, cost, RECONFIGURED - nearest
                if least[d] + bound >= cost:
                    continue
                for v in range(total):
                    other = d * total + v
                    if jumps[other] != few or costs[other] + bound >= cost:
                        continue
                    length = costs[other] + distance(q, c, u, d, v, upper, wraps, digits, weights)
                    if length < cost and not is_barred(q, d, v, c, u, upper, digits, barred):
                        cost = length
                        jumps[node], costs[node], parents[node] = few + 1, cost, RECONFIGURED - other


@kernel
def find_nearest_turns(q, other, upper, wraps, digits, places, weights, tables, back):
    """Write for each joint and each of its turns the square of the least weighted step from `other`, and what the turns
    that the step begins at add to the number of the node."""
    last = len(digits) - 1
    for j in range(len(q)):
        gap = q[j] - other[j]
        if wraps[j] and not upper[j] < math.inf:
            gap -= TURN * math.floor(gap / TURN + 0.5)
        for a in range(digits[last, j] + 1):
            tables[j, a] = math.inf
            for b in range(digits[last, j] + 1):
                square = (weights[j] * (gap + TURN * (a - b))) ** 2
                if square < tables[j, a]:
                    tables[j, a], back[j, a] = square, b * places[j]


@kernel
def distance(q, c, u, d, v, upper, wraps, digits, weights):
    """Return the weighted distance of two nodes of a pose."""
    square = 0.0
    for j in range(q.shape[1]):
        step = q[c, j] - q[d, j] + TURN * (digits[u, j] - digits[v, j])
        if wraps[j] and not upper[j] < math.inf:
            step -= TURN * math.floor(step / TURN + 0.5)
        square += (weights[j] * step) ** 2
    return math.sqrt(square)


@kernel
def is_barred(q, d, v, c, u, upper, digits, barred):
    """Return whether the reconfiguration from node (d, v) to (c, u) is near one that is barred."""
    for i in range(len(barred)):
        near = True
        for j in range(q.shape[1]):
            start = q[d, j] + TURN * digits[v, j] - barred[i, 0, j]
            end = q[c, j] + TURN * digits[u, j] - barred[i, 1, j]
            if not upper[j] < math.inf:
                start -= TURN * math.floor(start / TURN + 0.5)
                end -= TURN * math.floor(end / TURN + 0.5)
            near = near and abs(start) <= BARRED_AROUND and abs(end) <= BARRED_AROUND
        if near:
            return True
    return False
