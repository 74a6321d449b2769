"""SIGINT, SIGTERM and the end of `ros2 launch` as a flag; imports nothing heavy, so it can be set up first."""

from __future__ import annotations

import atexit
import os
import signal
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)
LAUNCHER_VARIABLE = 'ROS_IK_LAUNCHER'  # environment variable with the process id of `ros2 launch`


class StopFlag:
    """Set by SIGINT and SIGTERM, and when the launcher has ended.

    Until `spinning` is set, the first signal also raises KeyboardInterrupt; later ones never do, so that they cannot
    break into the shutdown. `ros2 launch` leaves its nodes running if SIGTERM or SIGKILL ends it, so a node that it
    started watches for its end.
    """

    def __init__(self) -> None:
        self._signalled = False
        self.spinning = False
        self._launcher = int(os.environ.get(LAUNCHER_VARIABLE, 0))
        for number in SIGNALS:
            signal.signal(number, self._stop)
        # The interpreter restores the default handlers while it ends; a second signal would kill it there.
        atexit.register(_ignore_signals)

    @property
    def stopped(self) -> bool:
        """Whether the program should stop."""
        return self._signalled or (self._launcher > 0 and not _exists(self._launcher))

    def _stop(self, _number: int, _frame: FrameType | None) -> None:
        first, self._signalled = not self._signalled, True
        if first and not self.spinning:
            raise KeyboardInterrupt


def _exists(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass  # it exists and belongs to another user
    return True


def _ignore_signals() -> None:
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
