"""The independent judge: forward kinematics of Pinocchio, many configurations at once."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik import Arm

ROUNDING = 1e-9  # m, rad: how far two correct forward kinematics may differ
SINGLE_PRECISION = 1e-6  # m, rad: some libraries keep their limits in single precision
HALF_TURN_SINE = 1e-3  # below this sine, with a negative cosine, the angle is from Pinocchio's logarithm


class Judge:
    """Pinocchio's kinematics of one arm, from our model or from a URDF that Pinocchio parsed."""

    def __init__(self, arm: Arm, model: pin.Model | None = None) -> None:
        self.arm = arm
        self.model = model or arm.model
        self.data = self.model.createData()
        chain = [joint for joint in arm.tree.path(arm.base_frame, arm.tip_frame) if joint.kind != 'fixed']
        self.joints = [self.model.joints[self.model.getJointId(joint.name)] for joint in chain]
        self.base, self.tip = (self.model.getFrameId(name, pin.BODY) for name in (arm.base_frame, arm.tip_frame))

    def configurations(self, q: np.ndarray) -> np.ndarray:
        """Return Pinocchio configurations (N, nq) for q (N, n), with continuous joints as cosine and sine."""
        values = np.tile(pin.neutral(self.model), (len(q), 1))
        moved = self.arm.multiplier * q[:, self.arm.variable] + self.arm.offset
        for joint, value in zip(self.joints, moved.T):
            whole = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
            values[:, joint.idx_q : joint.idx_q + joint.nq] = np.transpose(whole)
        return values

    def forward(self, q: np.ndarray) -> np.ndarray:
        """Return (N, 4, 4) poses of the tip in the base frame for q (N, n) [rad, m]."""
        poses, frames = np.empty((len(q), 4, 4)), self.data.oMf
        for pose, row in zip(poses, self.configurations(q)):
            pin.forwardKinematics(self.model, self.data, row)
            pin.updateFramePlacement(self.model, self.data, self.base)
            pin.updateFramePlacement(self.model, self.data, self.tip)
            pose[:] = frames[self.base].actInv(frames[self.tip]).homogeneous
        return poses

    def errors(self, targets: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return position (N, 3) [m] and orientation errors (N, 3) [rad] in base axes; NaN if q is NaN."""
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

    def smallest_singular_values(self, q: np.ndarray) -> np.ndarray:
        """Return (N,) the smallest singular value of the Jacobian at q (N, n)."""
        arm, out = self.arm, np.zeros((len(q), 6, self.arm.n))
        for row, jacobian in zip(self.configurations(q), out):
            whole = pin.computeFrameJacobian(self.model, self.data, row, self.tip, pin.LOCAL_WORLD_ALIGNED)
            for joint, variable, multiplier in zip(self.joints, arm.variable, arm.multiplier):
                jacobian[:, variable] += multiplier * whole[:, joint.idx_v]
        return np.linalg.svd(out, compute_uv=False)[:, -1]


def rotation_vectors(R: np.ndarray) -> np.ndarray:
    """Return log(R), (N, 3) [rad], of rotations (N, 3, 3)."""
    sines = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1) / 2
    sine, cosine = np.linalg.norm(sines, axis=1), (np.trace(R, axis1=1, axis2=2) - 1) / 2
    angle = np.arctan2(sine, cosine)
    vectors = sines * np.divide(angle, sine, out=np.ones_like(angle), where=sine > 0)[:, None]
    for k in np.flatnonzero((sine < HALF_TURN_SINE) & (cosine < 0)):
        vectors[k] = pin.log3(R[k])
    return vectors
