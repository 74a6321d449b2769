"""The independent judge: forward kinematics of Pinocchio on the arm's model, many configurations at once."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik import Arm

ROUNDING = 1e-9  # m, rad: how far two correct forward kinematics may differ
SINGLE_PRECISION = 1e-6  # m, rad: some libraries keep their limits in single precision


class Judge:
    """Pinocchio's reading of one arm."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.model = arm.model
        self.data = self.model.createData()
        joints = [joint for joint in arm.tree.path(arm.base_frame, arm.tip_frame) if joint.kind != 'fixed']
        self.index = [self.model.joints[self.model.getJointId(joint.name)].idx_q for joint in joints]
        self.base, self.tip = (self.model.getFrameId(name) for name in (arm.base_frame, arm.tip_frame))

    def forward(self, q: np.ndarray) -> np.ndarray:
        """Return (N, 4, 4) poses of the tip in the base frame for q (N, n) [rad, m]."""
        arm, frames = self.arm, self.data.oMf
        values = np.zeros((len(q), self.model.nq))
        values[:, self.index] = arm.multiplier * q[:, arm.variable] + arm.offset
        poses = np.empty((len(q), 4, 4))
        for pose, row in zip(poses, values):
            pin.forwardKinematics(self.model, self.data, row)
            pin.updateFramePlacement(self.model, self.data, self.base)
            pin.updateFramePlacement(self.model, self.data, self.tip)
            pose[:] = frames[self.base].actInv(frames[self.tip]).homogeneous
        return poses

    def errors(self, targets: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the twist error's halves, (N, 3) [m] and (N, 3) [rad] in base axes; NaN where q is NaN."""
        known = np.isfinite(q).all(axis=1)
        reached = self.forward(np.where(known[:, None], q, 0.0))
        position = targets[:, :3, 3] - reached[:, :3, 3]
        orientation = rotation_vectors(targets[:, :3, :3] @ reached[:, :3, :3].transpose(0, 2, 1))
        position[~known] = orientation[~known] = np.nan
        return position, orientation

    def inside(self, q: np.ndarray, slack: float = SINGLE_PRECISION) -> np.ndarray:
        """Return (N,) whether q (N, n) is within the joint limits."""
        return ((q >= self.arm.lower - slack) & (q <= self.arm.upper + slack)).all(axis=1)

    def solved(self, targets: np.ndarray, q: np.ndarray, tolerance: float = 1e-5) -> np.ndarray:
        """Return (N,) whether q (N, n) is within the limits, and within the tolerance [m, rad] of the targets."""
        position, orientation = (np.linalg.norm(error, axis=1) for error in self.errors(targets, q))
        close = np.maximum(position, orientation) <= tolerance + ROUNDING
        return close & self.inside(q)

    def jacobians(self, q: np.ndarray) -> np.ndarray:
        """Return (N, 6, n) Jacobians of the tip for q (N, n): rows [v; w], axes of the base parallel to the world's."""
        arm, values = self.arm, np.zeros(self.model.nq)
        out = np.zeros((len(q), 6, arm.n))
        for row, jacobian in zip(q, out):
            values[self.index] = arm.multiplier * row[arm.variable] + arm.offset
            full = pin.computeFrameJacobian(self.model, self.data, values, self.tip, pin.LOCAL_WORLD_ALIGNED)
            for joint, column in enumerate(self.index):
                jacobian[:, arm.variable[joint]] += arm.multiplier[joint] * full[:, column]
        return out


def rotation_vectors(R: np.ndarray) -> np.ndarray:
    """Return log(R), (N, 3) [rad], of rotations (N, 3, 3)."""
    return np.array([pin.log3(rotation) for rotation in R]).reshape(-1, 3)
