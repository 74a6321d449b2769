"""The best way through the candidates of all poses, by dynamic programming: compiled.

A node is a candidate together with whole turns of the joints that may turn round. From pose to pose a node leads to
those that the joints reach in a straight line while the tip stays on its line (`edges.py`). Fewest reconfigurations
count first, then the sum of the weighted joint steps (L2), that from the seed to the first pose included.
"""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import compiled, inlined, kernel
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.path.edges import MOST_PARTS, edge_memory_size, parts_of_edge
from ros_ik_pkg.ik.search.solutions import SAME_SOLUTION
from ros_ik_pkg.ik.step.limits import TURN

NO_PARENT = -1
RECONFIGURED = -2  # parent -2 - i: from node i of the same pose


@compiled
def best_route(
    model, continuing, poses, turns, candidates, counts, lower, upper, wraps, most_turns, weights, most_steps,
    bounds, seed, stay, most_reconfigurations, parents, route,
):  # fmt: skip
    """Find the best route; return (poses reached, node at the last of them).

    Parameters
    ----------
    candidates, counts : as find_candidates and normalise leave them
    lower, upper, wraps : (n,) limits, infinite if they do not count
    most_turns : (n,) int64, how many whole turns apart a joint can be, one more
    weights : (n,) of the joints
    most_steps : (N - 1, n) how far a joint may move between two poses, inf for no bound
    bounds : (4,) of the edges, see parts_of_edge
    seed : (n,) where the joints start, or (0,)
    stay : bool, whether the path must begin at the seed, to SAME_SOLUTION
    most_reconfigurations : int
    parents : (N, m V) int32 out, V the product of most_turns
    route : (2 N,) int64 out, the nodes from the first pose to the last reached, negative if the joints were
        reconfigured to get there: -1 - node. Its length is the third number returned.

    """
    _count, m, n = candidates.shape
    total = 1
    for j in range(n):
        total *= most_turns[j]
    digits = np.empty((total, n), np.int64)
    for u in range(total):
        rest = u
        for j in range(n):
            digits[u, j] = rest % most_turns[j]
            rest //= most_turns[j]
    jumps = np.full((2, m * total), 1 << 30, np.int64)
    costs = np.full((2, m * total), math.inf)
    pairs = np.empty((m, n + 2))
    states = np.empty(m, np.int64)
    order = np.empty(m * total, np.int64)
    memory = np.empty(edge_memory_size(model) + 2 * n)
    between = np.empty((MOST_PARTS, n))
    reached, node = _forward(
        model, continuing, poses, turns, candidates, counts, lower, upper, wraps, digits, weights, most_steps,
        bounds, seed, stay, most_reconfigurations, parents, jumps, costs, pairs, states, order, memory, between,
    )  # fmt: skip
    length = 0
    if reached > 0:
        k, at = reached - 1, node
        while True:
            parent = parents[k, at]
            if parent <= RECONFIGURED:
                route[length] = -1 - at
                at = RECONFIGURED - parent
            else:
                route[length] = at
                at = parent
                k -= 1
            length += 1
            if parent == NO_PARENT:
                break
    for i in range(length // 2):
        route[i], route[length - 1 - i] = route[length - 1 - i], route[i]
    return reached, node, length


@kernel
def _forward(
    model, continuing, poses, turns, candidates, counts, lower, upper, wraps, digits, weights, most_steps, bounds,
    seed, stay, most_reconfigurations, parents, jumps, costs, pairs, states, order, memory, between,
):  # fmt: skip
    """Fill `parents` pose by pose; return how many poses were reached and the best node at the last of them."""
    _n, total = candidates.shape[2], len(digits)
    last_best = -1
    for k in range(len(counts)):
        now, _then = k % 2, 1 - k % 2
        for node in range(counts[k] * total):
            jumps[now, node], costs[now, node], parents[k, node] = 1 << 30, math.inf, NO_PARENT
        if k == 0:
            begin(candidates[0], counts[0], lower, upper, wraps, digits, weights, seed, stay, jumps[0], costs[0])
        else:
            for c in range(counts[k]):
                near = collect(candidates, counts, k, c, wraps, weights, most_steps, bounds[2], pairs, states)
                for u in range(total):
                    if not within(candidates[k, c], upper, wraps, digits[u]):
                        continue
                    relax(
                        model, continuing, poses, turns, candidates, counts, k, c, u, wraps, digits, bounds,
                        parents, jumps, costs, pairs[:near], states, memory, between,
                    )  # fmt: skip
        if most_reconfigurations > 0:
            reconfigure(candidates[k], counts[k], upper, wraps, digits, weights, most_reconfigurations, parents[k],
                        jumps[now], costs[now], order)
        best = -1
        for node in range(counts[k] * total):
            if costs[now, node] < math.inf and (
                best < 0
                or jumps[now, node] < jumps[now, best]
                or (jumps[now, node] == jumps[now, best] and costs[now, node] < costs[now, best])
            ):
                best = node
        if best < 0:
            return k, last_best
        last_best = best
    return len(counts), last_best


@kernel
def within(q, upper, wraps, digits):
    """Return whether q with these turns added is within the upper limits; `normalise` keeps the lower ones."""
    for j in range(len(q)):
        if wraps[j] and q[j] + TURN * digits[j] > upper[j]:
            return False
    return True


@kernel
def begin(q, count, lower, upper, wraps, digits, weights, seed, stay, jumps, costs):
    """Write what it costs to begin at each node of the first pose: its distance from the seed, if there is one."""
    total = len(digits)
    for c in range(count):
        for u in range(total):
            if not within(q[c], upper, wraps, digits[u]):
                continue
            square, largest = 0.0, 0.0
            for j in range(len(seed)):
                step = q[c, j] + TURN * digits[u, j] - seed[j]
                if wraps[j] and not upper[j] < math.inf:
                    step -= TURN * math.floor(step / TURN + 0.5)
                square += (weights[j] * step) ** 2
                largest = max(largest, abs(step))
            if not stay or largest <= SAME_SOLUTION:
                jumps[c * total + u], costs[c * total + u] = 0, math.sqrt(square)


@kernel
def collect(candidates, counts, k, c, wraps, weights, most_steps, longest, pairs, states):
    """List what may lead to candidate c of pose k, the steps being short enough; return how many there are.

    A row of `pairs` is the whole turns of each joint, the weighted step and the candidate; `states` becomes 1.
    """
    n, found = candidates.shape[2], 0
    for b in range(counts[k - 1]):
        square, near = 0.0, True
        for j in range(n):
            step = candidates[k, c, j] - candidates[k - 1, b, j]
            whole = math.floor(step / TURN + 0.5) if wraps[j] else 0.0
            step -= TURN * whole
            if abs(step) > longest or abs(step) > most_steps[k - 1, j]:
                near = False
                break
            pairs[found, j] = whole
            square += (weights[j] * step) ** 2
        if near:
            pairs[found, n], pairs[found, n + 1], states[found] = math.sqrt(square), b, 1
            found += 1
    return found


@kernel
def relax(
    model, continuing, poses, turns, candidates, counts, k, c, u, wraps, digits, bounds, parents, jumps, costs,
    pairs, states, memory, between,
):  # fmt: skip
    """Find the best parent of the node (c, u) of pose k. An edge is checked (states 1) only once it is the best of
    those that are left; after that it exists (2) or does not (0)."""
    n, total = candidates.shape[2], len(digits)
    now, then = k % 2, 1 - k % 2
    while True:
        best, best_jumps, best_cost, parent = -1, 1 << 30, math.inf, -1
        for i in range(len(pairs)):
            if states[i] == 0:
                continue
            node = source(int(pairs[i, n + 1]), u, pairs[i], digits)
            if node < 0 or not costs[then, node] < math.inf:
                continue
            cost = costs[then, node] + pairs[i, n]
            if jumps[then, node] < best_jumps or (jumps[then, node] == best_jumps and cost < best_cost):
                best, best_jumps, best_cost, parent = i, jumps[then, node], cost, node
        if best < 0:
            return
        if states[best] == 1:
            size = len(memory) - 2 * n
            a, b = shaped(memory, size, (n,)), shaped(memory, size + n, (n,))
            for j in range(n):
                a[j] = candidates[k - 1, int(pairs[best, n + 1]), j]
                b[j] = candidates[k, c, j] - TURN * pairs[best, j]
            parts = parts_of_edge(model, continuing, poses, turns, k - 1, a, b, bounds, between, memory)
            states[best] = 2 if parts > 0 else 0
        if states[best] == 2:
            node = c * total + u
            jumps[now, node], costs[now, node], parents[k, node] = best_jumps, best_cost, parent
            return


@inlined
def source(b, u, pair, digits):
    """Return the node of candidate b, one pose before, from which the joints get to turns u without a whole turn."""
    total, n = len(digits), digits.shape[1]
    node, place = 0, 1
    for j in range(n):
        most = digits[total - 1, j] + 1
        if most > 1:
            turns = digits[u, j] + int(pair[j])
            if turns < 0 or turns >= most:
                return -1
            node += place * turns
            place *= most
    return b * total + node


@kernel
def reconfigure(q, count, upper, wraps, digits, weights, most, parents, jumps, costs, order):
    """Let the nodes of a pose with the fewest reconfigurations lead to all others of it by one more."""
    total = len(digits)
    fewest, found = 1 << 30, 0
    for node in range(count * total):
        fewest = min(fewest, jumps[node])
    if fewest >= most:
        return
    for node in range(count * total):
        if jumps[node] == fewest:  # by rising cost, so that the search for each node can end early
            i = found
            while i > 0 and costs[order[i - 1]] > costs[node]:
                order[i] = order[i - 1]
                i -= 1
            order[i] = node
            found += 1
    for node in range(count * total):
        c, u = node // total, node % total
        if jumps[node] == fewest or not within(q[c], upper, wraps, digits[u]):
            continue
        best, cost = -1, costs[node] if jumps[node] == fewest + 1 else math.inf
        for i in range(found):
            other = order[i]
            if costs[other] >= cost:
                break
            length = costs[other] + distance(q, c, u, other // total, other % total, upper, wraps, digits, weights)
            if length < cost:
                best, cost = other, length
        if best >= 0:
            jumps[node], costs[node], parents[node] = fewest + 1, cost, RECONFIGURED - best


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
