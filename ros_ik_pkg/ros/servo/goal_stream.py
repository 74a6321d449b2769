"""Separate goals as one moving goal: it moves from goal to goal at the rate at which they arrive."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

LONGEST_GAP = 0.2  # s between two goals of one stream; after a longer gap a new stream begins
SLACK = 1.25  # duration of the motion to a goal over the mean time between goals, so that late goals cause no stop
MEMORY = 0.8  # weight of the old mean time between goals
ARRIVED = 1e-6  # rad, m


class GoalStream:
    """Goals, joints (n,) [rad, m] or poses (4, 4); one that is not part of a stream is passed on at once.

    limits: largest velocity (k,) between two goals of a stream. way(a, b): the velocity (k,) that leads from goal a to
    goal b in 1 s. moved(a, step): the goal that a step (k,) leads to from goal a.
    """

    def __init__(
        self,
        start: np.ndarray,
        limits: np.ndarray,
        way: Callable[[np.ndarray, np.ndarray], np.ndarray] = lambda a, b: b - a,
        moved: Callable[[np.ndarray, np.ndarray], np.ndarray] = np.add,
    ) -> None:
        self._last = self._from = start
        self._limits, self._velocity, self._way, self._moved = limits, np.zeros_like(limits), way, moved
        self._came, self._gap = -np.inf, 0.0

    def put(self, goal: np.ndarray, now: float) -> None:
        """Take the next goal at a time [s]."""
        here, _ = self.at(now)
        gap = now - self._came
        streaming = 0.0 < gap <= LONGEST_GAP
        self._gap = (MEMORY * self._gap + (1.0 - MEMORY) * gap if self._gap else gap) if streaming else 0.0
        velocity = self._way(here, goal) / (SLACK * self._gap) if self._gap else np.zeros_like(self._limits)
        smooth = self._gap > 0.0 and bool(np.all(np.abs(velocity) <= self._limits))
        self._from, self._velocity = (here, velocity) if smooth else (goal, np.zeros_like(velocity))
        self._last, self._came = goal, now

    def at(self, now: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the moving goal and its velocity (k,) at a time [s]."""
        since = now - self._came
        if not self._velocity.any() or since >= SLACK * self._gap:
            return self._last, np.zeros_like(self._velocity)
        return self._moved(self._from, self._velocity * since), self._velocity

    @property
    def alone(self) -> bool:
        """Whether the last goal is not part of a stream."""
        return self._gap == 0.0

    def reached(self, q: np.ndarray) -> bool:
        """Whether the joints q (n,) are at the last goal."""
        return bool(np.all(np.abs(q - self._last) <= ARRIVED))
