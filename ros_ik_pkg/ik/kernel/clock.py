"""The monotonic clock, read from inside compiled code."""

from __future__ import annotations

import math

from numba import types

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel

CLOCK_MONOTONIC = 1  # Linux, <time.h>
_clock_gettime = types.ExternalFunction('clock_gettime', types.int32(types.int32, types.CPointer(types.int64)))


@kernel
def now(clock):
    """Return monotonic time [s]; `clock` (2,) int64 is scratch for the C structure."""
    _clock_gettime(CLOCK_MONOTONIC, clock.ctypes)
    return clock[0] + 1e-9 * clock[1]


@inlined
def passed(stop_time, clock):
    """Return whether it is later than `stop_time` [s]; if that is infinite, the clock is not read."""
    return stop_time < math.inf and now(clock) > stop_time
