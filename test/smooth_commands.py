"""What every stream of commands keeps: the limits of position, velocity, acceleration and jerk."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ros_ik_pkg.ros.servo.limiter import MotionLimits

ROUNDING = 1e-9  # of a limit


def assert_within_limits(commands: Sequence[np.ndarray] | np.ndarray, limits: MotionLimits, period: float) -> None:
    """Judge commands (k, n) [rad, m] that are a period [s] apart, from rest, by finite differences."""
    values = np.array([commands[0]] * 3 + list(commands))
    assert np.all((limits.lower <= values) & (values <= limits.upper))
    for limit in (limits.velocity, limits.acceleration, limits.jerk):
        values = np.diff(values, axis=0) / period
        assert np.all(np.abs(values) <= limit * (1.0 + ROUNDING))
