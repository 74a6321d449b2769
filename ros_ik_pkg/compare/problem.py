"""The problem that the methods are compared on: a robot, a seed and a target; by default those of the lecture notes.

The notes give a seed for a Puma 560 and its pose, and leave the target to the reader. The default target keeps that
orientation and moves the tip 27 cm up, through the wrist singularity. All five methods converge: the transpose method
after about a thousand iterations, the pseudoinverse after a detour, the damped methods within about twenty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik import ArgumentError, Arm

NOTES_ROBOT = 'puma560'
NOTES_SEED = (2.8, -77.7, 6.8, 8.5, -19.3, 172.0)  # deg; tip at 0.5 0.15 0.3 m, roll pitch yaw 0 90 0 deg
NOTES_TARGET = (0.4, 0.3, 0.6, 0.0, 90.0, 0.0)  # x y z [m], roll pitch yaw [deg]
GIMBAL_LOCK = 1e-3  # rad from a pitch of 90 degrees; closer, roll and yaw are indistinguishable
DEFAULT_MOVE = 0.25  # of the range from the seed to each joint's further limit, for other robots' targets


@dataclass(frozen=True)
class Problem:
    """An arm, its seed (n,) [rad, m] and a target (4, 4) in its base frame."""

    arm: Arm
    seed: np.ndarray
    target: np.ndarray


def make_problem(arm: Arm, seed: Sequence[float] | None, target: Sequence[float] | None) -> Problem:
    """Return a problem from the arguments (angles in degrees), with defaults from the notes or the arm's home.

    Raises ArgumentError unless the seed has one number per joint and the target has six.
    """
    notes = arm.name == NOTES_ROBOT
    start = arm.home if seed is None else joints_from_degrees(arm, seed)
    if notes and seed is None:
        start = joints_from_degrees(arm, NOTES_SEED)
    if target is not None:
        return Problem(arm, start, pose(target))
    return Problem(arm, start, pose(NOTES_TARGET) if notes else arm.forward(default_goal(arm, start)))


def pose(numbers: Sequence[float]) -> np.ndarray:
    """Return the pose (4, 4) of x y z [m], roll pitch yaw [deg] about fixed axes; raises ArgumentError."""
    if len(numbers) != 6:
        raise ArgumentError(f'target has {len(numbers)} numbers; expected six: x y z [m], roll pitch yaw [deg]')
    rotation = pin.rpy.rpyToMatrix(*np.radians(numbers[3:]))
    return pin.SE3(rotation, np.array(numbers[:3], dtype=float)).homogeneous


def numbers_of(base_from_tip: np.ndarray) -> np.ndarray:
    """Return x y z [m], roll pitch yaw [deg] of a pose (4, 4); roll is 0 in gimbal lock."""
    rpy = pin.rpy.matrixToRpy(np.ascontiguousarray(base_from_tip[:3, :3]))
    if np.cos(rpy[1]) < GIMBAL_LOCK:
        rpy = np.array([0.0, rpy[1], rpy[2] - np.sign(rpy[1]) * rpy[0]])
    return np.concatenate([base_from_tip[:3, 3], np.degrees(rpy)])


def is_rotary(arm: Arm) -> np.ndarray:
    """Return an (n,) mask of the variables that are angles."""
    rotary = np.ones(arm.n, dtype=bool)
    rotary[arm.variable[arm.prismatic > 0]] = False
    return rotary


def joints_from_degrees(arm: Arm, values: Sequence[float]) -> np.ndarray:
    """Return joint positions (n,) [rad, m] from angles in degrees and lengths in metres."""
    if len(values) != arm.n:
        raise ArgumentError(f'seed has {len(values)} numbers; expected {arm.n}: {", ".join(arm.joint_names)}')
    return np.where(is_rotary(arm), np.radians(values), values)


def as_typed(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Return joint positions (n,) [deg, m], as the command line takes them."""
    return np.where(is_rotary(arm), np.degrees(q), q)


def default_goal(arm: Arm, seed: np.ndarray) -> np.ndarray:
    """Return a configuration (n,) with every joint moved towards its further limit."""
    lower, upper = np.maximum(arm.lower, seed - np.pi), np.minimum(arm.upper, seed + np.pi)
    return seed + DEFAULT_MOVE * np.where(upper - seed > seed - lower, upper - seed, lower - seed)
