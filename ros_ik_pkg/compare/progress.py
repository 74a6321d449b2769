"""A progress bar on standard error, if that is a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

WIDTH = 32
PERIOD = 0.1  # s between updates


def progress_bar(total: int, label: str) -> Callable[[int], None]:
    """Return a function that adds to the count and draws the bar; it is silent without a terminal."""
    done, drawn = 0, 0.0

    def advance(more: int) -> None:
        nonlocal done, drawn
        done += more
        now = time.monotonic()
        if not sys.stderr.isatty() or (now - drawn < PERIOD and done < total):
            return
        drawn = now
        filled = WIDTH * done // total
        end = '\r\033[K' if done >= total else ''
        print(f'\r{label} {"█" * filled}{"░" * (WIDTH - filled)} {done}/{total}', end=end, file=sys.stderr, flush=True)

    return advance
