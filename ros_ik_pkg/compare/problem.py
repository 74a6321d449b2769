"""What the methods are compared on: a robot, a seed and a target; by default those of the lecture notes.

The notes give the seed of a Puma 560 and the pose that it holds. Their target is whatever the reader sets; the one
here keeps that orientation and moves the tip 27 cm up, across the wrist's singularity: all five methods arrive, the
transpose after a thousand iterations, the pseudoinverse by a detour, the damped ones within twenty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik import ArgumentError, Arm

NOTES_ROBOT = 'puma560'
NOTES_SEED = (2.8, -77.7, 6.8, 8.5, -19.3, 172.0)  # deg; the tip at 0.5 0.15 0.3 m, turned by 0 90 0 deg
NOTES_TARGET = (0.4, 0.3, 0.6, 0.0, 90.0, 0.0)  # x y z [m], roll pitch yaw [deg]
GIMBAL_LOCK = 1e-3  # rad from a pitch of 90 degrees; nearer, roll and yaw cannot be told apart
SPREAD = 0.25  # of the way from the seed to each joint's nearer limit, for the target of another robot


@dataclass(frozen=True)
class Problem:
    """An arm, its seed (n,) [rad, m] and a target (4, 4) in its base frame."""

    arm: Arm
    seed: np.ndarray
    target: np.ndarray


def make_problem(arm: Arm, seed: Sequence[float] | None, target: Sequence[float] | None) -> Problem:
    """Return the problem with what is given (angles in degrees), the rest from the notes or the arm's home.

    Raises ArgumentError where the seed has not one number for each joint, or the target not six.
    """
    notes = arm.name == NOTES_ROBOT
    start = arm.home if seed is None else joints_from_degrees(arm, seed)
    if notes and seed is None:
        start = joints_from_degrees(arm, NOTES_SEED)
    if target is not None:
        return Problem(arm, start, pose(target))
    return Problem(arm, start, pose(NOTES_TARGET) if notes else arm.forward(elsewhere(arm, start)))


def pose(numbers: Sequence[float]) -> np.ndarray:
    """Return the pose (4, 4) of x y z [m], roll pitch yaw [deg] about fixed axes."""
    if len(numbers) != 6:
        raise ArgumentError(f'target has {len(numbers)} numbers; expected six: x y z [m], roll pitch yaw [deg]')
    rotation = pin.rpy.rpyToMatrix(*np.radians(numbers[3:]))
    return pin.SE3(rotation, np.array(numbers[:3], dtype=float)).homogeneous


def numbers_of(base_from_tip: np.ndarray) -> np.ndarray:
    """Return x y z [m], roll pitch yaw [deg] of a pose (4, 4); roll is 0 where yaw could take its place."""
    rpy = pin.rpy.matrixToRpy(np.ascontiguousarray(base_from_tip[:3, :3]))
    if np.cos(rpy[1]) < GIMBAL_LOCK:
        rpy = np.array([0.0, rpy[1], rpy[2] - np.sign(rpy[1]) * rpy[0]])
    return np.concatenate([base_from_tip[:3, 3], np.degrees(rpy)])


def is_rotary(arm: Arm) -> np.ndarray:
    """Return (n,) bool: which variables are angles."""
    rotary = np.ones(arm.n, dtype=bool)
    rotary[arm.variable[arm.prismatic > 0]] = False
    return rotary


def joints_from_degrees(arm: Arm, values: Sequence[float]) -> np.ndarray:
    """Return joint positions (n,) [rad, m] of angles in degrees and lengths in metres."""
    if len(values) != arm.n:
        raise ArgumentError(f'seed has {len(values)} numbers; expected {arm.n}: {", ".join(arm.joint_names)}')
    return np.where(is_rotary(arm), np.radians(values), values)


def as_typed(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Return joint positions (n,) [rad, m] with angles in degrees, as people type them."""
    return np.where(is_rotary(arm), np.degrees(q), q)


def elsewhere(arm: Arm, seed: np.ndarray) -> np.ndarray:
    """Return a configuration some way off, every joint moved towards the limit that is further away."""
    lower, upper = np.maximum(arm.lower, seed - np.pi), np.minimum(arm.upper, seed + np.pi)
    return seed + SPREAD * np.where(upper - seed > seed - lower, upper - seed, lower - seed)
