"""Commands within limits of position, velocity, acceleration and jerk: one for each period, towards a moving target.

Two limiters keep the same limits, each joint by itself: the package's own, and Ruckig (Berscheid and Kroeger,
Jerk-limited Real-time Trajectory Generation with Arbitrary Target States, RSS 2021).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik.motion.jerk_limited import MOST_COPIED, advance, can_stop, halt, time_to_rest

try:
    import ruckig
except ImportError:
    ruckig = None

POSITION_MARGIN = 1e-9  # rad, m: so that rounding does not lead beyond a limit
DYNAMIC_MARGIN = 1e-6  # of the other limits: third differences of positions round to 1e-5 rad/s^3 at 1 kHz
REST = np.array([[1e-7], [1e-5]])  # rad/s, rad/s^2: no motion
FASTEST_TARGET = 0.999  # of a velocity limit: Ruckig needs a margin to catch up with a target that moves


@dataclass(frozen=True, eq=False)
class MotionLimits:
    """Limits of n joints, arrays (n,) each [rad, m, s]: `lower` and `upper` may be infinite, the others are finite."""

    lower: np.ndarray
    upper: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    jerk: np.ndarray

    @property
    def table(self) -> np.ndarray:
        """The limits as rows of a (5, n) array, each a little narrower."""
        margin = np.minimum(POSITION_MARGIN, 0.5 * (self.upper - self.lower))
        dynamic = [(1.0 - DYNAMIC_MARGIN) * limit for limit in (self.velocity, self.acceleration, self.jerk)]
        return np.ascontiguousarray([self.lower + margin, self.upper - margin, *dynamic])


class Motion(NamedTuple):
    """Positions of n joints and their derivatives, arrays (n,) each [rad, m, s]."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    jerk: np.ndarray

    @classmethod
    def rest(cls, position: np.ndarray) -> Motion:
        """Return rest at a position (n,) [rad, m]."""
        return cls(position, *np.zeros((3, len(position))))

    def after(self, time: float) -> Motion:
        """Return the motion a time [s] later, its jerk constant."""
        x, v, a, j = self
        position = x + time * (v + time * (0.5 * a + time * j / 6.0))
        return Motion(position, v + time * (a + 0.5 * time * j), a + time * j, j)


class JerkLimiter:
    """Moves commands from rest at `start` (n,) [rad, m] to targets, one period [s] at a time.

    A joint that starts outside its position limits moves only inwards: its position is the limit until it is inside.
    """

    name = 'own'

    def __init__(self, limits: MotionLimits, period: float, start: np.ndarray) -> None:
        self.period = period
        self._limits = limits.table
        self._state = np.zeros((3, len(start)))
        self._state[0] = start

    @property
    def position(self) -> np.ndarray:
        """The last command (n,) [rad, m]."""
        return self._state[0].copy()

    @property
    def motion(self) -> Motion:
        """The last command and its derivatives, with jerk 0."""
        position, velocity, acceleration = self._state.copy()
        return Motion(position, velocity, acceleration, np.zeros_like(position))

    @property
    def velocity(self) -> np.ndarray:
        """The velocity at the last command (n,) [rad/s, m/s]."""
        return self._state[1].copy()

    @property
    def acceleration(self) -> np.ndarray:
        """The acceleration at the last command (n,) [rad/s^2, m/s^2]."""
        return self._state[2].copy()

    @property
    def state(self) -> np.ndarray:
        """Position, velocity and acceleration at the last command (3, n)."""
        return self._state.copy()

    @property
    def limits(self) -> np.ndarray:
        """The limits that are kept (5, n)."""
        return self._limits

    def take_back(self, state: np.ndarray) -> None:
        """Go back to a state (3, n) that was the last one."""
        self._state = state

    @property
    def at_rest(self) -> bool:
        """Whether the last command stands still."""
        return bool(np.all(np.abs(self._state[1:]) <= REST))

    @property
    def time_to_rest(self) -> float:
        """Duration of the shortest stop from here [s]."""
        return time_to_rest(self._state, self._limits)

    def advance(self, target: Motion) -> np.ndarray:
        """Return the next command (n,) [rad, m] towards a target, whose position is that of this moment."""
        limits = self._widened()
        outwards = ((target.position >= limits[1]) & (target.velocity > 0.0)) | (
            (target.position <= limits[0]) & (target.velocity < 0.0)
        )
        within = np.array(target)
        within[0] = np.clip(target.position, limits[0], limits[1])
        within[1] = np.clip(target.velocity, -limits[2], limits[2])
        within[1:, outwards] = 0.0
        self._move(within, limits)
        return self.position

    def halt(self) -> np.ndarray:
        """Return the next command (n,) [rad, m] of the shortest stop."""
        halt(self._state, self._limits, self.period)
        return self.position

    def _move(self, targets: np.ndarray, limits: np.ndarray) -> None:
        """Move the state on to targets (4, n) within the limits (5, n)."""
        advance(self._state, targets, limits, self.period)

    def _widened(self) -> np.ndarray:
        """Return the limits, widened to the joints that are outside."""
        limits = self._limits.copy()
        np.minimum(limits[0], self._state[0], out=limits[0])
        np.maximum(limits[1], self._state[0], out=limits[1])
        return limits


class RuckigLimiter(JerkLimiter):
    """Plans each period by Ruckig, relative to the target; if Ruckig fails, the package's own limiter does it."""

    name = 'ruckig'

    def __init__(self, limits: MotionLimits, period: float, start: np.ndarray) -> None:
        super().__init__(limits, period, start)
        n = len(start)
        self._ruckig, self._output = ruckig.Ruckig(n, period), ruckig.OutputParameter(n)
        self._input = ruckig.InputParameter(n)
        self._input.synchronization = ruckig.Synchronization.No
        self._input.target_position = self._input.target_velocity = self._input.target_acceleration = [0.0] * n

    def _move(self, targets: np.ndarray, limits: np.ndarray) -> None:
        copied = np.all(np.abs(targets[2:]) <= MOST_COPIED * limits[3:], axis=0)
        target = np.vstack([targets[:2], targets[2:] * copied])
        target[1] = np.clip(target[1], -FASTEST_TARGET * limits[2], FASTEST_TARGET * limits[2])
        asked = self._input
        asked.current_position, asked.current_velocity, asked.current_acceleration = (self._state - target[:3]).tolist()
        asked.max_velocity, asked.max_acceleration = (limits[2:4] - target[1:3]).tolist()
        asked.min_velocity, asked.min_acceleration = (-limits[2:4] - target[1:3]).tolist()
        asked.max_jerk = (limits[4] - np.abs(target[3])).tolist()
        planned = self._plan()
        state = np.array([self._output.new_position, self._output.new_velocity, self._output.new_acceleration])
        state += Motion(*target).after(self.period)[:3]
        if planned and can_stop(state, limits):
            self._state = state
        else:
            super()._move(targets, limits)

    def _plan(self) -> bool:
        """Let Ruckig plan from the input to the output; return whether it could."""
        try:
            return self._ruckig.update(self._input, self._output) in (ruckig.Result.Working, ruckig.Result.Finished)
        except (ruckig.RuckigError, ValueError):  # its result code may be one that its binding lacks
            return False


class Unlimited(JerkLimiter):
    """Moves to the target at once, within the position limits only."""

    name = 'none'

    def _move(self, targets: np.ndarray, limits: np.ndarray) -> None:
        before = self._state
        self._state = np.zeros_like(before)
        self._state[0] = targets[0]
        self._state[1] = (self._state[0] - before[0]) / self.period

    def halt(self) -> np.ndarray:
        """Return the last command (n,) [rad, m]: without limits a stop takes no time."""
        self._state[1:] = 0.0
        return self.position


def make_limiter(smoothing: str, limits: MotionLimits, period: float, start: np.ndarray) -> JerkLimiter:
    """Return a limiter at rest; the package's own instead of Ruckig if that is not installed, as its `name` says."""
    kinds = {'none': Unlimited, 'own': JerkLimiter, 'ruckig': JerkLimiter if ruckig is None else RuckigLimiter}
    return kinds[smoothing](limits, period, start)
