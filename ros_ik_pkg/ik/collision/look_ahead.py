"""Contact in motion: whether a stop stays clear of contact, and how far apart bodies are.

A stop is judged by conservative advancement (Mirtich 1996): two pieces that are `gap` apart stay apart until the joints
have moved them by `gap`, which takes gap / rate at least, where `rate` bounds the speed at which they can approach. So
each pair is looked at again only after that time, and pairs that are far apart only once.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from ros_ik_pkg.ik.collision.scene import cut_placed, floor_gap, pair_bounds, place, scene_memory, unpack_scene
from ros_ik_pkg.ik.kernel.compiled import entry_point, kernel
from ros_ik_pkg.ik.motion.jerk_limited import follow_stop, plan_stop

VECTOR, MATRIX = (types.Array(types.float64, d, 'C') for d in (1, 2))


@kernel
def gap_of(scene, placed, k, clear):
    """Return a lower bound of the distance of contact k [m], numbered as in `first_contact`; exact to 1e-7 m if the
    pieces are no further apart than `clear` and do not overlap."""
    pairs = len(scene.pairs)
    if k < pairs:
        lower, _ = pair_bounds(scene, placed, k, clear, -math.inf)
        return lower
    return floor_gap(scene, placed, int(scene.above[k - pairs]), clear)


@entry_point(MATRIX, [VECTOR, MATRIX, VECTOR])
def gaps_of(packed, configurations, within):
    """Return (N, C): `gap_of` each contact at each configuration (N, n), or inf if it exceeds `within` (C,)."""
    gaps = np.empty((len(configurations), int(packed[2]) + int(packed[3])))
    _write_gaps(packed, configurations, within, np.empty(scene_memory(packed)), gaps)
    return gaps


@kernel
def _write_gaps(packed, configurations, within, memory, gaps):
    """Write the gaps of each configuration."""
    scene = unpack_scene(packed)
    placed = cut_placed(scene, memory)
    for i in range(len(configurations)):
        place(scene, configurations[i], placed)
        for k in range(gaps.shape[1]):
            gap = gap_of(scene, placed, k, within[k])
            gaps[i, k] = math.inf if gap > within[k] else gap


@entry_point(types.int64, [VECTOR] + [MATRIX, VECTOR] + [MATRIX] * 2 + [types.float64, VECTOR])
def contact_of_stop(packed, levers, margins, state, limits, period, where):
    """Return the first contact, numbered as in `first_contact`, on the shortest stop from a state; -1 if it is clear.

    levers: (C, n) by how much a contact's gap shrinks at most per rad or m of each joint. margins: (C,) [m] the gap
    that must remain, -inf for contacts that do not count. state: (3, n) position, velocity, acceleration. limits:
    (5, n) as for `advance`. period: [s] the shortest time between two looks.
    where: (n,) receives the joint positions at the contact.
    """
    contacts = int(packed[2]) + int(packed[3])
    return _follow_stop(
        packed, levers, margins, state, limits, period, where, np.empty((2, contacts)), np.empty(scene_memory(packed))
    )


@kernel
def _follow_stop(packed, levers, margins, state, limits, period, where, table, memory):
    """Implement `contact_of_stop`; table (2, C): rates [m/s] and when to look again [s]."""
    scene = unpack_scene(packed)
    placed = cut_placed(scene, memory)
    rates, due = table[0], table[1]
    end = 0.0
    rates[:] = 0.0
    due[:] = 0.0
    for i in range(state.shape[1]):
        v, a = state[1, i], state[2, i]
        _, _, t1, t2, t3 = plan_stop(v, a, limits[3, i], limits[4, i])
        end = max(end, t1 + t2 + t3)
        fastest = max(abs(v), abs(v + 0.5 * a * abs(a) / limits[4, i]))
        for k in range(len(rates)):
            rates[k] += levers[k, i] * fastest
    time = 0.0
    while time < math.inf:
        for i in range(state.shape[1]):
            where[i], _, _ = follow_stop(
                state[0, i], state[1, i], state[2, i], limits[3, i], limits[4, i], time
            )
        place(scene, where, placed)
        soonest = math.inf
        for k in range(len(rates)):
            if due[k] <= time:
                enough = margins[k] + rates[k] * max(end - time, 0.0)
                gap = gap_of(scene, placed, k, enough)
                if not gap > margins[k]:
                    return k
                due[k] = math.inf if gap > enough else time + (gap - margins[k]) / rates[k]
            soonest = min(soonest, due[k])
        if soonest < math.inf:
            soonest = max(math.floor(soonest / period), math.floor(time / period) + 1.0) * period
        time = soonest if soonest == math.inf or time >= end else min(soonest, end)
    return -1
