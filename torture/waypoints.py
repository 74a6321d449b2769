"""The targets of a stream, with stamps that encode the client, the number and the time."""

from __future__ import annotations

import time

import numpy as np

from ros_ik_pkg.ik import Arm

SPREAD = 0.4  # rad around home
WAYPOINTS, CLIENTS = 500, 20
TICK = WAYPOINTS * CLIENTS  # ns: the last digits of a stamp say which waypoint of which client
SECOND = 10**9  # ns
FIRST, LAST = 2 * SECOND, 10**17  # ns, since the machine was started


def waypoints(arm: Arm, seed: int) -> np.ndarray:
    """Return (WAYPOINTS, n) configurations around home [rad, m]; the targets are the poses of the tip there."""
    offsets = np.random.default_rng(seed).uniform(-SPREAD, SPREAD, (WAYPOINTS, arm.n))
    return np.clip(arm.home + offsets, arm.lower, arm.upper)


class Stamps:
    """Stamps of one process that sends: they rise, and no other process makes the same."""

    def __init__(self) -> None:
        self._tick = 0

    def next(self, client: int, which: int) -> int:
        """Return the stamp [ns] of a target that is sent now."""
        self._tick = max(self._tick + 1, time.monotonic_ns() // TICK)
        return self._tick * TICK + client * WAYPOINTS + which


def is_of_a_sender(stamp: int) -> bool:
    """Whether a stamp is of this kind: a peer's are smaller, those of the time of day larger."""
    return FIRST < stamp < LAST


def sent_at(stamp: int) -> float:
    """Return when a target was sent [s], in the time of time.monotonic, which all processes share."""
    return stamp // TICK * TICK / SECOND


def client_of(stamp: int) -> int:
    """Return the number of the client that sent a target."""
    return stamp % TICK // WAYPOINTS


def which_of(stamp: int) -> int:
    """Return which waypoint a target is."""
    return stamp % WAYPOINTS
