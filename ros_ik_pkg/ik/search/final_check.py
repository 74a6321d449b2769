"""The final check of a solution, independent of the loop that found it: joint limits, and the pose of the tip."""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import compiled, kernel
from ros_ik_pkg.ik.kernel.data_layout import TUNABLES, joints_size, make_joints, tuning_of, unpack_model
from ros_ik_pkg.ik.kinematics.forward import walk

ROUNDING = 1e-13  # m, rad: two ways to compute one error differ by this much at most


@compiled
def passes(model, numbers, target, q):
    """Return whether q (n,) keeps the limits, if they are respected, and brings the tip to the pose `target` (4, 4).

    `model` is a packed arm, `numbers` those of SolveOptions. For a task with weights or tolerances of single rows the
    result is always False: such a solution needs the detailed check.
    """
    return _passes(model, numbers, target, q, np.empty(joints_size(model)))


@kernel
def _passes(model, numbers, target, q, memory):
    """Implement `passes`; ||R* - R|| = sqrt(8) sin(angle / 2)."""
    geometry, _, _ = unpack_model(model)
    tuning = tuning_of(numbers)
    for r in range(6):
        if numbers[TUNABLES + r] != 1.0 or numbers[TUNABLES + 6 + r] != 0.0:
            return False
    for i in range(len(q)):
        if not (-math.inf < q[i] < math.inf):
            return False
        if tuning.respect_limits > 0.0 and not (geometry.lower[i] <= q[i] <= geometry.upper[i]):
            return False
    R, p = walk(geometry, q, make_joints(model, memory))
    away, turned = 0.0, 0.0
    for i in range(3):
        away += (target[i, 3] - p[i]) ** 2
        for j in range(3):
            turned += (target[i, j] - R[3 * i + j]) ** 2
    angle = min(tuning.orientation_tolerance + ROUNDING, math.pi)
    near = math.sqrt(away) <= tuning.position_tolerance + ROUNDING
    return near and math.sqrt(turned) <= math.sqrt(8.0) * math.sin(0.5 * angle) + ROUNDING
