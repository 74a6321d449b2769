"""Straight lines of the joints that are certain to be clear of contact, also between the places looked at.

The gap of two bodies shrinks by at most a lever for each rad or m of a joint. So a line is clear if the gaps in its
middle are larger than what half of it can take away. Other lines are halved; coal measures those for which the bound of
the gaps is too low.
"""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik.collision.look_ahead import gaps_of
from ros_ik_pkg.ik.contacts.contacts import Room

CERTAIN = 1e-6  # m: coal takes bodies that are nearer for touching
FINEST = 1e-3  # rad or m of the joint that moves most: a line as short as this that may touch counts as contact


def clear_lines(
    room: Room, start: np.ndarray, end: np.ndarray, margin: float = 0.0, meshes: bool = False
) -> np.ndarray:
    """Return for each line from start (k, n) to end (k, n) [rad, m] whether nothing comes nearer than `margin` [m]
    on it, (k,) bool."""
    margin += CERTAIN
    clear, line, levers = np.ones(len(start), dtype=bool), np.arange(len(start)), room.levers
    while len(line):
        middle, half = np.ascontiguousarray(0.5 * (start + end)), 0.5 * np.abs(end - start)
        shrink = half @ levers.T + margin
        gaps = gaps_of(room.packed, middle, shrink.max(axis=0))
        near = ~(gaps > shrink)
        open_lines = near.any(axis=1) & clear[line]
        halved = open_lines & (gaps.min(axis=1, initial=np.inf) > margin) & (half.max(axis=1) > 0.5 * FINEST)
        for k in np.flatnonzero(open_lines & ~halved):
            spare = room.look(middle[k], meshes).clearance - margin
            if not spare > half[k] @ levers[near[k]].max(axis=0):
                halved[k] = spare > 0.0 and half[k].max() > 0.5 * FINEST
                clear[line[k]] &= halved[k]
        start = np.concatenate([start[halved], middle[halved]])
        end = np.concatenate([middle[halved], end[halved]])
        line = np.tile(line[halved], 2)
    return clear
