"""Selects the next target: the newest. A target that waits for its transform does not block others."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from rclpy.node import Node

from ros_ik_pkg.ros.handling.result import Result
from ros_ik_pkg.ros.runtime.timers import OneShot

TRANSFORM_PERIOD = 0.01  # s between two tries to find a transform


class Arrival(NamedTuple):
    """The bytes of a target, and when they arrived [s, perf_counter]."""

    data: bytes
    time: float


class TargetQueue:
    """Keeps the newest target, and one that waits for its transform with the newest such target behind it.

    After each target, all events that have arrived meanwhile (parameters, joint states, timers) are handled before the
    next target. An executor alone does not ensure this: the EventsExecutor takes events in order, so if targets arrive
    faster than they are solved, their events delay all others.

    handle(data, waited): returns the result, or None if the target can still wait for its transform; `waited` is the
    time since it arrived [s].
    answer(result, arrived): publishes the result; returns whether a command went out.
    give_up(data, status, why): returns the refusal of a target that waits for its transform.

    A target that was handled or waits for its transform gets exactly one result. A target that a newer one replaces
    before that gets none.
    """

    def __init__(
        self,
        node: Node,
        handle: Callable[[bytes, float], Result | None],
        answer: Callable[[Result, float], bool],
        give_up: Callable[[bytes, str, str], Result],
    ) -> None:
        self._node, self._handle, self._answer, self._give_up = node, handle, answer, give_up
        self._newest: Arrival | None = None
        self._waiting: Arrival | None = None  # for its transform
        self._next: Arrival | None = None  # to wait for its transform
        self._look = OneShot(node, TRANSFORM_PERIOD, self._look_again)
        self._free = True  # whether all other events have been handled since the last target
        self._queued = False  # whether the newest is queued behind all other events
        self._ended = 0.0  # s, perf_counter: when the last target was handled

    def put(self, data: bytes) -> None:
        """Handle a target, the bytes of a message, or keep it for later instead of an older one."""
        self._newest = Arrival(data, time.perf_counter())
        if self._free:
            self._handle_newest()
        elif not self._queued:
            self._queued = True
            self._node.executor.create_task(self._take_turn)

    def all_had_their_turn(self, since: float) -> None:
        """Note that all events that arrived before a time [s, perf_counter] have been handled."""
        self._free |= since > self._ended

    def close(self) -> None:
        """Refuse the target that waits for its transform."""
        self._drop_waiting('shutdown', 'the node ends')

    def _take_turn(self) -> None:
        self._queued = False
        self._handle_newest()

    def _handle_newest(self) -> None:
        newest, self._newest = self._newest, None
        if newest is None:
            return
        self._free = False
        try:
            self._take(newest)
        finally:
            self._ended = time.perf_counter()

    def _take(self, arrival: Arrival) -> None:
        """Answer a target, or let it wait for its transform."""
        result = self._try(arrival)
        if result is not None:
            if self._answer(result, arrival.time):
                # The others are older: the arm must not go back to one of them.
                self._drop_waiting('superseded', 'a newer target was commanded')
        elif self._waiting is None:
            self._waiting = arrival
            self._look.start()
        else:
            self._next = arrival

    def _try(self, arrival: Arrival) -> Result | None:
        return self._handle(arrival.data, time.perf_counter() - arrival.time)

    def _look_again(self) -> None:
        """Try the target that waits for its transform once more; after its result the next one waits."""
        waiting = self._waiting
        if waiting is None:
            return
        result = self._try(waiting)
        if result is None:
            self._look.start()
            return
        self._waiting, following, self._next = None, self._next, None
        self._answer(result, waiting.time)
        if following is not None:
            self._take(following)

    def _drop_waiting(self, status: str, why: str) -> None:
        waiting, self._waiting, self._next = self._waiting, None, None
        if waiting is not None:
            self._answer(self._give_up(waiting.data, status, why), waiting.time)
