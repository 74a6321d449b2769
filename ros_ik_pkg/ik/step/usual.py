"""The step in solve_usual, which knows the default method alone."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import variant_of
from ros_ik_pkg.ik.kernel.data_layout import UsualWorkspace
from ros_ik_pkg.ik.step.methods import damped_step, take_step


@variant_of(take_step, UsualWorkspace)
def take_usual_step(tuning, error_norm, work):
    """Implement `take_step` for adaptive_dls with some damping."""
    damping = max(tuning.adaptive_dls_damping, tuning.adaptive_dls_gain * error_norm)
    if not damped_step(damping, work):
        work.dq[:] = math.nan
        return math.nan
    return damping
