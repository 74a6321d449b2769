"""Contact ahead of the stream: how near the next contact of a motion is, and whether a stop stays clear of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ik.collision.look_ahead import contact_of_stop, gaps_of
from ros_ik_pkg.ik.contacts.contacts import Room
from ros_ik_pkg.ros.interface.servo_settings import Thresholds

PROBES = 64  # configurations that show how far apart two bodies usually are
USUAL = 0.5  # share of its usual gap below which a pair is near
NEARER = 1e-4  # m per rad or m of the fastest joint; a gap that shrinks less counts as constant
DEEPER = 1e-7  # m: rounding of a depth
CERTAIN = 1e-6  # m: allowance for the rounding of a stop and of coal


class Nearing(NamedTuple):
    """The contact that a motion approaches: its measure here and ahead, and its gap [m].

    The measure is the gap [m], scaled for pairs that are always near each other.
    """

    now: float
    ahead: float
    text: str


class ContactAhead:
    """Looks for contact in one room by the lower bound of the search, so what it calls clear does not touch.

    Parts of one wrist may always be some millimetres apart. So a pair whose usual gap is less than twice `contact_slow`
    is judged in proportion: it is near below half of its usual gap.
    """

    def __init__(self, arm: Arm, room: Room, thresholds: Thresholds, margin: float) -> None:
        """margin: [m] clearance that counts as contact."""
        self.room, self._margin = room, margin + CERTAIN
        slow, contacts = thresholds.contact_slow, len(room.levers)
        lower, upper = (np.clip(limit, -np.pi, np.pi) for limit in (arm.lower, arm.upper))
        probes = np.random.default_rng(0).uniform(lower, upper, (PROBES, arm.n))
        gaps = gaps_of(room.packed, probes, np.full(contacts, 2.0 * slow / USUAL + margin)) - margin
        usual = np.median(gaps, axis=0) if contacts else np.empty(0)
        self._scale = slow / np.clip(USUAL * usual, 1e-9, max(slow, 1e-9))
        self._within = margin + (1.0 + thresholds.hysteresis) * slow / np.maximum(self._scale, 1e-9)
        self._margins, self._where = np.full(contacts, self._margin), np.empty(arm.n)

    def nearing(self, q: np.ndarray, ahead: np.ndarray, step: float) -> Nearing | None:
        """Return the contact that a motion from q to `ahead` (n,) approaches; `step`: [rad, m] of the fastest joint.

        None if nothing is near, or if the near gaps stay constant. Gaps that shrink count before gaps that grow.
        """
        here, there = gaps_of(self.room.packed, np.array([q, ahead]), self._within) - self._margin
        near = np.flatnonzero(np.isfinite(here))
        falls = here[near] - np.minimum(there[near], self._within[near])
        falling = falls > NEARER * step
        moving = falling if falling.any() else falls < -NEARER * step
        if not moving.any():
            return None
        near, falls = near[moving], falls[moving]
        measures = here[near] * self._scale[near]
        nearest = int(np.argmin(measures))
        text = f'{1e3 * here[near[nearest]]:.2g} mm between {" and ".join(self.room.names(int(near[nearest])))}'
        return Nearing(float(measures[nearest]), float(measures[nearest] - np.max(falls * self._scale[near])), text)

    def fault(self, before: np.ndarray, state: np.ndarray, limits: np.ndarray, period: float) -> str:
        """Return in words what a stop from a state touches; empty if it stays clear or leaves an existing contact.

        before: (n,) the last command. state: (3, n) the next one and its derivatives. limits: (5, n) those of the
        limiter. period: [s].
        """
        contact = self._contact(self._margins, state, limits, period)
        if contact >= 0:
            touching = np.isfinite(gaps_of(self.room.packed, before[None], self._margins)[0])
            if touching.any() and self._leaves(before, state[0]):
                contact = self._contact(np.where(touching, -np.inf, self._margins), state, limits, period)
        return '' if contact < 0 else f'{" and ".join(self.room.names(contact))} would touch'

    def _contact(self, margins: np.ndarray, state: np.ndarray, limits: np.ndarray, period: float) -> int:
        """Return the first contact on the stop from a state, -1 for none."""
        room = self.room
        return int(contact_of_stop(room.packed, room.levers, margins, state, limits, period, self._where))

    def _leaves(self, before: np.ndarray, q: np.ndarray) -> bool:
        """Return whether q (n,) is no deeper in contact than the last command, by coal."""
        return self.room.look(q).clearance >= self.room.look(before).clearance - DEEPER
