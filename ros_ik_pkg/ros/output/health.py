"""Health of the node for /diagnostics: results, latencies and problems of the last second."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus

from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.handling.result import FAILED, INTERNAL_ERROR, SOLVED, Result
from ros_ik_pkg.ros.interface.health_limits import HealthLimits
from ros_ik_pkg.ros.output.statuses import key_values

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


@dataclass
class Health:
    """Counts results; `report` closes a period and begins the next."""

    failed: Counter[str] = field(default_factory=Counter)  # by cause
    refused: Counter[str] = field(default_factory=Counter)
    latencies: list[float] = field(default_factory=list)  # s, target taken to answer published
    solve_times: list[float] = field(default_factory=list)  # s
    clearances: list[float] = field(default_factory=list)  # m, of commands, if contact counts
    internal_errors: int = 0
    last_error: str = ''
    last_error_time: float = math.nan  # s, arrival of its target
    last_target: float = field(default_factory=time.monotonic)  # s; the start, before the first

    def count(self, result: Result, latency: float) -> None:
        """Count one result."""
        self.last_target = time.monotonic()
        self.latencies.append(latency)
        if result.solution is not None:
            self.solve_times.append(result.solution.solve_time)
            if result.room is not None and result.outcome == SOLVED:
                self.clearances.append(result.clearance)
        if result.outcome != SOLVED:
            counter = self.failed if result.outcome == FAILED else self.refused
            counter[result.status] += 1
            self.last_error, self.last_error_time = shorten(result.reason), self.last_target
        self.internal_errors += result.status == INTERNAL_ERROR

    def report(
        self,
        limits: HealthLimits,
        period: float,
        waiting: str = '',
        joint_states_age: float | None = None,
        doubts: tuple[int, str] = (0, ''),
    ) -> DiagnosticStatus:
        """Return the status of the last `period` [s], the measured time since the last report.

        waiting: what is missing, if anything. joint_states_age: age of the joint states [s], infinite if none has
        arrived, None if they are not needed. doubts: for how many targets the joint states were doubted, and why.
        """
        ages = {'joint_states_age': joint_states_age, 'target_age': time.monotonic() - self.last_target}
        level, message = self._judge(limits, waiting, doubts, **ages)
        figures = {**self._figures(period), 'joint_states_not_believed': doubts[0]}
        values = key_values({**figures, **{name: _rounded(age) for name, age in ages.items()}})
        self._begin_period()
        return DiagnosticStatus(level=level, message=message, values=values)

    def _begin_period(self) -> None:
        """Forget the figures; the last error stays."""
        for figures in (self.failed, self.refused, self.latencies, self.solve_times, self.clearances):
            figures.clear()
        self.internal_errors = 0

    def _judge(
        self, limits: HealthLimits, waiting: str, doubts: tuple[int, str], **ages: float | None
    ) -> tuple[bytes, str]:
        """Return the highest level of all findings, and their texts, the worst first."""
        found = [*self._answers(limits), *_inputs(limits, waiting, **ages)]
        if doubts[0]:
            found.append((WARN, doubts[1]))
        worst = max(level for level, _ in found)
        amiss = [text for level, text in sorted(found, reverse=True, key=lambda finding: finding[0]) if level != OK]
        return worst, '; '.join(amiss) or found[0][1]

    def _answers(self, limits: HealthLimits) -> Iterator[tuple[bytes, str]]:
        """Yield level and text of findings about results."""
        count, failed, refused = len(self.latencies), self.failed.total(), self.refused.total()
        if failed or refused:
            level = _level((failed + refused) / count, limits.warn_failed_ratio, limits.error_failed_ratio)
            yield level, f'of {count} targets {failed} failed, {refused} refused'
        else:
            yield OK, f'{count} target{"s" if count > 1 else ""} solved' if count else 'no targets'
        latency = _percentile(self.latencies, 99)
        yield _level(latency, limits.warn_latency, limits.error_latency), f'latency p99 {1e3 * latency:.3g} ms'
        if self.internal_errors:
            yield ERROR, f'internal errors: {self.internal_errors}'

    def _figures(self, period: float) -> dict[str, Any]:
        """Return rates [1/s], times [s] and counts of failures."""
        count = len(self.latencies)
        return {
            'targets_per_second': round(count / period, 1),
            'solved_per_second': round((count - self.failed.total() - self.refused.total()) / period, 1),
            **{f'failed.{status}': number for status, number in self.failed.items()},
            **{f'refused.{status}': number for status, number in self.refused.items()},
            'latency_p50': _percentile(self.latencies, 50),
            'latency_p99': _percentile(self.latencies, 99),
            'solve_time_p50': _percentile(self.solve_times, 50),
            'solve_time_p99': _percentile(self.solve_times, 99),
            'clearance_min': round(min(self.clearances, default=math.nan), 6),
            'last_error': self.last_error,
            'last_error_age': round(time.monotonic() - self.last_error_time, 3),
        }


def _inputs(
    limits: HealthLimits, waiting: str, joint_states_age: float | None, target_age: float
) -> Iterator[tuple[bytes, str]]:
    """Yield level and text of findings about inputs; as in diagnostic_updater, silence is a WARN.

    The level STALE is for the aggregator to give to a node that reports nothing at all.
    """
    if waiting:
        yield WARN, waiting
    if joint_states_age is not None:
        text = f'no joint states for {joint_states_age:.1f} s'
        if not math.isfinite(joint_states_age):
            text = 'not every joint has reported a position yet'
        yield _level(joint_states_age, limits.joint_states_silence), text
    yield _level(target_age, limits.target_silence), f'no target for {target_age:.1f} s'


def _level(value: float, warn: float, error: float = 0.0) -> bytes:
    """Return the level of a value; a limit of 0 is none, and NaN exceeds no limit."""
    if error and value >= error:
        return ERROR
    return WARN if warn and value >= warn else OK


def _percentile(values: list[float], percent: float) -> float:
    """Return the percentile [s], or NaN without values."""
    return round(float(np.percentile(values, percent)), 7) if values else float('nan')


def _rounded(age: float | None) -> float:
    return float('nan') if age is None else round(age, 3)
