"""The best route through the candidates of all poses, by dynamic programming; compiled.

A node is a candidate with whole turns added to the joints that may turn so far. An edge joins two nodes of successive
poses if the joints can move from one to the other while the tip stays on its line (`edges.py`). The best route has the
fewest reconfigurations, and among those the least sum of weighted joint steps (L2), including the step from the seed to
the first pose. An edge between two candidates holds for all their turns, so it is checked once.
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
    model, solve, continuing, poses, turns, candidates, counts, upper, wraps, digits, weights, most_steps, bounds,
    seed, stay, most_reconfigurations, barred, first, stop, parents, jumps, costs,
):  # fmt: skip
    """Find the best routes to the nodes of poses `first` to `stop` - 1; return the first pose that is not reached, or
    `stop`.

    Parameters
    ----------
    candidates, counts : as find_candidates and normalise leave them
    upper, wraps : (n,) upper limits, infinite if limits are not respected; which joints may turn a whole turn
    digits : (V, n) int64, all combinations of whole turns added to the joints, the first joint fastest
    weights : (n,) of the joints
    most_steps : (N - 1, n) how far a joint may move between two poses, inf for no bound
    bounds : (4,) of the edges, see parts_of_edge
    seed : (n,) where the joints start, or (0,)
    stay : bool, whether the path must begin at the seed (to within SAME_SOLUTION)
    most_reconfigurations : int
    barred : (B, 2, n) reconfigurations that are not allowed, see `reconfigure`
    parents : (N, m V) int16 out, the node before on the best route
    jumps, costs : (2, m V) int64 and float64, of the nodes of even and of odd poses; kept between calls

    """
    m, n = candidates.shape[1:]
    total = len(digits)
    pairs, states = np.empty((m, n + 2)), np.empty(m, np.int64)
    allowed, fewest, least = np.empty(total, np.int8), np.empty(m, np.int64), np.empty(m)
    places, tables, back = np.ones(n, np.int64), np.empty((n, total)), np.empty((n, total), np.int64)
    for j in range(1, n):
        places[j] = places[j - 1] * (digits[total - 1, j - 1] + 1)
    memory, cuts = np.empty(edge_memory_size(model) + 2 * n), np.empty((MOST_PARTS, n + 1))
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
                    model, solve, continuing, poses, turns, candidates, k, c, wraps, upper, digits, places, bounds,
                    allowed, fewest, least, parents, jumps, costs, pairs[:near], states, memory, cuts,
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

    `route` (2 N,) int64 receives the nodes from the first pose on, as -1 - node if a reconfiguration leads to the node.
    `total` is the number of nodes of a candidate; the other arguments are those of extend_route.
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
    """Write the cost of beginning at each node of the first pose: its distance from the seed, if there is one."""
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
    """Write the fewest reconfigurations among the nodes of each candidate, and the least cost among those nodes."""
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
    """List the candidates of pose k - 1 whose steps to candidate c of pose k are short enough; return their number.

    A row of `pairs` has the whole turns of each joint in the step, the weighted step and the candidate; `states` is 1
    for rows not yet tried.
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
    model, solve, continuing, poses, turns, candidates, k, c, wraps, upper, digits, places, bounds, allowed, fewest,
    least, parents, jumps, costs, pairs, states, memory, cuts,
):  # fmt: skip
    """Find the best parents of the nodes of candidate c of pose k.

    Edges are tried from the best on, as long as they can improve a node, and checked only if they do.
    """
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
                        parts = parts_of_edge(
                            model, solve, continuing, poses, turns, k - 1, q, r, bounds, cuts, memory
                        )
                        if parts == 0:
                            worst_jumps, worst_cost = NEVER, math.inf
                            break
                    jumps[now, node], costs[now, node], parents[k, node] = jump, cost, before
            if jumps[now, node] > worst_jumps:
                worst_jumps, worst_cost = jumps[now, node], costs[now, node]
            elif jumps[now, node] == worst_jumps:
                worst_cost = max(worst_cost, costs[now, node])


@inlined
def turned_between(pair, digits, most, upper):
    """Return whether `digits` plus the whole turns of `pair` are turns that the joints can have."""
    good = True
    for j in range(len(digits)):
        turned = digits[j] + int(pair[j])
        good = good and ((turned >= 0 and turned <= most[j]) or not upper[j] < math.inf)
    return good
