"""Timers on steady time that do not disturb each other."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.timer import Timer


def steady_timer(node: Node, period: float, callback: Callable[[], None]) -> Timer:
    """Return a running timer that calls every `period` [s].

    It has a clock of its own. At each reset of a timer the EventsExecutor queues every overdue timer of the same clock
    once more: it is then called twice in a row, and its next call is put off by a period each time.
    """
    return node.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))


class OneShot:
    """A timer that calls once, `delay` [s] after each start."""

    def __init__(self, node: Node, delay: float, callback: Callable[[], None]) -> None:
        self._callback = callback
        clock = Clock(clock_type=ClockType.STEADY_TIME)  # of its own, as above
        self._timer = node.create_timer(delay, self._call, clock=clock, autostart=False)

    def start(self) -> None:
        """Call after the delay, counted from now."""
        self._timer.reset()

    def overdue(self) -> bool:
        """Return whether the call is overdue."""
        return self._timer.is_ready()

    def cancel(self) -> None:
        """Cancel the call, until the timer is started again."""
        self._timer.cancel()

    def _call(self) -> None:
        self._timer.cancel()
        self._callback()
