"""Targets of two tips become commands of both arms, or a refusal with its reason; without DDS."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from rclpy.clock import ROSClock
from ros_helpers import CALM, joint_state, target_of
from std_msgs.msg import Header
from two_arms import TIPS, get_arms, off, poses, robot_text

from ros_ik_pkg.ik import IkError
from ros_ik_pkg.ik.solution import FIGURES
from ros_ik_pkg.ros.handling import tip_targets
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.handling.tip_targets import HELD, TipTargets
from ros_ik_pkg.ros.input.joint_states import JointStates
from ros_ik_pkg.ros.input.robot_source import RobotSource
from ros_ik_pkg.ros.interface.parameters import PARAMETERS, Settings

ARMS = get_arms()
START, GOAL = 0.2 * np.ones(ARMS.n), 0.3 * np.ones(ARMS.n)
SILENT = SimpleNamespace(get_logger=lambda: SimpleNamespace(info=lambda text: None, error=print))


def settings(**values) -> Settings:
    defaults = {name: option.default for name, option in PARAMETERS.items()}
    own = {'robot': '', 'robot_description': robot_text(True), 'tip_frames': TIPS}
    return Settings.from_values(defaults | CALM | own | values)


def tips_with(**values) -> TipTargets:
    """Return what answers targets at START, in the joint states."""
    frames = SimpleNamespace(set_timeout=lambda timeout: None, why_not='TF is not asked here')
    handler, source = TargetHandler(ROSClock(), frames, JointStates(), lambda: 'no robot yet'), RobotSource('/d')
    found = settings(**values)
    tips = TipTargets(SILENT, handler, source, lambda result, arrived: None)
    arm = source.load(found)
    tips.prepare(found, True)
    handler.take_over(found, arm)
    tips.take_over()
    handler.joint_states.keep(joint_state(ARMS.joint_names, START))
    return tips


def solved(tips: TipTargets, tip: int, pose: np.ndarray, frame: str = ''):
    result = tips.handle(tip, target_of(pose, frame))
    assert result.outcome == 'solved', result.reason
    return result


def assert_at(q, first, second):
    for target, pose in zip((first, second), poses(ARMS, q)):
        assert max(off(target, pose)) < 1.1e-5


def test_a_tip_without_a_target_is_held_and_then_goes_where_it_is_told():
    tips, (left, right) = tips_with(), poses(ARMS, GOAL)
    result = solved(tips, 0, left)
    assert_at(result.command.q, left, poses(ARMS, START)[1])
    assert HELD in result.notes
    result = solved(tips, 1, right)
    assert_at(result.command.q, left, right)
    assert HELD not in result.notes


def test_a_first_target_in_the_frame_of_the_second_tip_is_relative():
    tips, (left, right) = tips_with(), poses(ARMS, GOAL)
    right_from_left = np.linalg.inv(right) @ left
    result = solved(tips, 0, right_from_left, TIPS[1])
    here = poses(ARMS, START)[1]
    assert_at(result.command.q, here @ right_from_left, here)
    result = solved(tips, 1, right)  # the first tip goes along
    assert_at(result.command.q, left, right)


def test_a_target_in_any_frame_of_the_robot_is_where_the_joint_states_have_it():
    tips, (left, _) = tips_with(), poses(ARMS, GOAL)
    base_from_torso = ARMS.arms[0].base_from_frame('torso', dict(zip(ARMS.joint_names, START)))
    result = solved(tips, 0, np.linalg.inv(base_from_torso) @ left, 'torso')
    assert_at(result.command.q, left, poses(ARMS, START)[1])


def test_seeds_come_from_where_seed_source_says():
    left, _ = poses(ARMS, GOAL)
    assert tips_with(seed_source='home').handle(0, target_of(left)).seed is not None
    tips = tips_with(seed_source='last_solution')
    first = solved(tips, 0, left)
    np.testing.assert_array_equal(first.seed, ARMS.home)
    np.testing.assert_array_equal(solved(tips, 0, left).seed, first.command.q)


@pytest.mark.parametrize('wrong', ['tip', 'limit', 'nan'])
@pytest.mark.parametrize('relative', [False, True])
def test_an_answer_that_is_wrong_for_one_tip_does_not_go_out(monkeypatch, wrong, relative):
    tips, (left, right) = tips_with(), poses(ARMS, GOAL)
    true_solve = tip_targets.solve_tips

    def broken(*args, **others):
        solution = true_solve(*args, **others)
        place = ARMS.joint_names.index('right_j2')
        solution.row[place] = {'tip': solution.row[place] + 1e-4, 'limit': 9.0, 'nan': np.nan}[wrong]
        return solution

    monkeypatch.setattr(tip_targets, 'solve_tips', broken)
    pose, frame = (np.linalg.inv(right) @ left, TIPS[1]) if relative else (left, '')
    result = tips.handle(0, target_of(pose, frame))
    assert (result.outcome, result.status) == ('failed', 'internal_error')
    assert 'final check' in result.reason
    assert result.command is None


def test_a_target_that_failed_is_not_what_its_tip_is_held_at_later():
    tips, (left, right) = tips_with(), poses(ARMS, GOAL)
    far = left.copy()
    far[0, 3] = 9.0
    assert tips.handle(0, target_of(far)).outcome == 'failed'
    assert_at(solved(tips, 1, right).command.q, poses(ARMS, START)[0], right)


def test_a_frame_is_placed_with_two_tips_too():
    tips = tips_with()
    header = Header(frame_id='torso')
    expected = ARMS.arms[0].base_from_frame('torso', dict(zip(ARMS.joint_names, START)))
    np.testing.assert_allclose(tips._handler.base_from_header(header), expected, atol=1e-12)


def test_a_pair_out_of_reach_fails_with_the_reason_and_commands_nothing():
    tips, (left, _) = tips_with(), poses(ARMS, GOAL)
    left[0, 3] += 9.0
    result = tips.handle(0, target_of(left))
    assert (result.outcome, result.status, result.command) == ('failed', 'unreachable', None)
    assert 'further off' in result.reason
    assert len(result.solution.row) == ARMS.n + len(FIGURES)


def test_without_joint_states_and_without_tips_targets_are_refused():
    tips = tips_with()
    tips._handler.joint_states = JointStates()
    assert tips.handle(0, target_of(np.eye(4))).status == 'joint_states'
    tips = tips_with(tip_frames=(), tip_frame='left_tip')
    assert tips.handle(1, target_of(np.eye(4))).status == 'no_tips'


def test_targets_of_one_tip_are_refused_while_there_are_two():
    tips = tips_with()
    result = tips._handler.handle(target_of(np.eye(4)), trace=False)
    assert (result.outcome, result.status) == ('refused', 'tip_frames')


@pytest.mark.parametrize(
    ('values', 'reason'),
    [
        ({'velocity_limiting': 'whole'}, 'velocity_limiting'),
        ({'out_of_reach': 'closest'}, 'out_of_reach'),
        ({'compare': ('all',)}, 'compare'),
        ({'command_rate': 100.0}, 'command_rate'),
        ({'null_space': 'limits'}, 'null_space'),
        ({'joint_weights': (1.0,) * 9}, 'expected 16'),
        ({'tip_frames': ('left_tip',)}, 'two different links'),
        ({'tip_frames': ('left_tip', 'nowhere')}, 'nowhere'),
    ],
)
def test_what_is_for_one_tip_only_is_refused_with_two(values, reason):
    with pytest.raises(IkError, match=reason):
        tips_with(**values)
