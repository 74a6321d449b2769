"""The thresholds of /diagnostics."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class HealthLimits:
    """Thresholds from which the level is WARN or ERROR; 0 disables one. The parameters `diagnostics.*`."""

    warn_failed_ratio: float  # fraction of the targets of a period that failed or were refused
    error_failed_ratio: float
    warn_latency: float  # s, 99th percentile
    error_latency: float
    joint_states_silence: float  # s
    target_silence: float  # s
