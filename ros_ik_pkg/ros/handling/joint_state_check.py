"""Detects joint states that contradict each other: between two of them a joint moves faster than it can."""

from __future__ import annotations

import math
import time

import numpy as np

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ros.input.joint_states import JointStates
from ros_ik_pkg.ros.input.refusal import RefusedError

MARGIN = 1.2  # of the velocity limit: drives overshoot it a little
JITTER = 0.02  # s, error of the time between two arrivals
DOUBT_TIME = 1.0  # s after a contradiction in which no joint state is believed


class DoubtedError(RefusedError):
    """The joint states are known, but not believed."""


class JointStateCheck:
    """Gives joint states for limited steps, unless they contradict each other.

    The usual reason is a second publisher, such as a joint_state_publisher that sends zeros beside the
    joint_state_broadcaster. The node cannot know which is right, so it believes neither until DOUBT_TIME passes
    without a contradiction.
    """

    def __init__(self) -> None:
        self._arm: Arm | None = None
        self._last: tuple[np.ndarray, np.ndarray] | None = None  # positions (n,) and their moments (n, 2)
        self._doubted_until = -math.inf  # s, monotonic
        self._reason, self._count = '', 0

    def believed(self, joint_states: JointStates, arm: Arm) -> np.ndarray:
        """Return the joint state (n,) [rad, m]; raise RefusedError if it is not known, DoubtedError if in doubt."""
        q, moments = joint_states.seed(arm.joint_names), joint_states.moments(arm.joint_names)
        if not arm.same_robot(self._arm):
            self._arm, self._last = arm, None
        if self._last is not None:
            self._compare(q, moments, *self._last)
        self._last = q, moments
        if time.monotonic() < self._doubted_until:
            self._count += 1
            raise DoubtedError('joint_states', f'joint states contradict each other: {self._reason}')
        return q

    def take_doubts(self) -> tuple[int, str]:
        """Return how many targets met doubted joint states since the last call, and the last reason."""
        count, self._count = self._count, 0
        return count, self._reason

    def _compare(self, q: np.ndarray, moments: np.ndarray, last: np.ndarray, last_moments: np.ndarray) -> None:
        """Begin to doubt if a joint has moved from `last` to q (n,) faster than it can."""
        both_stamped = (moments[:, 1] > 0.0) & (last_moments[:, 1] > 0.0)
        between = moments - last_moments
        # The longer time counts: arrivals may bunch up, and a simulation may run faster than real time.
        elapsed = np.maximum(between[:, 0], np.where(both_stamped, between[:, 1], 0.0))
        moved = np.abs(q - last)
        turns = np.isinf(self._arm.upper - self._arm.lower)  # many drivers report those within one turn
        moved[turns] = np.abs((moved[turns] + np.pi) % (2.0 * np.pi) - np.pi)
        excess = moved - self._arm.velocity_limits * (MARGIN * np.maximum(elapsed, 0.0) + JITTER)
        worst = int(np.argmax(excess))
        if excess[worst] > 0.0:
            self._doubted_until = time.monotonic() + DOUBT_TIME
            self._reason = (
                f'{self._arm.joint_names[worst]} moved by {moved[worst]:.3g} in {elapsed[worst]:.3g} s, its limit is '
                f'{self._arm.velocity_limits[worst]:.3g} per second'
            )
