"""A smooth motion towards goals that arrive at irregular times; the limiter follows it."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ros.servo.limiter import Motion

STEPS = 2.0  # smallest number of periods in a time constant; with fewer the discrete filter oscillates


class Reference:
    """Follows goals, critically damped in the third order: no lag behind a constant velocity, no overshoot of a step.

    Noise in the goals [rad, m] causes a jerk of at most noise / time_constant^3.
    """

    def __init__(self, start: Motion, period: float, time_constant: float) -> None:
        self.motion, self._period = start, period
        self._rate = 1.0 / max(time_constant, STEPS * period)

    def follow(self, position: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray | float = 0.0) -> Motion:
        """Return the motion over the coming period towards a goal, given by its present position and velocity (n,).

        With the acceleration (n,) of the goal there is no lag behind a constant acceleration either.
        """
        now, rate = self.motion, self._rate
        behind, slower = position - now.position, velocity - now.velocity
        jerk = rate * (rate * (rate * behind + 3.0 * slower) + 3.0 * (acceleration - now.acceleration))
        moving = now._replace(jerk=jerk)
        self.motion = moving.after(self._period)
        return moving
