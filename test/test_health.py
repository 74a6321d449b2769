"""The health summary counts what happened since the last one."""

from __future__ import annotations

import math

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped

from ros_ik_pkg.ros.answer import FAILED, INTERNAL_ERROR, REFUSED, SOLVED, Answer
from ros_ik_pkg.ros.health import Health


def health_after(*outcomes: tuple[str, str], waiting: str = '') -> tuple[Health, DiagnosticStatus]:
    health = Health()
    for number, (outcome, cause) in enumerate(outcomes):
        answer = Answer(PoseStamped(), outcome, cause, f'because of {cause}', 'dls')
        health.count(answer, 0.001 * (number + 1))
    return health, health.report('node', 'arm', waiting, 2.0)


def figures(status: DiagnosticStatus) -> dict[str, str]:
    return {pair.key: pair.value for pair in status.values}


def test_rates_causes_and_latencies_are_those_of_the_period():
    outcomes = [(SOLVED, 'converged')] * 3 + [(FAILED, 'stalled'), (REFUSED, 'frame'), (REFUSED, 'frame')]
    health, status = health_after(*outcomes)
    assert status.level == DiagnosticStatus.WARN
    values = figures(status)
    assert (values['targets_per_second'], values['solved_per_second']) == ('3.0', '1.5')
    assert (values['failed.stalled'], values['refused.frame']) == ('1', '2')
    assert float(values['latency_p50']) == 0.0035
    assert values['last_error'] == 'because of frame'
    quiet = figures(health.report('node', 'arm', '', 2.0))
    assert quiet['targets_per_second'] == '0.0' and 'refused.frame' not in quiet
    assert math.isnan(float(quiet['latency_p50'])) and quiet['last_error'] == 'because of frame'


def test_solved_targets_or_none_are_fine():
    assert health_after()[1].level == DiagnosticStatus.OK
    assert health_after((SOLVED, 'converged'))[1].level == DiagnosticStatus.OK


def test_an_internal_error_goes_before_all_else_and_waiting_is_told():
    assert health_after((FAILED, INTERNAL_ERROR), waiting='no robot')[1].level == DiagnosticStatus.ERROR
    waiting = health_after(waiting='no robot')[1]
    assert (waiting.level, waiting.message) == (DiagnosticStatus.WARN, 'no robot')
