"""A thread for work that is not urgent: it works in the gaps between targets and drops jobs if there are too many."""

from __future__ import annotations

import threading
import time
import traceback
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from rclpy.node import Node

Job = TypeVar('Job')
QUIET = 0.002  # s after the newest job was submitted until a job may begin
PERIOD = 0.05  # s from one job to the next if targets leave no such gap
LOG_PERIOD = 1.0  # s between tracebacks in the log


class BackgroundWorker(Generic[Job]):
    """Does jobs one after the other, in their order, on a thread of its own.

    Building messages runs in Python, in which only one thread runs at a time, so a job delays a target that arrives
    meanwhile. Jobs therefore begin in the gaps between targets, or at most once per PERIOD if there are no gaps. Only
    the newest `capacity` waiting jobs are kept; `dropped` counts the others.
    """

    def __init__(self, node: Node, name: str, do: Callable[[Job], None], capacity: int) -> None:
        self.dropped = 0
        self._node, self._name, self._do = node, name, do
        self._jobs: deque[Job] = deque(maxlen=capacity)
        self._newest = self._done = 0.0  # s
        self._wake = threading.Condition()
        self._stopped = False
        self._thread: threading.Thread | None = None

    def submit(self, job: Job) -> None:
        """Queue a job; if the queue is full, drop the oldest."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name=self._name)
            self._thread.start()
        with self._wake:
            self.dropped += len(self._jobs) == self._jobs.maxlen
            self._jobs.append(job)
            self._newest = time.monotonic()
            if len(self._jobs) == 1:
                self._wake.notify()

    def take_dropped(self) -> int:
        """Return how many jobs were dropped since the last call."""
        with self._wake:
            dropped, self.dropped = self.dropped, 0
        return dropped

    def close(self) -> None:
        """Finish what is under way and end the thread: one that still runs at exit aborts the process."""
        with self._wake:
            self._stopped = True
            self._wake.notify()
        if self._thread is not None:
            self._thread.join()

    def _work(self) -> None:
        """Do jobs until closed; an error in one is logged."""
        while self._wait_for_turn():
            with self._wake:
                job = self._jobs.popleft()
            try:
                self._do(job)
            except Exception:
                self._node.get_logger().error(traceback.format_exc(), throttle_duration_sec=LOG_PERIOD)
            self._done = time.monotonic()

    def _wait_for_turn(self) -> bool:
        """Wait until a job may begin; return False when closed."""
        with self._wake:
            while not self._stopped:
                delay = self._delay()
                if delay is not None and delay <= 0.0:
                    return True
                self._wake.wait(delay)
        return False

    def _delay(self) -> float | None:
        """Return the time [s] until the next job may begin; None if there is none."""
        if not self._jobs:
            return None
        return min(self._newest + QUIET, self._done + PERIOD) - time.monotonic()
