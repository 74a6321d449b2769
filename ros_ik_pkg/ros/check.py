"""The last look at an answer before it goes out to motors, apart from the solver: FK, tolerance, limits."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik import Arm, SolveOptions

ROUNDING = 1e-13  # m, rad: two ways to compute one error differ by this much at most


def fault_of(q: np.ndarray, target: np.ndarray, arm: Arm, options: SolveOptions) -> str:
    """Say why q (n,) must not be published for the target (4, 4) in the base frame; empty where it may."""
    if not np.isfinite(q).all():
        return 'it is not finite'
    outside = (q < arm.lower) | (q > arm.upper)
    if options.respect_limits and outside.any():
        return f'{", ".join(np.array(arm.joint_names)[outside])} outside the limits'
    position_error, orientation_error = _errors(arm.forward(q), target, np.array(options.task_weights))
    if not position_error <= options.position_tolerance + ROUNDING:
        return f'the tip is {position_error:.3g} m off'
    if not orientation_error <= options.orientation_tolerance + ROUNDING:
        return f'the tip is turned {orientation_error:.3g} rad off'
    return ''


def _errors(base_from_tip: np.ndarray, target: np.ndarray, weights: np.ndarray) -> tuple[float, float]:
    """Return distance [m] and angle [rad] in the rows of the task, those with a weight above 0."""
    position = (target - base_from_tip)[:3, 3]
    orientation = pin.log3(np.ascontiguousarray(target[:3, :3] @ base_from_tip[:3, :3].T))
    in_task = weights > 0.0
    return float(np.linalg.norm(position[in_task[:3]])), float(np.linalg.norm(orientation[in_task[3:]]))
