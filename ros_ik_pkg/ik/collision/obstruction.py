"""Contact in the search: a configuration that solves the task but touches something is no solution."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik.collision.scene import cut_placed, first_contact, scene_memory, unpack_scene
from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.data_layout import packed_size
from ros_ik_pkg.ik.kernel.numba_insides import shaped

MOST_TOUCHING = 8  # configurations that are kept, for an exact look and for the report of a failure


class Obstruction(NamedTuple):
    """A packed scene, and the configurations that solve the task but are not clear of contact."""

    scene: np.ndarray  # of length 0 if contact does not count
    memory: np.ndarray
    rows: np.ndarray  # (MOST_TOUCHING, n) the nearest ones
    ranks: np.ndarray  # (MOST_TOUCHING,)


@inlined
def obstruction_size(model):
    """Return how many float64 make_obstruction needs."""
    start = packed_size(model)
    scene = shaped(model, start, (len(model) - start,))
    return scene_memory(scene) + MOST_TOUCHING * (int(model[0]) + 1)


@inlined
def make_obstruction(model, memory, touching, rows):
    """Return an Obstruction in a block of memory, with its configurations in `touching` if that has rows.

    For kernels only. It is None if `rows` is None, as in solve_usual: then no code for contact is compiled.
    """
    if rows is None:
        return None
    n, start = int(model[0]), packed_size(model)
    scene = shaped(model, start, (len(model) - start,))
    a = scene_memory(scene)
    b = a + MOST_TOUCHING * n
    own = shaped(memory, a, (MOST_TOUCHING, n))
    return Obstruction(
        scene, shaped(memory, 0, (a,)), touching if len(touching) > 0 else own, shaped(memory, b, (MOST_TOUCHING,)),
    )  # fmt: skip


@inlined
def touches(obstruction, margin, q):
    """Return whether q may be in contact: False only if everything is provably further apart than `margin` [m]."""
    if obstruction is None:
        return False
    return len(obstruction.scene) > 0 and in_contact(obstruction.scene, obstruction.memory, margin, q)


@kernel
def in_contact(packed, memory, margin, q):
    """Implement `touches`."""
    scene = unpack_scene(packed)
    return first_contact(scene, q, margin, cut_placed(scene, memory)) >= 0
