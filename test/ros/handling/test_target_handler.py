"""One target to one answer, without DDS: where solves and steps start, and what the node remembers."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rclpy.clock import ROSClock
from ros_helpers import CALM, joint_state, target_of

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ik.solver import use_usual
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.input.joint_states import JointStates
from ros_ik_pkg.ros.interface.parameters import PARAMETERS, Settings

UR5, PANDA = load_arm('ur5'), load_arm('panda')
MAX_STEP_TIME = 1e-3  # s
ROUNDING = 1e-12
START = np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])
STREAM = {'velocity_limiting': 'whole', 'max_step_time': MAX_STEP_TIME, 'seed_source': 'last_solution'}


def settings(**values) -> Settings:
    return Settings.from_values({name: option.default for name, option in PARAMETERS.items()} | CALM | values)


def handler_with(arm=UR5, **values) -> TargetHandler:
    frames = SimpleNamespace(set_timeout=lambda timeout: None, why_not='TF is not asked here')
    handler = TargetHandler(ROSClock(), frames, JointStates(), lambda: 'no robot yet')
    handler.take_over(settings(**values), arm)
    return handler


def command(handler: TargetHandler, target: np.ndarray) -> np.ndarray:
    """Return the joints (n,) that go out for a target (4, 4)."""
    result = handler.handle(target_of(target), trace=False)
    assert result.outcome == 'solved', result.reason
    return result.command.q


def lead_to_start(handler: TargetHandler, **values) -> None:
    """Let the node have told the arm to be at START, and know no joint state."""
    handler.joint_states.keep(joint_state(UR5.joint_names, START))
    handler.take_over(settings(), handler.arm)
    np.testing.assert_array_equal(command(handler, UR5.forward(START)), START)
    handler.joint_states = JointStates()
    handler.take_over(settings(**values), handler.arm)


def assert_one_step(q: np.ndarray, start: np.ndarray) -> None:
    assert 0.0 < np.max(np.abs(q - start) / UR5.velocity_limits) <= MAX_STEP_TIME + ROUNDING


def test_a_stream_goes_on_where_it_was_when_its_arm_is_loaded_again():
    handler = handler_with()
    lead_to_start(handler, **STREAM)
    handler.take_over(settings(**STREAM), load_arm('ur5'))
    assert_one_step(command(handler, UR5.forward(START + 0.5)), START)


def test_a_stream_goes_on_where_it_was_with_another_tip_and_back():
    handler = handler_with()
    lead_to_start(handler, **STREAM)
    shorter = load_arm('ur5', tip=UR5.tree.joint_named[UR5.joint_names[3]].child)
    assert shorter.joint_names == UR5.joint_names[:4]
    position_alone = {**STREAM, 'task_weights': [1, 1, 1, 0, 0, 0]}
    handler.take_over(settings(**position_alone), shorter)
    q = command(handler, shorter.forward(START[:4] + 0.5))
    assert 0.0 < np.max(np.abs(q - START[:4]) / shorter.velocity_limits) <= MAX_STEP_TIME + ROUNDING
    handler.take_over(settings(**STREAM), None)  # as where the frames are set one at a time
    handler.take_over(settings(**STREAM), UR5)
    assert_one_step(command(handler, UR5.forward(START + 0.5)), np.concatenate([q, START[4:]]))


def test_another_robot_begins_at_home():
    handler = handler_with()
    lead_to_start(handler, **STREAM)
    other = replace(load_arm('ur5'), name='other')
    handler.take_over(settings(**STREAM), other)
    assert_one_step(command(handler, UR5.forward(START)), UR5.home)


@pytest.mark.parametrize('values', [{'seed_source': 'home'}, {'seed_source': 'joint_states',
                                                              'home_until_joint_states': True}])  # fmt: skip
def test_without_joint_states_limited_steps_from_home_go_on_from_the_last_and_arrive(values):
    handler = handler_with(**{**STREAM, **values, 'max_step_time': 0.1})
    target, before = UR5.forward(START), UR5.home
    for _ in range(1000):
        result = handler.handle(target_of(target), trace=False)
        assert np.max(np.abs(result.command.q - before) / UR5.velocity_limits) <= result.command.step_time + ROUNDING
        before = result.command.q
        if result.command.fraction == 1.0:
            break
        handler._commands._timer.restart()  # as if a long time had gone by
    np.testing.assert_allclose(UR5.forward(before), target, atol=2e-5)


def go_round(handler: TargetHandler, q: np.ndarray, rounds: int = 1) -> np.ndarray:
    """Lead the tip of the panda round a square and back, from the joints q (n,); return where the joints are then."""
    corners = [(0.0, 0.2), (0.2, 0.2), (0.2, 0.0), (0.0, 0.0)]
    for x, y in corners * rounds:
        target = PANDA.forward(q)
        target[:2, 3] += x, y
        result = handler.handle(target_of(target), trace=False)
        assert result.outcome == 'solved', result.reason
    return result.command.q


def holding(q: np.ndarray, **values) -> TargetHandler:
    """Return a node's handler that has been at the joints q (n,) of the panda."""
    handler = handler_with(PANDA, seed_source='last_solution')
    handler._commands.last = q
    handler.take_over(settings(seed_source='last_solution', null_space='posture', **values), PANDA)
    return handler


def test_an_empty_posture_brings_joints_back_from_a_closed_path():
    q = PANDA.home + 0.1
    np.testing.assert_allclose(go_round(holding(q), q, rounds=3), q, atol=1e-3)


def test_an_empty_posture_is_held_through_changes_of_other_parameters_and_not_of_the_arm():
    q = PANDA.home + 0.1
    handler = holding(q)
    assert handler.handle(target_of(PANDA.forward(q)), trace=False).outcome == 'solved'
    held = handler.settings.options.posture
    handler.take_over(settings(null_space='posture', seed_source='home', method='dls'), PANDA)
    handler.handle(target_of(PANDA.forward(q)), trace=False)
    assert handler.settings.options.posture == held == tuple(q)
    assert handler.parameters.options.posture == ()
    handler.take_over(handler.parameters, load_arm('panda'))
    handler.handle(target_of(PANDA.forward(q)), trace=False)
    assert handler.settings.options.posture == tuple(PANDA.home)
    for values in ({'null_space': 'none'}, {'null_space': 'posture', 'posture': [0.5] * 7}):
        handler.take_over(settings(**values), handler.arm)
        assert handler.settings.options.posture == tuple(values.get('posture', ()))


def test_a_seed_beyond_all_sense_is_not_held():
    handler = handler_with(null_space='posture')
    for q in (START + 1e9, START):
        handler.joint_states.keep(joint_state(UR5.joint_names, q))
        handler.handle(target_of(UR5.forward(START)), trace=False)
    assert handler.settings.options.posture == tuple(START)


@pytest.mark.parametrize(
    ('names', 'positions', 'words'),
    [
        (UR5.joint_names, [np.nan, *START[1:]], f'position nan of {UR5.joint_names[0]}'),
        (UR5.joint_names, START[1:], '6 names, 5 positions'),
        ([*UR5.joint_names, UR5.joint_names[0]], [*START, 0.0], f'{UR5.joint_names[0]} more than once'),
    ],
)
def test_a_target_in_a_frame_of_the_robot_is_refused_with_what_is_wrong_with_the_joint_states(names, positions, words):
    handler = handler_with(seed_source='home')
    target = target_of(np.eye(4), 'link2')
    handler.joint_states.keep(joint_state(UR5.joint_names, START))
    assert handler.handle(target, trace=False).outcome != 'refused'
    handler.joint_states.keep(joint_state(names, positions))
    result = handler.handle(target, trace=False)
    assert (result.outcome, result.status) == ('refused', 'joint_states') and words in result.reason
    assert handler.handle(target_of(np.eye(4), UR5.base_frame), trace=False).outcome != 'refused'


def test_the_joints_to_a_frame_are_those_whose_positions_place_it():
    assert UR5.joints_to(UR5.base_frame) == ()
    assert UR5.joints_to('link2') == UR5.joint_names[:2]


def test_limited_steps_from_home_start_at_the_joint_state_where_it_is_known():
    handler = handler_with(**{**STREAM, 'seed_source': 'home'})
    for second, start in enumerate((START, START + 0.3), 1):
        state = joint_state(UR5.joint_names, start)
        state.header.stamp.sec = second  # or the joints could not have moved so far
        handler.joint_states.keep(state)
        assert_one_step(command(handler, UR5.forward(START + 0.1)), start)


def test_a_target_that_needs_what_is_not_compiled_yet_is_refused_with_that_reason():
    handler = handler_with(null_space='posture', seed_source='home')
    use_usual(True)
    try:
        result = handler.handle(target_of(UR5.forward(START)), trace=False)
    finally:
        use_usual(False)
    assert (result.outcome, result.status) == ('refused', 'compiling')
    assert 'still being compiled' in result.reason
    assert handler.handle(target_of(UR5.forward(START)), trace=False).outcome == 'solved'
