"""Health of the node for /diagnostics: what happened in the last second, and how long it took."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus

from ros_ik_pkg.ros.answer import FAILED, INTERNAL_ERROR, SOLVED, Answer, shorten
from ros_ik_pkg.ros.statuses import key_values


@dataclass
class Health:
    """Counts answers; `report` closes a period and begins the next."""

    failed: Counter[str] = field(default_factory=Counter)  # by cause
    refused: Counter[str] = field(default_factory=Counter)
    latencies: list[float] = field(default_factory=list)  # s, target taken to answer published
    solve_times: list[float] = field(default_factory=list)  # s
    internal_errors: int = 0
    last_error: str = ''

    def count(self, answer: Answer, latency: float) -> None:
        """Take note of one answer."""
        self.latencies.append(latency)
        if answer.solution is not None:
            self.solve_times.append(answer.solution.solve_time)
        if answer.outcome != SOLVED:
            counter = self.failed if answer.outcome == FAILED else self.refused
            counter[answer.cause] += 1
            self.last_error = shorten(answer.reason)
        self.internal_errors += answer.cause == INTERNAL_ERROR

    def report(self, name: str, hardware_id: str, waiting: str, period: float) -> DiagnosticStatus:
        """Return the status of the last `period` [s]; `waiting` says what is missing, if anything."""
        level, message = self._judge(waiting)
        values = key_values(self._figures(period))
        self._begin_period()
        return DiagnosticStatus(
            level=level, name=name, message=message, hardware_id=hardware_id, values=values
        )

    def _begin_period(self) -> None:
        """Forget the figures; the last error stays."""
        for figures in (self.failed, self.refused, self.latencies, self.solve_times):
            figures.clear()
        self.internal_errors = 0

    def _judge(self, waiting: str) -> tuple[bytes, str]:
        count, failed, refused = len(self.latencies), self.failed.total(), self.refused.total()
        if self.internal_errors:
            return DiagnosticStatus.ERROR, f'{self.internal_errors} targets met an internal error'
        if waiting:
            return DiagnosticStatus.WARN, waiting
        if failed or refused:
            return DiagnosticStatus.WARN, f'of {count} targets {failed} failed, {refused} refused'
        return DiagnosticStatus.OK, f'{count} targets solved' if count else 'no targets'

    def _figures(self, period: float) -> dict[str, Any]:
        """Rates [1/s], times [s] and what went wrong how often."""
        count = len(self.latencies)
        return {
            'targets_per_second': round(count / period, 1),
            'solved_per_second': round((count - self.failed.total() - self.refused.total()) / period, 1),
            **{f'failed.{cause}': number for cause, number in self.failed.items()},
            **{f'refused.{cause}': number for cause, number in self.refused.items()},
            'latency_p50': _percentile(self.latencies, 50),
            'latency_p99': _percentile(self.latencies, 99),
            'solve_time_p50': _percentile(self.solve_times, 50),
            'solve_time_p99': _percentile(self.solve_times, 99),
            'last_error': self.last_error,
        }


def _percentile(values: list[float], percent: float) -> float:
    """Return the percentile [s], NaN of nothing."""
    return round(float(np.percentile(values, percent)), 7) if values else float('nan')
