"""A critically damped change of a velocity, as quick as the limits of the joints allow."""

from __future__ import annotations

import math

import numpy as np

from ros_ik_pkg.ros.servo.limiter import MotionLimits

QUICKEST = 0.5  # of a period: the least time constant of a change
PEAK = 1.0 / math.e  # of rate * change: the greatest acceleration of a critically damped change


def fade(
    velocity: np.ndarray, change: np.ndarray, joints: np.ndarray, limits: MotionLimits, period: float, share: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return a velocity (k,) and its rate (k,) a period [s] later, on the way to nothing.

    joints: (n,) what it is for the joints [rad/s, m/s], all above 0. share: of their acceleration and jerk to use.
    All components change alike, so a direction is kept.
    """
    with np.errstate(divide='ignore'):
        rate = min(
            QUICKEST / period,
            math.sqrt(share * float(np.min(limits.jerk / joints))),
            share * float(np.min(limits.acceleration / joints)) / PEAK,
        )
    decay, slope = math.exp(-rate * period), change + rate * velocity
    left = (velocity + slope * period) * decay
    return left, slope * decay - rate * left
