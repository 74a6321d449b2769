"""A move to one goal on a straight line in joint space: all joints leave and arrive together."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ros.servo.limiter import JerkLimiter, Motion, MotionLimits

TOP_SPEED = 0.95  # of the velocity limits: the rest is for catching up
GENTLE = 0.75  # of acceleration and jerk: targets that need more are not followed exactly
STILL = 1e-9  # rad, m: a joint with a shorter move does not move


class StraightMove:
    """Moves from rest at `start` (n,) to rest at `goal` (n,) [rad, m], as fast as the limits of all joints allow."""

    def __init__(self, start: np.ndarray, goal: np.ndarray, limits: MotionLimits, period: float) -> None:
        self._start, self._way, self._period = start, goal - start, period
        way = np.abs(self._way)
        moving = way > STILL
        most = [
            share * float(np.min(limit[moving] / way[moving])) if moving.any() else 1.0
            for share, limit in ((TOP_SPEED, limits.velocity), (GENTLE, limits.acceleration), (GENTLE, limits.jerk))
        ]
        whole = np.array([[-np.inf], [np.inf], *([limit] for limit in most)])
        self._share, self._all = JerkLimiter(MotionLimits(*whole), period, np.zeros(1)), Motion.rest(np.ones(1))

    def step(self) -> Motion:
        """Return the motion of the joints over the coming period."""
        now = self._share.motion
        self._share.advance(self._all)
        jerk = (self._share.acceleration - now.acceleration) / self._period
        return Motion(
            self._start + now.position * self._way, now.velocity * self._way, now.acceleration * self._way,
            jerk * self._way,
        )  # fmt: skip
