"""Steps within the velocity limits: how far each joint may go in the time since the last step."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rclpy.clock import ROSClock


LONGEST_TIME = 1e6  # s; a message holds no more than 2^31


class StepError(Exception):
    """No configuration is within both the limits and one step; `joint` is the index of the joint that prevents it."""

    def __init__(self, joint: int) -> None:
        super().__init__(f'joint {joint} is further outside its limits than one step leads')
        self.joint = joint


def limited_step(
    start: np.ndarray, goal: np.ndarray, reach: np.ndarray, lower: np.ndarray, upper: np.ndarray, mode: str
) -> tuple[np.ndarray, float]:
    """Return the step from `start` towards `goal`, shortened to what each joint may move.

    Parameters
    ----------
    start, goal : (n,) arrays
        Present and desired joint positions [rad, m]; `goal` is within the limits, `start` need not be.
    reach : (n,) array
        How far each joint may go [rad, m]; inf for any distance.
    lower, upper : (n,) arrays
        Joint limits [rad, m].
    mode : str
        'whole' shortens the step as a whole, on a straight line in joint space; 'joint' each joint by itself.

    Returns
    -------
    q : (n,) array
        Within the limits and within reach; `goal` itself if it is.
    fraction : float
        Fraction (0 to 1) of its motion that the most restricted joint completes.

    Raises
    ------
    StepError
        If `start` is so far outside the limits that one step does not lead back inside.

    """
    low, high = np.maximum(lower, start - reach), np.minimum(upper, start + reach)
    if (low > high).any():
        raise StepError(int(np.argmax(low - high)))
    step = goal - start
    fraction = _share(np.abs(step), reach)
    if fraction == 1.0:
        return goal, fraction
    return np.clip(start + fraction * step if mode == 'whole' else goal, low, high), fraction


def _share(distance: np.ndarray, reach: np.ndarray) -> float:
    """Return the largest fraction, at most 1, of the distances (n,) that is within reach (n,)."""
    moving = distance > 0.0
    with np.errstate(over='ignore'):
        return float(np.min(reach[moving] / distance[moving], initial=1.0))


def reach_of_step(velocity_limits: np.ndarray, duration: float) -> np.ndarray:
    """Return how far each joint may go (n,) [rad, m] in a time [s]; inf if no limit (n,) [rad/s, m/s] is known."""
    return np.where(np.isinf(velocity_limits), np.inf, np.minimum(velocity_limits, 1e12) * duration)


def travel_time(start: np.ndarray, goal: np.ndarray, velocity_limits: np.ndarray) -> float:
    """Return the shortest time [s] from start to goal (n,) within the velocity limits (n,)."""
    return min(float(np.max(np.abs(goal - start) / velocity_limits)), LONGEST_TIME)


class StepTimer:
    """Time since the last step, at most a given bound; the bound itself if there was no step.

    The time is steady, so that setting the clock cannot make an arm jump. With `use_sim_time` it is simulated time, as
    for a simulated arm: it pauses with the simulation, and if it runs backwards, the last step is forgotten.
    """

    def __init__(self, clock: ROSClock) -> None:
        self._clock = clock
        self._last: float | None = None

    def now(self) -> float:
        """Return the time [s]."""
        return self._clock.now().nanoseconds / 1e9 if self._clock.ros_time_is_active else time.monotonic()

    def elapsed(self, now: float, longest: float) -> float:
        """Return the time [s] since the last step, at most `longest`."""
        if self._last is None or now < self._last:
            return longest
        return min(now - self._last, longest)

    def step_taken(self, now: float) -> None:
        """Start counting now."""
        self._last = now

    def restart(self) -> None:
        """Forget the last step."""
        self._last = None
