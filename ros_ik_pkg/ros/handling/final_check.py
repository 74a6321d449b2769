"""The final check of a solution before it is published, independent of the solver: FK, tolerance, limits.

One compiled call passes good solutions of complete poses; everything else is checked in detail.
"""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik import Arm, Contact, SolveOptions
from ros_ik_pkg.ik.contacts.contacts import Room
from ros_ik_pkg.ik.options import demanded_alone
from ros_ik_pkg.ik.search.final_check import ROUNDING, passes

MOTION_STEP = 0.02  # rad or m of the joint that moves most, between two configurations that are checked


def fault_of(q: np.ndarray, target: np.ndarray, arm: Arm, options: SolveOptions) -> str:
    """Return why q (n,) must not be published for the target (4, 4) in the base frame; empty if it may."""
    if passes(arm.packed, options.numbers, target, q):
        return ''
    if fault := fault_of_command(q, arm, options):
        return fault
    demanded = demanded_alone(options) if arm.n < options.wishes_below else options
    return fault_of_pose(arm.forward(q), target, demanded)


def fault_of_pose(base_from_tip: np.ndarray, target: np.ndarray, options: SolveOptions) -> str:
    """Return in words how far the tip (4, 4) is off its target (4, 4) in the same frame; empty if within tolerance."""
    position_error, orientation_error = errors_between(base_from_tip, target, options)
    if not position_error <= options.position_tolerance + ROUNDING:
        return f'the tip is {position_error:.3g} m off'
    if not orientation_error <= options.orientation_tolerance + ROUNDING:
        return f'the tip is turned {orientation_error:.3g} rad off'
    return ''


def fault_of_command(q: np.ndarray, arm: Arm, options: SolveOptions) -> str:
    """Return why q (n,) must not be published for any target: not finite, or outside the limits; else empty."""
    positions = q.tolist()
    if not all(map(math.isfinite, positions)):
        return 'it is not finite'
    if not options.respect_limits:
        return ''
    limits = zip(arm.joint_names, arm.lower.tolist(), positions, arm.upper.tolist())
    outside = [name for name, lower, position, upper in limits if not lower <= position <= upper]
    return f'{", ".join(outside)} outside the limits' if outside else ''


def contact_of(
    q: np.ndarray, start: np.ndarray | None, room: Room | None, options: SolveOptions, whole_motion: bool = False
) -> str:
    """Return in words what touches at q (n,), or with `whole_motion` on the straight line in joint space from `start`
    to q; empty if nothing does. Computed by coal, which shares no code with the search.

    An arm that touches something at `start` may move to where the contact is less deep.
    """
    if room is None:
        return ''
    meshes, margin = options.collision_geometry == 'mesh', options.collision_margin
    steps = [q]
    if whole_motion and start is not None:
        count = max(1, math.ceil(float(np.abs(q - start).max()) / MOTION_STEP))
        steps = [start + (k / count) * (q - start) for k in range(1, count)] + [q]
    for step in steps:
        if room.is_clear(step, margin, meshes):
            continue
        contact = room.look(step, meshes)
        if start is not None and room.look(start, meshes).clearance < min(contact.clearance, margin):
            continue
        where = '' if step is q else ' on the way there'
        return f'{" and ".join(contact.links)} {describe(contact)}{where}'
    return ''


def describe(contact: Contact) -> str:
    """Return a sentence about the distance of two bodies."""
    depth = contact.clearance
    return f'are {1e3 * depth:.3g} mm apart' if depth > 0.0 else f'touch, {-1e3 * depth:.3g} mm deep'


def errors_of(q: np.ndarray, target: np.ndarray, arm: Arm, options: SolveOptions) -> tuple[float, float]:
    """Return distance [m] and angle [rad] of the tip at q (n,) in the rows of the task, beyond their tolerances."""
    return errors_between(arm.forward(q), target, options)


def errors_between(base_from_tip: np.ndarray, target: np.ndarray, options: SolveOptions) -> tuple[float, float]:
    """Return the same for the tip at a pose (4, 4)."""
    position = (target - base_from_tip)[:3, 3]
    orientation = _rotation_vector(target[:3, :3] @ base_from_tip[:3, :3].T)
    task_from_base = target[:3, :3].T if options.task_frame == 'tip' else np.eye(3)
    errors = np.hstack([task_from_base @ position, task_from_base @ orientation])
    beyond = np.maximum(np.abs(errors) - options.task_tolerances, 0.0) * (np.array(options.task_weights) > 0.0)
    return float(np.linalg.norm(beyond[:3])), float(np.linalg.norm(beyond[3:]))


def _rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """Return the logarithm (3,) of a rotation [rad], accurate near half a turn, where pinocchio.log3 loses digits: the
    error about a free axis may be that large."""
    # pinocchio.Quaternion(matrix) would leak 80 bytes at every call.
    x, y, z, w = pin.SE3ToXYZQUAT(pin.SE3(rotation, np.zeros(3)))[3:]
    vector = np.copysign(1.0, w) * np.array([x, y, z])
    sine = np.linalg.norm(vector)
    return vector * (2.0 * np.arctan2(sine, abs(w)) / sine) if sine > 0.0 else vector
