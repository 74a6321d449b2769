"""The best way through the candidates of all poses, by dynamic programming: compiled.

A node is a candidate together with whole turns of the joints that may turn round. From pose to pose a node leads to
those that the joints reach in a straight line while the tip stays on its line (`edges.py`). Fewest reconfigurations
count first, then the sum of the weighted joint steps (L2), that from the seed to the first pose included.
An edge between two candidates holds for all their turns alike, so it is checked once and then taken by all of them.
"""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import compiled, inlined, kernel
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.path.edges import MOST_PARTS, edge_memory_size, parts_of_edge
from ros_ik_pkg.ik.path.reconfiguring import RECONFIGURED, reconfigure, within
from ros_ik_pkg.ik.search.solutions import SAME_SOLUTION
from ros_ik_pkg.ik.step.limits import TURN

NO_PARENT = -1
NEVER = 1 << 30  # reconfigurations of a node that is not reached


@compiled
def extend_route(
    model, continuing, poses, turns, candidates, counts, upper, wraps, digits, weights, most_steps, bounds,
    seed, stay, most_reconfigurations, barred, first, stop, parents, jumps, costs,
):  # fmt: skip
    """Find the best routes to the nodes of poses `first` to `stop` - 1; return the first pose that is not reached, or
    `stop`.

    Parameters
    ----------
    candidates, counts : as find_candidates and normalise leave them
    upper, wraps : (n,) limits, infinite if they do not count
    digits : (V, n) int64, the whole turns that the joints can be apart, in all combinations, the first joint fastest
    weights : (n,) of the joints
    most_steps : (N - 1, n) how far a joint may move between two poses, inf for no bound
    bounds : (4,) of the edges, see parts_of_edge
    seed : (n,) where the joints start, or (0,)
    stay : bool, whether the path must begin at the seed, to SAME_SOLUTION
    most_reconfigurations : int
    barred : (B, 2, n) reconfigurations that are not allowed, see `reconfigure`
    parents : (N, m V) int16 out, see trace_route
    jumps, costs : (2, m V) int64 and float64, of the nodes of even and of odd poses; kept between calls

    """
    m, n = candidates.shape[1:]
    total = len(digits)
    pairs, states = np.empty((m, n + 2)), np.empty(m, np.int64)
    allowed, fewest, least = np.empty(total, np.int8), np.empty(m, np.int64), np.empty(m)
    places, tables, back = np.ones(n, np.int64), np.empty((n, total)), np.empty((n, total), np.int64)
    for j in range(1, n):
        places[j] = places[j - 1] * (digits[total - 1, j - 1] + 1)
    memory, between = np.empty(edge_memory_size(model) + 2 * n), np.empty((MOST_PARTS, n))
    for k in range(first, stop):
        now, then = k % 2, 1 - k % 2
        if k == 0:
            begin(candidates[0], counts[0], upper, wraps, digits, weights, seed, stay, jumps[0], costs[0])
            parents[0, : counts[0] * total] = NO_PARENT
        else:
            look_for_best(jumps[then], costs[then], counts[k - 1], total, fewest, least)
            for c in range(counts[k]):
                near = collect(candidates, counts, k, c, wraps, weights, most_steps, bounds[2], pairs, states)
                within(candidates[k, c], upper, wraps, digits, allowed)
                relax(
                    model, continuing, poses, turns, candidates, k, c, wraps, upper, digits, places, bounds,
                    allowed, fewest, least, parents, jumps, costs, pairs[:near], states, memory, between,
                )  # fmt: skip
        if most_reconfigurations > 0:
            look_for_best(jumps[now], costs[now], counts[k], total, fewest, least)
            reconfigure(candidates[k], counts[k], upper, wraps, digits, places, weights, most_reconfigurations, barred,
                        parents[k], jumps[now], costs[now], fewest, least, allowed, tables, back)
        if best_node(jumps[now], costs[now], counts[k] * total) < 0:
            return k
    return stop


@compiled
def trace_route(parents, jumps, costs, counts, total, reached, route):
    """Write the best route to the last of `reached` poses; return its length.

    `route` (2 N,) int64 gets the nodes from the first pose on, negative if the joints were reconfigured to get there:
    -1 - node. `total`: turns of a candidate. The others are those of extend_route.
    """
    if reached == 0:
        return 0
    k, length = reached - 1, 0
    at = best_node(jumps[k % 2], costs[k % 2], counts[k] * total)
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
    return length


@kernel
def begin(q, count, upper, wraps, digits, weights, seed, stay, jumps, costs):
    """Write what it costs to begin at each node of the first pose: its distance from the seed, if there is one."""
    total = len(digits)
    for c in range(count):
        for u in range(total):
            node = c * total + u
            jumps[node], costs[node] = NEVER, math.inf
            inside, square, largest = True, 0.0, 0.0
            for j in range(q.shape[1]):
                value = q[c, j] + TURN * digits[u, j]
                inside = inside and not (wraps[j] and value > upper[j])
                if len(seed) > 0:
                    step = value - seed[j]
                    if wraps[j] and not upper[j] < math.inf:
                        step -= TURN * math.floor(step / TURN + 0.5)
                    square += (weights[j] * step) ** 2
                    largest = max(largest, abs(step))
            if inside and (not stay or largest <= SAME_SOLUTION):
                jumps[node], costs[node] = 0, math.sqrt(square)


@kernel
def look_for_best(jumps, costs, count, total, fewest, least):
    """Write for each candidate of a pose the fewest reconfigurations of its nodes, and the least cost of those."""
    for c in range(count):
        fewest[c], least[c] = NEVER, math.inf
        for node in range(c * total, (c + 1) * total):
            if jumps[node] < fewest[c] or (jumps[node] == fewest[c] and costs[node] < least[c]):
                fewest[c], least[c] = jumps[node], costs[node]


@kernel
def best_node(jumps, costs, count):
    """Return the best of the first `count` nodes of a pose, -1 if none is reached."""
    best = -1
    for node in range(count):
        if costs[node] < math.inf and (
            best < 0 or jumps[node] < jumps[best] or (jumps[node] == jumps[best] and costs[node] < costs[best])
        ):
            best = node
    return best


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
            whole = 0.0
            if wraps[j] and abs(step) > 0.5 * TURN:
                whole = math.floor(step / TURN + 0.5)
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
    model, continuing, poses, turns, candidates, k, c, wraps, upper, digits, places, bounds, allowed, fewest, least,
    parents, jumps, costs, pairs, states, memory, between,
):  # fmt: skip
    """Find the best parents of the nodes of candidate c of pose k. Edges are looked at from the best on, as long as
    they can make a node better, and checked only if they do."""
    n, total = candidates.shape[2], len(digits)
    now, then = k % 2, 1 - k % 2
    start = c * total
    for node in range(start, start + total):
        jumps[now, node], costs[now, node], parents[k, node] = NEVER, math.inf, NO_PARENT
    worst_jumps, worst_cost = NEVER, math.inf
    while True:
        best, best_jumps, best_cost = -1, NEVER, math.inf
        for i in range(len(pairs)):
            b = int(pairs[i, n + 1])
            cost = least[b] + pairs[i, n]
            if states[i] and (fewest[b] < best_jumps or (fewest[b] == best_jumps and cost < best_cost)):
                best, best_jumps, best_cost = i, fewest[b], cost
        if best < 0 or best_jumps > worst_jumps or (best_jumps == worst_jumps and best_cost >= worst_cost):
            return
        states[best] = 0
        b, step, shift, whole = int(pairs[best, n + 1]), pairs[best, n], 0, False
        for j in range(n):
            if pairs[best, j] != 0.0 and upper[j] < math.inf:
                shift += places[j] * int(pairs[best, j])
                whole = True
        shift += b * total
        checked = False
        worst_jumps, worst_cost = 0, 0.0
        for u in range(total):
            node, before = start + u, shift + u
            if not allowed[u]:
                continue
            if not whole or turned_between(pairs[best], digits[u], digits[total - 1], upper):
                jump, cost = jumps[then, before], costs[then, before] + step
                if jump < jumps[now, node] or (jump == jumps[now, node] and cost < costs[now, node]):
                    if not checked:
                        checked = True
                        size = len(memory) - 2 * n
                        q, r = shaped(memory, size, (n,)), shaped(memory, size + n, (n,))
                        for j in range(n):
                            q[j] = candidates[k - 1, b, j]
                            r[j] = candidates[k, c, j] - TURN * pairs[best, j]
                        if parts_of_edge(model, continuing, poses, turns, k - 1, q, r, bounds, between, memory) == 0:
                            worst_jumps, worst_cost = NEVER, math.inf
                            break
                    jumps[now, node], costs[now, node], parents[k, node] = jump, cost, before
            if jumps[now, node] > worst_jumps:
                worst_jumps, worst_cost = jumps[now, node], costs[now, node]
            elif jumps[now, node] == worst_jumps:
                worst_cost = max(worst_cost, costs[now, node])


@inlined
def turned_between(pair, digits, most, upper):
    """Return whether the joints can have been `pair` whole turns further on than `digits`."""
    good = True
    for j in range(len(digits)):
        turned = digits[j] + int(pair[j])
        good = good and ((turned >= 0 and turned <= most[j]) or not upper[j] < math.inf)
    return good
