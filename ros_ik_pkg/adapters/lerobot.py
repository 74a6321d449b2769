"""Kinematics for LeRobot: the class that its processors call, with this solver behind it; neither placo nor torch."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from ros_ik_pkg.ik import ArgumentError, ModelError, SolveOptions, load_arm, solve

# Weight of the orientation that leaves the position exact to micrometres; the last descent removes what is left.
SLIGHT = 1e-3
# One descent, from where the arm is, so that the answer never leaps to another branch. It always ends, so it needs no
# deadline. LeRobot's arms rest folded, with their links in contact.
LOCAL = SolveOptions(max_attempts=1, max_iterations=400, deadline=0.0, avoid_collisions=False)


class RobotKinematics:
    """Forward and inverse kinematics by the interface of `lerobot.model.kinematics.RobotKinematics`.

    Parameters
    ----------
    urdf_path : str or path
        The robot, or whatever else `load_arm` takes. Poses are those of its root link.
    target_frame_name : str
        Link whose pose is meant.
    joint_names : sequence of str, optional
        The motors, in their order; those that do not move the target frame, such as a gripper, keep their
        positions. Default: all joints that move, in the order of Pinocchio.

    Raises
    ------
    ModelError
        If the robot cannot be read, or a joint that moves the target frame slides or is not among joint_names.

    """

    def __init__(
        self,
        urdf_path: str | os.PathLike[str],
        target_frame_name: str = 'gripper_frame_link',
        joint_names: Sequence[str] | None = None,
    ) -> None:
        self.arm = load_arm(urdf_path, tip=target_frame_name)
        self.target_frame_name = target_frame_name
        self.joint_names = list(self.arm.model.names)[1:] if joint_names is None else list(joint_names)
        missing = [name for name in self.arm.joint_names if name not in self.joint_names]
        if missing:
            raise ModelError(f'joint_names lacks {", ".join(missing)}, which moves {target_frame_name}')
        self._order = [self.joint_names.index(name) for name in self.arm.joint_names]
        if self.arm.prismatic.any():
            raise ModelError(f'a joint that moves {target_frame_name} slides; LeRobot gives positions in degrees')

    def forward_kinematics(self, joint_pos_deg: ArrayLike) -> np.ndarray:
        """Return the pose (4, 4) [m] of the target frame in the root link.

        joint_pos_deg: positions of the motors [deg]; more than joint_names may follow.
        """
        return self.arm.forward(self._chain(joint_pos_deg))

    def inverse_kinematics(
        self,
        current_joint_pos: ArrayLike,
        desired_ee_pose: ArrayLike,
        position_weight: float = 1.0,
        orientation_weight: float = 0.01,
    ) -> np.ndarray:
        """Return the positions of the motors [deg] nearest to a pose, from where they are and within their limits.

        If the position has the greater weight, it comes first: it is exact if the arm reaches it, and the orientation
        is as near as the joints allow. Otherwise the weighted sum of the squared errors is least. A weight of 0 leaves
        its part out. Entries beyond joint_names, and motors that do not move the target frame, are returned as given.

        current_joint_pos: positions of the motors [deg].
        desired_ee_pose: (4, 4), the target frame in the root link [m].

        Raises ArgumentError if one of them is not finite, the pose is none, or no weight is above 0.
        """
        weights = np.array([position_weight, orientation_weight], dtype=float)
        if not (np.isfinite(weights).all() and weights.min() >= 0.0 < weights.max()):
            raise ArgumentError(f'weights {weights.tolist()}: expected numbers from 0, one of them above 0')
        seed = self._chain(current_joint_pos)
        if position_weight > orientation_weight:
            q = self._nearest(desired_ee_pose, seed, 1.0, SLIGHT if orientation_weight else 0.0)
            if orientation_weight:
                q = self._nearest(desired_ee_pose, q, 1.0, 0.0)
        else:
            ratio = np.sqrt(position_weight / orientation_weight)  # the solver squares weight times error
            q = self._nearest(desired_ee_pose, seed, ratio, 1.0)
        motors = np.array(current_joint_pos, dtype=float)
        motors[self._order] = np.rad2deg(q)
        return motors

    def _nearest(self, pose: ArrayLike, seed: np.ndarray, position: float, orientation: float) -> np.ndarray:
        """Return the joint positions [rad] at a pose, else those of the closest approach from the seed."""
        return solve(self.arm, pose, seed, _options(position, orientation)).q

    def _chain(self, motors: ArrayLike) -> np.ndarray:
        """Return the positions [rad] of the arm's joints from those of the motors."""
        values = np.asarray(motors, dtype=float)
        if values.ndim != 1 or len(values) < len(self.joint_names):
            raise ArgumentError(f'{len(self.joint_names)} positions expected, one for each of {self.joint_names}; '
                                f'got an array of shape {values.shape}')  # fmt: skip
        return np.deg2rad(values[self._order])


@cache
def _options(position: float, orientation: float) -> SolveOptions:
    """Return the options for these weights; making them takes longer than a solve."""
    return replace(LOCAL, task_weights=(position,) * 3 + (orientation,) * 3)
