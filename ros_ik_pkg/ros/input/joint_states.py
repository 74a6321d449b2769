"""Joint states by name: messages are stored, and read only when a target needs them."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from sensor_msgs.msg import JointState

from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.interface.topics import JOINT_STATES

MAX_SOURCES = 64  # publishers with different sets of names; the one that was silent longest goes first


class Kept(NamedTuple):
    """A message, its names, and its arrival [s, monotonic]: its stamp may be zero, or of another clock."""

    names: tuple[str, ...]
    message: JointState
    arrival: float


class JointStates:
    """The newest message of every set of joint names; the newest message that names a joint gives its position.

    A message without positions does not replace one that has them.
    """

    def __init__(self, topic: str = JOINT_STATES.name) -> None:
        self._topic = topic  # as messages for people name it
        self._newest: dict[tuple, Kept] = {}
        self._noted: set[tuple[str, ...]] = set()  # names of messages that were odd

    def keep(self, message: JointState) -> None:
        """Store a message; it is read when a target needs it."""
        names = tuple(message.name)
        key = names if message.position or not names else (names,)
        self._newest.pop(key, None)
        self._newest.pop((), None)  # a message without names is reported only while it is the newest
        self._newest[key] = Kept(names, message, time.monotonic())
        if len(self._newest) > MAX_SOURCES:
            del self._newest[next(iter(self._newest))]

    @property
    def empty(self) -> bool:
        """Whether no message has arrived."""
        return not self._newest

    def seed(self, joint_names: Sequence[str]) -> np.ndarray:
        """Return the positions (n,) of these joints [rad, m]; refuse the target if one is not known."""
        found = self.positions(joint_names)
        if len(found) < len(joint_names):
            raise RefusedError('joint_states', self._what_is_missing(joint_names, found))
        return np.array([found[name] for name in joint_names])

    def positions(self, joint_names: Sequence[str]) -> dict[str, float]:
        """Return the known positions of these joints by name [rad, m]; refuse the target if a message is faulty."""
        found: dict[str, float] = {}
        for names, message, _ in reversed(self._newest.values()):
            if len(found) == len(joint_names):
                break
            try:
                found |= read_positions(names, message, [name for name in joint_names if name not in found])
            except ValueError as error:
                raise RefusedError('joint_states', f'{self._topic} has {error}') from None
        return found

    def moments(self, joint_names: Sequence[str]) -> np.ndarray:
        """Return when the known positions of these joints arrived [s, monotonic] and their stamps [s] (n, 2)."""
        found: dict[str, tuple[float, float]] = {}
        for names, message, arrival in reversed(self._newest.values()):
            if message.position:
                stamp = message.header.stamp
                moment = arrival, stamp.sec + 1e-9 * stamp.nanosec
                found = dict.fromkeys(names, moment) | found
        return np.array([found[name] for name in joint_names])

    def take_notes(self) -> tuple[str, ...]:
        """Return what is odd about the messages but harmless, once for each set of names."""
        notes = []
        for names, message, _ in self._newest.values():
            lengths = len(message.velocity), len(message.effort)
            if not {0, len(names)}.issuperset(lengths) and names not in self._noted:
                self._noted.add(names)
                notes.append(
                    f'{self._topic} has {len(names)} names, {lengths[0]} velocities and {lengths[1]} efforts; '
                    'the positions were taken'
                )
        return tuple(notes)

    def age(self, joint_names: Sequence[str]) -> float:
        """Return the age of the oldest position of these joints [s]; infinite if one has never arrived."""
        missing = set(joint_names)
        for names, message, arrival in reversed(self._newest.values()):
            if message.position:
                missing.difference_update(names)
            if not missing:
                return time.monotonic() - arrival
        return math.inf

    def _what_is_missing(self, joint_names: Sequence[str], found: dict[str, float]) -> str:
        """Return in words which joints have no position yet, and which names have arrived."""
        if self.empty:
            return f'no message on {self._topic} yet, and seed_source is joint_states'
        missing = ', '.join(name for name in joint_names if name not in found)
        if found:
            return shorten(f'{self._topic} gave no position yet of {missing}')
        got = ', '.join(dict.fromkeys(name for kept in self._newest.values() for name in kept.names)) or 'no names'
        return f'{self._topic} gave none of the joints: expected {shorten(missing)}; got {shorten(got)}'


def read_positions(names: Sequence[str], message: JointState, wanted: Sequence[str]) -> dict[str, float]:
    """Return the positions of the joints `wanted` in a message; raise ValueError if it is faulty about them."""
    places = {name: place for place, name in enumerate(names)}
    spoken_for = [name for name in wanted if name in places]
    if names and not spoken_for:
        return {}
    positions = message.position
    if len(positions) not in (0, len(names)):
        raise ValueError(f'{len(names)} names, {len(positions)} positions; expected as many of both, or no positions')
    if len(places) < len(names) and (twice := [name for name in spoken_for if names.count(name) > 1]):
        raise ValueError(f'{", ".join(twice)} more than once')
    found = {name: positions[places[name]] for name in spoken_for} if positions else {}
    for name, position in found.items():
        if not math.isfinite(position):
            raise ValueError(f'position {position} of {name}; expected a finite number')
    return found
