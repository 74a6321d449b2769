"""The scene for compiled code: bodies, convex pieces, pairs and floor in one flat array.

A body is rigid; one joint of the robot's tree moves it, or it is fixed in the root frame. A piece is the convex hull of
a few points in its body's frame, rounded by a radius; it contains a part of a link or of an obstacle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik.collision.convex_distance import SCRATCH, furthest, hull_distance, segment_distance
from ros_ik_pkg.ik.kernel.compiled import compiled, inlined, kernel
from ros_ik_pkg.ik.kernel.numba_insides import shaped

HEADER = 7  # numbers before the parts of a packed scene
JOINT = 17  # numbers of a joint: parent body, prismatic, variable, multiplier, offset, placement (12)
PIECE = 17  # numbers of a piece: body, first vertex, few, radius, all, fine radius, sphere (4), capsule (7)
BODY, FIRST, FEW, RADIUS, ALL, FINE_RADIUS, SPHERE, CAPSULE = 0, 1, 2, 3, 4, 5, 6, 10  # where they begin
PAIR, KEPT = 3, 2  # numbers of a pair; which of them is the distance that its pieces keep
PLACES = 9  # numbers of a placed piece: the sphere's centre, the capsule's ends
POSE = 12  # rotation row by row, position
NO_FLOOR = -math.inf


class Scene(NamedTuple):
    """The parts of a packed scene; body 0 is the root frame, body k + 1 hangs on joint k."""

    variables: float  # how many
    base: float  # body that the base frame is fixed to
    floor: float  # height in the base frame [m]
    joints: np.ndarray  # (m, JOINT) parents first; variable -1: the joint stays at its offset
    poses: np.ndarray  # (m + 1, POSE) in the root frame, those that no variable moves are filled in; first the identity
    pieces: np.ndarray  # (p, PIECE) in their bodies' frames
    pairs: np.ndarray  # (k, PAIR) pieces that may touch, and the distance that they keep [m], -inf if none; that first
    above: np.ndarray  # (f,) pieces that the floor concerns
    body_from_base: np.ndarray  # (POSE,) pose of the base frame in its body
    bounds: np.ndarray  # (2, variables) between which the pairs keep their distances [rad, m]
    vertices: np.ndarray  # (3, v) in their bodies' frames [m]


def pack_scene(scene: Scene) -> np.ndarray:
    """Put a scene into one flat float64 array."""
    sizes = [len(scene.joints), len(scene.pieces), len(scene.pairs), len(scene.above)]
    header = [*sizes, scene.variables, scene.base, scene.floor]
    parts = (
        scene.joints, scene.poses, scene.pieces, scene.pairs, scene.above, scene.body_from_base, scene.bounds,
        scene.vertices,
    )  # fmt: skip
    return np.concatenate([header, *(np.ravel(part).astype(np.float64) for part in parts)])


@inlined
def unpack_scene(scene):
    """Return the Scene that pack_scene packed, as views that are not counted as references: for kernels only."""
    joints, pieces, pairs, above, n = int(scene[0]), int(scene[1]), int(scene[2]), int(scene[3]), int(scene[4])
    a = HEADER + JOINT * joints
    b = a + POSE * (joints + 1)
    c = b + PIECE * pieces
    d = c + PAIR * pairs
    e = d + above
    f = e + POSE
    g = f + 2 * n
    return Scene(
        scene[4], scene[5], scene[6], shaped(scene, HEADER, (joints, JOINT)), shaped(scene, a, (joints + 1, POSE)),
        shaped(scene, b, (pieces, PIECE)), shaped(scene, c, (pairs, PAIR)), shaped(scene, d, (above,)),
        shaped(scene, e, (POSE,)), shaped(scene, f, (2, n)), shaped(scene, g, (3, (len(scene) - g) // 3)),
    )  # fmt: skip


@inlined
def scene_memory(scene):
    """Return how many float64 the functions below need as memory for a packed scene; 0 without a scene."""
    return 0 if len(scene) == 0 else POSE * (int(scene[0]) + 1) + PLACES * int(scene[1]) + POSE + 9 + SCRATCH


class Placed(NamedTuple):
    """A scene at one configuration, in a block of memory."""

    poses: np.ndarray  # (m + 1, POSE) in the root frame
    places: np.ndarray  # (p, PLACES) of the pieces
    base: np.ndarray  # (POSE,) pose of the base frame
    guess: np.ndarray  # (3,)
    points: np.ndarray  # (6,) nearest points of the pair that was looked at last
    work: np.ndarray  # (SCRATCH,)


@inlined
def cut_placed(scene, memory):
    """Return a Placed in a block of memory."""
    bodies, pieces = len(scene.poses), len(scene.pieces)
    a = POSE * bodies
    b = a + PLACES * pieces
    return Placed(
        shaped(memory, 0, (bodies, POSE)), shaped(memory, a, (pieces, PLACES)), shaped(memory, b, (POSE,)),
        shaped(memory, b + POSE, (3,)), shaped(memory, b + POSE + 3, (6,)), shaped(memory, b + POSE + 9, (SCRATCH,)),
    )  # fmt: skip


@kernel
def place(scene, q, placed):
    """Write where all bodies, pieces and the base frame are at q to `placed`."""
    poses = placed.poses
    for r in range(POSE):
        poses[0, r] = scene.poses[0, r]
    for k in range(len(scene.joints)):
        joint = scene.joints[k]
        if joint[2] < -1.5:  # no variable moves it
            for r in range(POSE):
                poses[k + 1, r] = scene.poses[k + 1, r]
        else:
            i = int(joint[2])
            move(poses[int(joint[0])], joint, joint[3] * q[i] + joint[4] if i >= 0 else joint[4], poses[k + 1])
    for k in range(len(scene.pieces)):
        piece = scene.pieces[k]
        body, places = int(piece[BODY]), placed.places[k]
        pose = poses[body]
        for r in range(3):
            if body == 0:
                places[r], places[3 + r], places[6 + r] = piece[SPHERE + r], piece[CAPSULE + r], piece[CAPSULE + 3 + r]
                continue
            x, y, z, origin = pose[3 * r], pose[3 * r + 1], pose[3 * r + 2], pose[9 + r]
            places[r] = x * piece[SPHERE] + y * piece[SPHERE + 1] + z * piece[SPHERE + 2] + origin
            places[3 + r] = x * piece[CAPSULE] + y * piece[CAPSULE + 1] + z * piece[CAPSULE + 2] + origin
            places[6 + r] = x * piece[CAPSULE + 3] + y * piece[CAPSULE + 4] + z * piece[CAPSULE + 5] + origin
    compose(poses[int(scene.base)], scene.body_from_base, 0, placed.base)


@kernel
def move(parent, joint, value, pose):
    """Write the pose of a joint's body: its parent's, the joint's placement, and a motion about or along z."""
    compose(parent, joint, JOINT - POSE, pose)
    if joint[1] != 0.0:
        for r in range(3):
            pose[9 + r] += pose[3 * r + 2] * value
    else:
        s, c = math.sin(value), math.cos(value)
        for r in range(3):
            x, y = pose[3 * r], pose[3 * r + 1]
            pose[3 * r], pose[3 * r + 1] = x * c + y * s, y * c - x * s


@kernel
def compose(first, second, start, product):
    """Write the product of a pose and of the one that `second` has from `start` on."""
    for r in range(3):
        x, y, z = first[3 * r], first[3 * r + 1], first[3 * r + 2]
        for k in range(3):
            product[3 * r + k] = x * second[start + k] + y * second[start + 3 + k] + z * second[start + 6 + k]
        product[9 + r] = x * second[start + 9] + y * second[start + 10] + z * second[start + 11] + first[9 + r]


@inlined  # as a call it would copy both records for every pair, which takes ten times as long as two spheres
def pair_bounds(scene, placed, k, clear, touch):
    """Return (lower, upper) bounds of the distance of pair k [m], less their radii; see `hull_distance`.

    It goes from cheap and coarse to expensive and exact: spheres, capsules, hulls of few points, hulls of all points.
    """
    i, j = int(scene.pairs[k, 0]), int(scene.pairs[k, 1])
    one, other, here, there = scene.pieces[i], scene.pieces[j], placed.places[i], placed.places[j]
    x, y, z = here[0] - there[0], here[1] - there[1], here[2] - there[2]
    gap = math.sqrt(x * x + y * y + z * z) - one[SPHERE + 3] - other[SPHERE + 3]
    if gap > clear:
        return gap, math.inf
    gap = segment_distance(here, there, placed.guess) - one[CAPSULE + 6] - other[CAPSULE + 6]
    if gap > clear:
        return gap, math.inf
    lower, upper = 0.0, 0.0
    for fine in range(2):
        count, radius = (ALL, FINE_RADIUS) if fine else (FEW, RADIUS)
        rounded = one[radius] + other[radius]
        lower, upper = hull_distance(
            scene.vertices, int(one[FIRST]), int(one[count]), placed.poses[int(one[BODY])],
            int(other[FIRST]), int(other[count]), placed.poses[int(other[BODY])],
            clear + rounded, touch + rounded, placed.guess, placed.points, placed.work,
        )  # fmt: skip
        lower, upper = lower - rounded, upper - rounded
        if lower > clear or (one[FEW] == one[ALL] and other[FEW] == other[ALL]):
            break
    return lower, upper


@kernel
def lowest_point(scene, placed, k):
    """Return a lower bound of the height of piece k above the floor [m], negative below it. Write its lowest point
    without the radius to placed.points, and the direction upwards to placed.guess."""
    piece, base = scene.pieces[k], placed.base
    pose = placed.poses[int(piece[BODY])]
    x, y, z = base[2], base[5], base[8]
    a = pose[0] * x + pose[3] * y + pose[6] * z
    b = pose[1] * x + pose[4] * y + pose[7] * z
    c = pose[2] * x + pose[5] * y + pose[8] * z
    vertex = furthest(scene.vertices, int(piece[FIRST]), int(piece[ALL]), -a, -b, -c)
    u, v, w = scene.vertices[0, vertex], scene.vertices[1, vertex], scene.vertices[2, vertex]
    lowest = a * u + b * v + c * w
    placed.guess[0], placed.guess[1], placed.guess[2] = x, y, z
    for r in range(3):
        placed.points[r] = pose[3 * r] * u + pose[3 * r + 1] * v + pose[3 * r + 2] * w + pose[9 + r]
    here = x * (pose[9] - base[9]) + y * (pose[10] - base[10]) + z * (pose[11] - base[11])
    return here + lowest - piece[FINE_RADIUS] - scene.floor


@inlined
def floor_gap(scene, placed, k, clear):
    """Return a lower bound of the height of piece k above the floor [m]: of its capsule if that is above `clear`."""
    places, base, lowest = placed.places[k], placed.base, math.inf
    for end in (3, 6):
        height = 0.0
        for r in range(3):
            height += base[3 * r + 2] * (places[end + r] - base[9 + r])
        lowest = min(lowest, height)
    lowest -= scene.pieces[k, CAPSULE + 6] + scene.floor
    return lowest if lowest > clear else lowest_point(scene, placed, k)


@inlined
def between_bounds(scene, q):
    """Return whether q is where the pairs keep their distances."""
    for i in range(len(q)):
        if not scene.bounds[0, i] <= q[i] <= scene.bounds[1, i]:
            return False
    return True


@kernel
def first_contact(scene, q, margin, placed):
    """Return the index of the first pair that is not provably further apart than `margin` [m] at q; after the pairs
    count the pieces above the floor. -1 if there is none: then nothing touches."""
    place(scene, q, placed)
    kept = between_bounds(scene, q)
    for k in range(len(scene.pairs)):
        if kept and scene.pairs[k, KEPT] > margin:
            break
        lower, _ = pair_bounds(scene, placed, k, margin, margin)
        if not lower > margin:
            return k
    for k in range(len(scene.above)):
        if not floor_gap(scene, placed, int(scene.above[k]), margin) > margin:
            return len(scene.pairs) + k
    return -1


@kernel
def nearest_contact(scene, q, placed):
    """Return (lower bound of the least distance [m], the pair that has it), numbered as in `first_contact`; -1 if
    nothing can touch. If pieces overlap, the distance is minus their radii, not minus the depth."""
    place(scene, q, placed)
    least, nearest, kept = math.inf, -1, between_bounds(scene, q)
    for k in range(len(scene.pairs)):
        if kept and scene.pairs[k, KEPT] > least:
            break
        lower, _ = pair_bounds(scene, placed, k, least, -math.inf)
        if lower < least:
            least, nearest = lower, k
    for k in range(len(scene.above)):
        height = floor_gap(scene, placed, int(scene.above[k]), least)
        if height < least:
            least, nearest = height, len(scene.pairs) + k
    return least, nearest


@compiled
def contacts_of(packed, configurations, margin):
    """Return (N,) int64: `first_contact` of each configuration (N, n)."""
    found = np.empty(len(configurations), np.int64)
    _write_contacts(packed, configurations, margin, np.empty(scene_memory(packed)), found)
    return found


@kernel
def _write_contacts(packed, configurations, margin, memory, found):
    """Write the first contact of each configuration."""
    scene = unpack_scene(packed)
    placed = cut_placed(scene, memory)
    for k in range(len(configurations)):
        found[k] = first_contact(scene, configurations[k], margin, placed)


@compiled
def count_contacts(packed, configurations):
    """Return how often each pair, and then each piece above the floor, is not clear at configurations (N, n)."""
    counts = np.zeros(int(packed[2]) + int(packed[3]), np.int64)
    _count(packed, configurations, np.empty(scene_memory(packed)), counts)
    return counts


@kernel
def _count(packed, configurations, memory, counts):
    """Count the contacts."""
    scene = unpack_scene(packed)
    placed = cut_placed(scene, memory)
    for i in range(len(configurations)):
        place(scene, configurations[i], placed)
        for k in range(len(scene.pairs)):
            lower, _ = pair_bounds(scene, placed, k, 0.0, 0.0)
            counts[k] += not lower > 0.0
        for k in range(len(scene.above)):
            counts[len(scene.pairs) + k] += not floor_gap(scene, placed, int(scene.above[k]), 0.0) > 0.0


@compiled
def clearances_of(packed, configurations):
    """Return (N, 2): `nearest_contact` of each configuration (N, n)."""
    found = np.empty((len(configurations), 2))
    _write_clearances(packed, configurations, np.empty(scene_memory(packed)), found)
    return found


@kernel
def _write_clearances(packed, configurations, memory, found):
    """Write the least distance of each configuration."""
    scene = unpack_scene(packed)
    placed = cut_placed(scene, memory)
    for k in range(len(configurations)):
        found[k, 0], found[k, 1] = nearest_contact(scene, configurations[k], placed)


@compiled
def poses_of(packed, q):
    """Return (m + 1, POSE): where all bodies are at q in the root frame."""
    poses = np.empty((int(packed[0]) + 1, POSE))
    _write_poses(packed, q, np.empty(scene_memory(packed)), poses)
    return poses


@kernel
def _write_poses(packed, q, memory, poses):
    """Write the poses of all bodies."""
    scene = unpack_scene(packed)
    placed = cut_placed(scene, memory)
    place(scene, q, placed)
    for k in range(len(poses)):
        for r in range(POSE):
            poses[k, r] = placed.poses[k, r]
