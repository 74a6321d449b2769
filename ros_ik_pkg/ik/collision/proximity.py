"""The cost of being near to contact, which self-motion reduces, with its gradient and curvature.

Each pair that is nearer than INFLUENCE adds half the square of INFLUENCE less its distance (the distance of influence
is from Khatib 1986). The gradient of a distance is the velocity of the two nearest points along the line between
them; the curvature neglects the rotation of that line (Gauss-Newton).
"""

from __future__ import annotations

import math

from ros_ik_pkg.ik.collision.convex_distance import CLOSE_ENOUGH
from ros_ik_pkg.ik.collision.scene import (
    BODY,
    CAPSULE,
    FINE_RADIUS,
    cut_placed,
    floor_gap,
    lowest_point,
    pair_bounds,
    place,
    unpack_scene,
)
from ros_ik_pkg.ik.kernel.compiled import kernel

INFLUENCE = 0.1  # [m]


@kernel
def proximity(obstruction, q, direction, descent):
    """Return (cost [m^2], its curvature along `direction` (n,) [m^2]) at q, and write its negative gradient to
    `descent` (n,). If `direction` has length 0 the curvature is 0; if `descent` has, no gradient is written."""
    descent[:] = 0.0
    cost, curvature = 0.0, 0.0
    if len(obstruction.scene) == 0:
        return cost, curvature
    scene = unpack_scene(obstruction.scene)
    placed = cut_placed(scene, obstruction.memory)
    place(scene, q, placed)
    for k in range(len(scene.pairs)):
        distance, _ = pair_bounds(scene, placed, k, INFLUENCE, -math.inf)
        if distance < INFLUENCE:
            i, j = int(scene.pairs[k, 0]), int(scene.pairs[k, 1])
            distance = look_along(scene, placed, i, j, distance)
            missing = INFLUENCE - distance
            slope = follow(scene, placed, int(scene.pieces[i, BODY]), 0, missing, direction, descent)
            slope += follow(scene, placed, int(scene.pieces[j, BODY]), 3, -missing, direction, descent)
            cost += 0.5 * missing * missing
            curvature += slope * slope
    for k in range(len(scene.above)):
        i = int(scene.above[k])
        height = floor_gap(scene, placed, i, INFLUENCE)
        if height < INFLUENCE:
            missing = INFLUENCE - height
            lowest_point(scene, placed, i)
            slope = follow(scene, placed, int(scene.pieces[i, BODY]), 0, missing, direction, descent)
            slope += follow(scene, placed, int(scene.base), 0, -missing, direction, descent)
            cost += 0.5 * missing * missing
            curvature += slope * slope
    return cost, curvature


@kernel
def look_along(scene, placed, i, j, distance):
    """Return the distance of two pieces [m], and write the unit vector from the second to the first to placed.guess.

    If the hulls overlap they have no nearest points; then the direction is that between the axes of their capsules,
    and the points are the middles of the capsules.
    """
    points, guess = placed.points, placed.guess
    apart = distance + scene.pieces[i, FINE_RADIUS] + scene.pieces[j, FINE_RADIUS]
    length = 0.0
    if apart > CLOSE_ENOUGH:
        for r in range(3):
            guess[r] = points[r] - points[3 + r]
    else:
        for r in range(3):
            points[r] = 0.5 * (placed.places[i, 3 + r] + placed.places[i, 6 + r])
            points[3 + r] = 0.5 * (placed.places[j, 3 + r] + placed.places[j, 6 + r])
    for r in range(3):
        length += guess[r] * guess[r]
    length = math.sqrt(length)
    for r in range(3):
        guess[r] /= length
    if apart > CLOSE_ENOUGH:
        return distance
    return min(distance, length - scene.pieces[i, CAPSULE + 6] - scene.pieces[j, CAPSULE + 6])


@kernel
def follow(scene, placed, body, start, weight, direction, descent):
    """Return the velocity of a point of a body along placed.guess as q moves along `direction` [m], with the sign of
    `weight`; add `weight` times its gradient by q to `descent`. The point begins at `start` in placed.points."""
    nx, ny, nz = placed.guess
    px, py, pz = placed.points[start], placed.points[start + 1], placed.points[start + 2]
    slope = 0.0
    while body > 0:
        joint, pose = scene.joints[body - 1], placed.poses[body]
        i = int(joint[2])
        if i >= 0:
            x, y, z = pose[2], pose[5], pose[8]
            if joint[1] != 0.0:
                speed = x * nx + y * ny + z * nz
            else:
                u, v, w = px - pose[9], py - pose[10], pz - pose[11]
                speed = (y * w - z * v) * nx + (z * u - x * w) * ny + (x * v - y * u) * nz
            speed *= joint[3]
            if len(direction) > 0:
                slope += speed * direction[i]
            if len(descent) > 0:
                descent[i] += weight * speed
        body = int(joint[0])
    return slope if weight > 0.0 else -slope
