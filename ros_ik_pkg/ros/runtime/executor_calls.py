"""Calls on the thread of a node's executor, at once or after a delay."""

from __future__ import annotations

import heapq
import itertools
import threading
import time
from collections.abc import Callable

from rclpy.node import Node


class ExecutorCalls:
    """Queues calls for the executor of a node; everything that waits there already goes first.

    Timers of rclpy do not serve here. Each reset of a timer lets the EventsExecutor queue every timer that is overdue
    once more. The one that is queued twice is called twice in a row and then skips a period, or several.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._due: list[tuple[float, int, Callable[[], None]]] = []  # a heap: when [s], the order of equals, what
        self._numbers = itertools.count()
        self._changed = threading.Condition()
        self._closed = False
        self._thread: threading.Thread | None = None

    def soon(self, call: Callable[[], None]) -> None:
        """Call behind everything that the executor has to do now."""
        executor = self._node.executor
        if executor is not None:  # there is none before the node spins and after it has stopped
            executor.create_task(call)

    def later(self, delay: float, call: Callable[[], None]) -> None:
        """Call after a delay [s]."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name='executor calls')
            self._thread.start()
        with self._changed:
            entry = time.monotonic() + delay, next(self._numbers), call
            heapq.heappush(self._due, entry)
            if self._due[0] is entry:
                self._changed.notify()

    def close(self) -> None:
        """End the thread; what is not due yet is not called any more."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        """Hand over each call when it is due."""
        with self._changed:
            while not self._closed:
                delay = self._due[0][0] - time.monotonic() if self._due else None
                if delay is None or delay > 0.0:
                    self._changed.wait(delay)
                else:
                    self.soon(heapq.heappop(self._due)[2])
