"""Calls that other threads queue for the panel's thread; none of them can end the panel."""

from __future__ import annotations

import queue
import traceback
from collections.abc import Callable
from typing import Any

from ros_ik_pkg.ik import IkError
from ros_ik_pkg.ik.text import shorten

LONGEST = 400  # characters of an error that are shown


class Events:
    """A queue of calls; `failed` is called with the text of an exception that one of them raises.

    Pages may send any value, and topics any message. Exceptions are logged and shown, and the other calls continue.
    """

    def __init__(self, log: Any, failed: Callable[[str], object]) -> None:
        self._log, self._failed = log, failed
        self._calls: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()

    def put(self, call: Callable[[], object]) -> None:
        """Queue a call; from any thread."""
        self._calls.put(call)

    def run(self) -> None:
        """Run the calls queued so far; later ones wait, so that a flood of calls cannot block the panel."""
        for _ in range(self._calls.qsize()):
            self.guard(self._calls.get())

    def guard(self, call: Callable[[], object]) -> None:
        """Run a call; log and report its exception."""
        try:
            call()
        except IkError as error:
            self._log.warning(shorten(str(error), LONGEST), throttle_duration_sec=1.0)
            self._tell(str(error))
        except Exception as error:
            self._log.error(traceback.format_exc(), throttle_duration_sec=1.0)
            self._tell(f'{type(error).__name__}: {error}')

    def _tell(self, text: str) -> None:
        try:
            self._failed(shorten(text, LONGEST))
        except Exception:
            self._log.error(traceback.format_exc(), throttle_duration_sec=1.0)
