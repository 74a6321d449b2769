"""The thresholds of /diagnostics: the parameters `diagnostics.*`."""

from __future__ import annotations

from dataclasses import dataclass

from ros_ik_pkg.ik.options import Option


@dataclass(frozen=True)
class HealthLimits:
    """Thresholds from which the level is WARN or ERROR; 0 disables one."""

    warn_failed_ratio: float  # fraction of the targets of a period that failed or were refused
    error_failed_ratio: float
    warn_latency: float  # s, 99th percentile
    error_latency: float
    joint_states_silence: float  # s
    target_silence: float  # s


def _health_limit(name: str, default: float, text: str, unit: str = '', maximum: float = 3600.0) -> Option:
    return Option(name, f'diagnostics.{name}', default, f'{text}; 0: never', unit, minimum=0.0, maximum=maximum)


HEALTH_OPTIONS = (
    _health_limit('warn_failed_ratio', 0.01, 'share of failed or refused targets that gives WARN', maximum=1.0),
    _health_limit('error_failed_ratio', 1.0, 'share of failed or refused targets that gives ERROR', maximum=1.0),
    _health_limit('warn_latency', 0.0, '99th percentile of the latency that gives WARN', 's'),
    _health_limit('error_latency', 0.0, '99th percentile of the latency that gives ERROR', 's'),
    _health_limit('joint_states_silence', 2.0, 'time without joint states of a joint that gives WARN, if seeds are '
                  'joint states', 's'),
    _health_limit('target_silence', 0.0, 'time without targets that gives WARN', 's'),
)  # fmt: skip
