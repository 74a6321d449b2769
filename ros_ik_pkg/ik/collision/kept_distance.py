"""Pairs that are close to each other but can't touch: the distance that they keep wherever the arm is.

The gap of a pair shrinks by no more than its lever times the motion of each joint. So if the gap in the middle of a box
of joint positions is larger than the sum of all levers times half the box's edges, they do not touch anywhere in the
box. Else the box is split across the largest part of that sum: branch and bound with a Lipschitz constant (Piyavskii
1972).
"""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.collision.convex_distance import segment_distance
from ros_ik_pkg.ik.collision.look_ahead import gap_of
from ros_ik_pkg.ik.collision.scene import CAPSULE, cut_placed, place, scene_memory, unpack_scene
from ros_ik_pkg.ik.kernel.compiled import compiled, kernel

OFTEN = 0.1  # share of the samples in which capsules must fail to tell a pair apart; else nothing is gained
SHARE = 0.25  # of the least gap of the samples, which is to be shown for all configurations
LEAST = 1e-4  # [m] least distance that is worth it
MOST_BOXES = 20000  # that are looked at for one pair
DEEPEST = 64  # boxes that wait


@compiled
def kept_distances(packed, levers, samples, bounds):
    """Return (K,): the distance that each pair of a packed scene keeps between bounds (2, n) [m]; -inf if it is not
    known, or if the pair is hardly ever close.

    levers: (C, n), see `contact_of_stop`. samples: (N, n) configurations that show how close the pairs come.
    """
    kept = np.empty(int(packed[2]))
    boxes = np.empty((DEEPEST, 2, bounds.shape[1]))
    _find_kept(packed, levers, samples, bounds, np.empty(scene_memory(packed)), boxes, np.zeros(len(kept)), kept)
    return kept


@kernel
def _find_kept(packed, levers, samples, bounds, memory, boxes, close, kept):
    """Implement `kept_distances`; close (K,) are zeros."""
    scene = unpack_scene(packed)
    placed = cut_placed(scene, memory)
    kept[:] = math.inf
    for s in range(len(samples)):
        place(scene, samples[s], placed)
        for k in range(len(kept)):
            i, j = int(scene.pairs[k, 0]), int(scene.pairs[k, 1])
            radii = scene.pieces[i, CAPSULE + 6] + scene.pieces[j, CAPSULE + 6]
            close[k] += segment_distance(placed.places[i], placed.places[j], placed.guess) <= radii
            if kept[k] > 0.0:
                kept[k] = min(kept[k], gap_of(scene, placed, k, kept[k]))
    for k in range(len(kept)):
        kept[k] *= SHARE
        if close[k] < OFTEN * len(samples) or not kept[k] > LEAST or not _is_kept(
            scene, placed, k, levers[k], bounds, kept[k], boxes
        ):
            kept[k] = -math.inf


@kernel
def _is_kept(scene, placed, k, lever, bounds, distance, boxes):
    """Return whether pair k keeps a distance [m] everywhere between the bounds.

    boxes: (DEEPEST, 2, n) middles and half edges of those that wait.
    """
    for i in range(len(lever)):
        boxes[0, 0, i] = 0.5 * (bounds[0, i] + bounds[1, i])
        boxes[0, 1, i] = 0.5 * (bounds[1, i] - bounds[0, i])
    waiting = 1
    for _ in range(MOST_BOXES):
        middle, half = boxes[waiting - 1, 0], boxes[waiting - 1, 1]
        needed, widest, most = distance, -1, 0.0
        for i in range(len(lever)):
            if lever[i] > 0.0:
                needed += lever[i] * half[i]
                if lever[i] * half[i] > most:
                    widest, most = i, lever[i] * half[i]
        place(scene, middle, placed)
        gap = gap_of(scene, placed, k, needed)
        if gap > needed:
            waiting -= 1
            if waiting == 0:
                return True
            continue
        if not gap > distance or widest < 0 or waiting == len(boxes):
            return False
        half[widest] *= 0.5
        for i in range(len(lever)):
            boxes[waiting, 0, i], boxes[waiting, 1, i] = middle[i], half[i]
        middle[widest] -= half[widest]
        boxes[waiting, 0, widest] += half[widest]
        waiting += 1
    return False
