"""The health summary counts what happened since the last one."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from ros_helpers import Client, allow_lark, connected, joint_state, pose_of

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.handling.result import FAILED, INTERNAL_ERROR, REFUSED, SOLVED, Result
from ros_ik_pkg.ros.input.joint_states import JointStates
from ros_ik_pkg.ros.input.target import UNREAD
from ros_ik_pkg.ros.interface.health_limits import HealthLimits
from ros_ik_pkg.ros.interface.parameters import PARAMETERS, Settings
from ros_ik_pkg.ros.output.health import Health

NEVER = HealthLimits(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
DEFAULTS = Settings.from_values({name: option.default for name, option in PARAMETERS.items()}).health_limits
OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


def health_after(
    *outcomes: tuple[str, str], limits: HealthLimits = DEFAULTS, **missing
) -> tuple[Health, DiagnosticStatus]:
    health = Health()
    for number, (outcome, status) in enumerate(outcomes):
        result = Result(UNREAD, outcome, status, f'because of {status}', 'dls')
        health.count(result, 0.001 * (number + 1))
    return health, health.report(limits, 2.0, **missing)


def figures(status: DiagnosticStatus) -> dict[str, str]:
    return {pair.key: pair.value for pair in status.values}


def test_rates_causes_and_latencies_are_those_of_the_period():
    outcomes = [(SOLVED, 'converged')] * 3 + [(FAILED, 'stalled'), (REFUSED, 'frame'), (REFUSED, 'frame')]
    health, status = health_after(*outcomes)
    assert (status.level, status.message) == (WARN, 'of 6 targets 1 failed, 2 refused')
    values = figures(status)
    assert (values['targets_per_second'], values['solved_per_second']) == ('3.0', '1.5')
    assert (values['failed.stalled'], values['refused.frame']) == ('1', '2')
    assert float(values['latency_p50']) == 0.0035
    assert values['last_error'] == 'because of frame'
    quiet = figures(health.report(DEFAULTS, 2.0))
    assert quiet['targets_per_second'] == '0.0' and 'refused.frame' not in quiet
    assert math.isnan(float(quiet['latency_p50']))


def test_the_last_error_stays_with_its_age(monkeypatch):
    assert figures(health_after((SOLVED, 'converged'))[1])['last_error_age'] == 'nan'
    health, status = health_after((SOLVED, 'converged'), (REFUSED, 'frame'))
    assert 0.0 <= float(figures(status)['last_error_age']) < 60.0
    began = health.last_error_time
    health.count(Result(UNREAD, SOLVED, 'converged', 'within tolerance', 'dls'), 0.001)
    monkeypatch.setattr('time.monotonic', lambda: began + 90.0)
    later = figures(health.report(DEFAULTS, 2.0))
    assert (later['last_error'], later['last_error_age']) == ('because of frame', '90.0')


def test_solved_targets_or_none_are_fine():
    assert health_after()[1].level == OK
    assert health_after((SOLVED, 'converged'))[1].level == OK


@pytest.mark.parametrize(('solved', 'level'), [(0, ERROR), (1, WARN)])
def test_a_node_that_answers_no_target_at_all_is_an_error_unless_told_otherwise(solved, level):
    outcomes = [(REFUSED, 'joint_states'), (FAILED, 'stalled'), *[(SOLVED, 'converged')] * solved]
    assert health_after(*outcomes)[1].level == level


def test_an_internal_error_goes_before_all_else_and_waiting_is_told():
    both = health_after((FAILED, INTERNAL_ERROR), waiting='no robot', limits=NEVER)[1]
    assert (both.level, both.message) == (ERROR, 'internal errors: 1; no robot')
    waiting = health_after(waiting='no robot', limits=NEVER)[1]
    assert (waiting.level, waiting.message) == (WARN, 'no robot')


HALF = [(SOLVED, 'converged'), (FAILED, 'stalled')]  # latencies 1 and 2 ms


@pytest.mark.parametrize(
    ('changes', 'level'),
    [
        ({}, OK),
        ({'warn_failed_ratio': 0.51}, OK),
        ({'warn_failed_ratio': 0.5}, WARN),
        ({'warn_failed_ratio': 0.1, 'error_failed_ratio': 0.6}, WARN),
        ({'warn_failed_ratio': 0.1, 'error_failed_ratio': 0.5}, ERROR),
        ({'warn_latency': 0.0021}, OK),
        ({'warn_latency': 0.0019}, WARN),
        ({'warn_latency': 0.001, 'error_latency': 0.0019}, ERROR),
        ({'error_latency': 0.0019, 'warn_failed_ratio': 0.1}, ERROR),
    ],
)
def test_the_level_follows_the_limits_and_0_is_no_limit(changes, level):
    status = health_after(*HALF, limits=replace(NEVER, **changes))[1]
    assert status.level == level
    assert ('failed' in status.message) == (level == OK or 'warn_failed_ratio' in changes)
    assert ('latency' in status.message) == (level != OK and not {'warn_latency', 'error_latency'}.isdisjoint(changes))


def test_joint_states_that_stopped_or_never_came_are_a_warning_with_their_age():
    fresh = health_after(joint_states_age=1.9)[1]
    assert fresh.level == OK and figures(fresh)['joint_states_age'] == '1.9'
    old = health_after(joint_states_age=2.5)[1]
    assert (old.level, old.message) == (WARN, 'no joint states for 2.5 s')
    never = health_after(joint_states_age=math.inf)[1]
    assert (never.level, never.message) == (WARN, 'not every joint has reported a position yet')
    assert health_after(joint_states_age=math.inf, limits=NEVER)[1].level == OK


def test_targets_that_stopped_are_a_warning_where_it_is_wanted():
    health, status = health_after((SOLVED, 'converged'), limits=replace(NEVER, target_silence=5.0))
    assert status.level == OK and float(figures(status)['target_age']) < 5.0
    health.last_target -= 6.0
    silent = health.report(replace(NEVER, target_silence=5.0), 1.0)
    assert silent.level == WARN and silent.message.startswith('no target for 6.')
    assert health.report(NEVER, 1.0).level == OK


def test_the_age_of_joint_states_is_that_of_the_oldest_position(monkeypatch):
    states, clock = JointStates(), iter((10.0, 20.0, 21.0, 25.0, 25.0, 25.0))
    monkeypatch.setattr('time.monotonic', lambda: next(clock))
    states.keep(joint_state('ab', [1, 2]))
    states.keep(joint_state('b', [2]))
    states.keep(joint_state('cx', [3, 4]))
    assert states.age(['a', 'b']) == 15.0
    assert states.age(['b', 'c']) == 5.0
    assert states.age(['c', 'd']) == math.inf
    assert states.age(['c']) == 4.0


@pytest.mark.newest
@allow_lark
def test_a_running_node_says_that_joint_states_stopped_and_takes_new_limits(tmp_path):
    arm = load_arm('puma560')

    def warns(text: str) -> bool:
        return any(status.level == WARN and text in status.message for status in client.health)

    silence = 'diagnostics.joint_states_silence'
    with connected(Client, tmp_path / 'log', '-p', f'{silence}:=0.5') as client:
        never = 'not every joint has reported a position yet'
        client.wait_for(lambda: warns(never), 'a warning before the first joint state')
        home = joint_state(arm.joint_names, arm.home)
        client.settle(pose_of(arm.forward(arm.home)), lambda reply: reply.solved, home)
        client.wait_for(lambda: warns('no joint states for '), 'a warning after the last joint state')
        client.set_parameters({'seed_source': 'home', 'diagnostics.target_silence': 0.1})
        client.wait_for(lambda: warns('no target for '), 'a warning after the last target')
        assert 'warn_failed_ratio' in client.refusal_of(**{'diagnostics.warn_failed_ratio': 1.1})
