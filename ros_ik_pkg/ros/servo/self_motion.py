"""Self-motion under a twist: the joints that the task leaves over go to where `null_space` wants them, smoothly."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ros_ik_pkg.ik import Arm, NotCompiledError, SolveOptions, World, solve
from ros_ik_pkg.ros.servo.damped import fade
from ros_ik_pkg.ros.servo.limiter import MotionLimits

FURTHEST = 0.1  # rad, m: how far ahead the objective looks, which is where the joints could stop
LOOK_PERIOD = 0.01  # s between two looks
TOP_SPEED = 0.3  # of the velocity limits
SHARE = 0.2  # of acceleration and jerk; the rest is for the twist
SLOWEST = 1e-6  # rad/s, m/s: a motion that ends has ended
NO_WAY = 1e-12  # rad, m


class SelfMotion:
    """The velocity `velocity` (n,) [rad/s, m/s] at which the joints change their posture and the tip stays."""

    def __init__(self, arm: Arm, limits: MotionLimits, options: SolveOptions, period: float) -> None:
        """options: those of a solve of one attempt for the pose of the tip; their null_space says what is wanted."""
        self._arm, self._limits, self._period = arm, limits, period
        self._options = replace(options, null_space_step=FURTHEST)
        rows = np.count_nonzero(options.task_weights)
        self._active = options.null_space != 'none' and arm.n > rows
        self._steps = max(round(LOOK_PERIOD / period), 1)
        self.rest()

    def rest(self) -> None:
        """Stand still."""
        self.velocity, self._change, self._way = np.zeros((3, self._arm.n))
        self._due = 0  # periods until the next look

    def step(
        self, q: np.ndarray, base_from_tip: np.ndarray, twisted: np.ndarray, wanted: bool, world: World | None
    ) -> np.ndarray:
        """Return how far (n,) [rad, m] the joints at q (n,) go in the coming period, with the tip at a pose (4, 4).

        twisted: (n,) [rad/s, m/s] what the twist makes the joints do. wanted: whether they are to go, not to stop.
        """
        if not self._active or not (wanted or self.velocity.any()):
            return self.velocity
        self._due -= 1
        if wanted and self._due <= 0:
            self._way, self._due = self._look(q, base_from_tip, world), self._steps
        goal = self._fastest(twisted) * self._way if wanted else np.zeros_like(q)
        gap = self.velocity - goal
        gap, self._change = fade(gap, self._change, np.abs(gap), self._limits, self._period, SHARE)
        before, self.velocity = self.velocity, goal + gap
        if not goal.any() and np.abs(self.velocity).max() < SLOWEST:
            self.velocity, self._change = np.zeros((2, len(q)))
        moved = 0.5 * (before + self.velocity) * self._period
        self._way = self._way - moved
        return moved

    def _look(self, q: np.ndarray, base_from_tip: np.ndarray, world: World | None) -> np.ndarray:
        """Return the way (n,) to where the objective wants the joints."""
        try:
            solution = solve(self._arm, base_from_tip, q, self._options, world=world)
        except NotCompiledError:
            return np.zeros_like(q)
        return solution.q - q if solution.converged else np.zeros_like(q)

    def _fastest(self, twisted: np.ndarray) -> float:
        """Return the share [1/s] of the way at which the joints can stop where it ends, beside what the twist needs."""
        way = np.maximum(np.abs(self._way), NO_WAY)
        left = np.clip(self._limits.velocity - np.abs(twisted), 0.0, TOP_SPEED * self._limits.velocity)
        acceleration, jerk = SHARE * self._limits.acceleration, SHARE * self._limits.jerk
        ramp = acceleration / (2.0 * jerk)
        stoppable = 2.0 * way / (np.sqrt(ramp**2 + 2.0 * way / acceleration) + ramp)
        return min(float(np.min(np.minimum(left, stoppable) / way)), 1.0 / (math.e * self._steps * self._period))
