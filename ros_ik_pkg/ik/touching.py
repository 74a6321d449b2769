"""A second look, by coal, at configurations that hold a target but are not certain to be clear of contact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ros_ik_pkg.ik.contacts.contacts import Room
from ros_ik_pkg.ik.options import SolveOptions
from ros_ik_pkg.ik.search.entry import ATTEMPTS, COMPLETENESS, FOUND, STATUS, STEPS, TIME, WIDTH
from ros_ik_pkg.ik.search.search import COLLISION
from ros_ik_pkg.ik.solution import Status


def take_best(
    look_at: Callable[[np.ndarray, np.ndarray, np.ndarray], None], options: SolveOptions, room: Room,
    touching: np.ndarray, row: np.ndarray,
) -> None:
    """Write the first configuration of `touching` (k, n) that is clear by coal to `row`, or else the one that touches
    least.

    The search uses a lower bound of distances, so what it calls clear is clear, but what it says touches may be clear.
    `look_at(q, numbers, row)` writes q and its figures to a row, by these numbers of SolveOptions.
    """
    meshes, margin = options.collision_geometry == 'mesh', options.collision_margin
    clear = next((q for q in touching if room.is_clear(q, margin, meshes)), None)
    best = clear if clear is not None else max(touching, key=lambda q: room.look(q, meshes).clearance)
    lone = replace(options, choice='first', max_attempts=1, max_iterations=0, null_space='none')
    one = np.empty_like(row)
    look_at(best, lone.numbers, one)
    held = one[STATUS - WIDTH] in (Status.CONVERGED, Status.JOINT_JUMP)
    for figure in (STEPS, ATTEMPTS, COMPLETENESS, TIME):
        one[figure - WIDTH] = row[figure - WIDTH]
    if not (held and clear is not None and np.array_equal(one[: len(best)], best)):
        one[STATUS - WIDTH], one[FOUND - WIDTH] = COLLISION, 0.0
    row[:] = one
