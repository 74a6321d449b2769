"""The error and the Jacobian in solve_usual, whose tasks are whole poses."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import variant_of
from ros_ik_pkg.ik.kernel.data_layout import UsualWorkspace
from ros_ik_pkg.ik.kinematics.forward import fill_columns
from ros_ik_pkg.ik.kinematics.task import look_around, measure_rows


@variant_of(measure_rows, UsualWorkspace)
def measure_no_rows(task, work):
    """Return NaN: no task with weights or tolerances of single rows comes here."""
    return math.nan, math.nan, math.nan


@variant_of(look_around, UsualWorkspace)
def look_around_pose(geometry, task, R, p, work):
    """Implement `look_around` for a whole pose."""
    fill_columns(geometry, work.joints.axes, p, work.columns)
