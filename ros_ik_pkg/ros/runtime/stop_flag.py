"""SIGINT and SIGTERM as a flag; imports nothing heavy, so that it can stand before all else."""

from __future__ import annotations

import signal
from types import FrameType


class StopFlag:
    """Set by SIGINT and SIGTERM; until `spinning` is set, they raise KeyboardInterrupt too."""

    def __init__(self) -> None:
        self.stopped = False
        self.spinning = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._stop)

    def _stop(self, _number: int, _frame: FrameType | None) -> None:
        self.stopped = True
        if not self.spinning:
            raise KeyboardInterrupt
