"""A second look, by coal, at configurations that hold a target but are not certain to be clear of contact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ros_ik_pkg.ik.contacts.contacts import Room
from ros_ik_pkg.ik.options import SolveOptions
from ros_ik_pkg.ik.search.entry import ATTEMPTS, COMPLETENESS, FOUND, STATUS, STEPS, TIME, WIDTH
from ros_ik_pkg.ik.search.search import COLLISION
from ros_ik_pkg.ik.search.solutions import SAME_SOLUTION
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
    one, held = _look_alone(look_at, options, best, row)
    if not (held and clear is not None):
        one[STATUS - WIDTH], one[FOUND - WIDTH] = COLLISION, 0.0
    row[:] = one


def add_clear(
    look_at: Callable[[np.ndarray, np.ndarray, np.ndarray], None], options: SolveOptions, room: Room,
    touching: np.ndarray, reference: np.ndarray, row: np.ndarray, answers: np.ndarray,
) -> None:
    """Insert the configurations of `touching` (k, n) that are clear by coal into `answers`, nearest to the reference
    (n,) first; write the nearest of all and its figures to `row`.

    Arguments are those of `take_best`. All joints are revolute.
    """
    n, meshes, margin = len(reference), options.collision_geometry == 'mesh', options.collision_margin
    known = list(answers[: int(row[FOUND - WIDTH])].copy())
    rows = [row.copy()] * len(known)
    for q in [q for q in touching if room.is_clear(q, margin, meshes)]:
        if not any(_is_same(q, other) for other in known):
            one, held = _look_alone(look_at, options, q, row)
            if held and one[STATUS - WIDTH] == Status.CONVERGED:
                known.append(q)
                rows.append(one)
    if len(known) == row[FOUND - WIDTH]:
        return
    weights = np.array(options.joint_weights or np.ones(n))
    order = np.argsort([np.linalg.norm(weights * (q - reference)) for q in known], kind='stable')[: len(answers)]
    row[:] = rows[order[0]]
    row[FOUND - WIDTH] = len(order)
    answers[: len(order)] = np.array(known)[order]


def _look_alone(
    look_at: Callable[[np.ndarray, np.ndarray, np.ndarray], None], options: SolveOptions, q: np.ndarray,
    row: np.ndarray,
) -> tuple[np.ndarray, bool]:
    """Return a row with q and its figures, those of the search from `row`, and whether q holds the target."""
    lone = replace(options, choice='first', max_attempts=1, max_iterations=0, null_space='none')
    one = np.empty_like(row)
    look_at(q, lone.numbers, one)
    for figure in (STEPS, ATTEMPTS, COMPLETENESS, TIME):
        one[figure - WIDTH] = row[figure - WIDTH]
    held = one[STATUS - WIDTH] in (Status.CONVERGED, Status.JOINT_JUMP) and np.array_equal(one[: len(q)], q)
    return one, held


def _is_same(q: np.ndarray, other: np.ndarray) -> bool:
    """Return whether two configurations of revolute joints count as one, apart from whole turns."""
    gaps = np.remainder(q - other + np.pi, 2.0 * np.pi) - np.pi
    return float(np.max(np.abs(gaps))) <= SAME_SOLUTION
