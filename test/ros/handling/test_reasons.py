"""What a result says when a target fails or its seed is odd, without DDS."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from chains import chain
from rclpy.clock import ROSClock
from ros_helpers import CALM, joint_state, target_of

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.handling.result import FAILED, SOLVED, Result
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.input.joint_states import JointStates
from ros_ik_pkg.ros.interface.parameters import PARAMETERS, Settings

UR5, PLANAR = load_arm('ur5'), load_arm('planar3r')
START = np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])
DEGREES = np.array([0.3, -1.2, 80.0, -0.6, 57.3, 0.2])  # of the UR5: joints 2 and 4 are far outside +-2 pi


def result_of(arm, target: np.ndarray, positions: np.ndarray, **values) -> Result:
    """Return the result of a target (4, 4) with joint states at the positions (n,)."""
    defaults = {name: option.default for name, option in PARAMETERS.items()}
    settings = Settings.from_values(defaults | CALM | values)
    frames = SimpleNamespace(set_timeout=lambda timeout: None, why_not='TF is not asked here')
    handler = TargetHandler(ROSClock(), frames, JointStates(), lambda: 'no robot yet')
    handler.take_over(settings, arm)
    handler.joint_states.keep(joint_state(arm.joint_names, positions))
    return handler.handle(target_of(target), trace=False)


def tilted(arm) -> np.ndarray:
    """Return a pose that a planar arm reaches in x and y, but not in roll."""
    target = arm.forward(arm.home)
    target[:3, :3] = target[:3, :3] @ [[1.0, 0.0, 0.0], [0.0, 0.8, -0.6], [0.0, 0.6, 0.8]]
    return target


def test_a_full_pose_for_an_arm_of_few_joints_is_solved_and_the_reason_says_how_near_it_came():
    result = result_of(PLANAR, tilted(PLANAR), PLANAR.home + 0.1)
    assert (result.outcome, result.demanded_rows) == (SOLVED, ('x', 'y', 'z'))
    assert result.reason == (
        'within both tolerances in the demanded rows; in those wished for, rx ry rz, '
        f'{result.solution.wished_orientation_error:.3g} rad off'
    )


def test_a_full_pose_for_an_arm_of_few_joints_fails_with_both_numbers_and_the_remedy_if_all_rows_are_demanded():
    result = result_of(PLANAR, tilted(PLANAR), PLANAR.home + 0.1, secondary='none')
    assert result.outcome == FAILED
    assert 'the arm has 3 joints, fewer than the 6 rows of the task' in result.reason
    assert 'set secondary to orientation, set entries of task_weights to 0, or allow an error with' in result.reason


def test_the_remedy_for_an_arm_of_few_joints_solves_the_same_target():
    weights = [1, 1, 0, 0, 0, 1]
    assert result_of(PLANAR, tilted(PLANAR), PLANAR.home + 0.1, task_weights=weights).outcome == SOLVED


@pytest.mark.parametrize(('arm', 'weights'), [(UR5, [1] * 6), (PLANAR, [1, 1, 0, 0, 0, 1])])
def test_a_target_out_of_reach_of_an_arm_of_enough_joints_fails_without_a_word_about_rows(arm, weights):
    target = np.eye(4)
    target[0, 3] = 10.0
    result = result_of(arm, target, arm.home, task_weights=weights)
    assert result.outcome == FAILED and 'rows of the task' not in result.reason


def test_a_seed_in_degrees_is_noted_with_the_joints_concerned():
    result = result_of(UR5, UR5.forward(START), DEGREES)
    (note,) = (note for note in result.notes if 'degrees' in note)
    names = f'{UR5.joint_names[2]} = 80, {UR5.joint_names[4]} = 57.3'
    assert note == f'the seed looks like degrees; radians are expected: {names}'


@pytest.mark.parametrize('positions', [START, START + 2.0 * np.pi, START - 3.0 * np.pi])
def test_a_seed_within_two_turns_is_not_called_degrees(positions):
    assert not any('degrees' in note for note in result_of(UR5, UR5.forward(START), positions).notes)


def test_a_long_slide_is_not_called_degrees():
    arm = load_arm(chain(('slide', 'prismatic', {'lower': -1.0, 'upper': 1.0}), ('turn', 'revolute', {})))
    result = result_of(arm, arm.forward(arm.home), np.array([90.0, 0.1]))
    assert any('inside' in note for note in result.notes)
    assert not any('degrees' in note for note in result.notes)
