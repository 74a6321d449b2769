"""The final check lets good solutions through and stops all others, whatever the solver calls them."""

from __future__ import annotations

import resource
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from ros_ik_pkg.ik import SolveOptions, load_arm
from ros_ik_pkg.ros.handling.final_check import fault_of

ARM = load_arm('puma560')
OPTIONS = SolveOptions(position_tolerance=1e-4, orientation_tolerance=1e-3)
TARGET = ARM.forward(ARM.home)


def moved(x: float = 0.0, turn: float = 0.0) -> np.ndarray:
    """Return the target moved along x [m] and turned about z of the base [rad]."""
    target = TARGET.copy()
    c, s = np.cos(turn), np.sin(turn)
    target[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ target[:3, :3]
    target[0, 3] += x
    return target


def test_an_answer_within_tolerance_and_limits_passes():
    for target in (TARGET, moved(x=0.99e-4), moved(turn=0.99e-3)):
        assert fault_of(ARM.home, target, ARM, OPTIONS) == ''


@pytest.mark.parametrize(
    ('q', 'target', 'words'),
    [
        (ARM.home, moved(x=1.01e-4), '0.000101 m off'),
        (ARM.home, moved(turn=1.01e-3), '0.00101 rad off'),
        (ARM.home, moved(turn=np.pi), '3.14 rad off'),
        (np.where(np.arange(ARM.n) == 2, np.nan, ARM.home), TARGET, 'not finite'),
        (ARM.home + 100.0 * (np.arange(ARM.n) == 5), TARGET, 'joint6 outside the limits'),
    ],
)
def test_any_other_answer_is_stopped(q, target, words):
    assert words in fault_of(q, target, ARM, OPTIONS)


def test_limits_count_only_where_they_are_to_be_respected():
    free = SolveOptions(respect_limits=False)
    q = ARM.home + 2.0 * np.pi * (np.arange(ARM.n) == 0)
    assert (q > ARM.upper).any()
    assert fault_of(q, TARGET, ARM, free) == ''


def test_rows_of_weight_zero_are_not_part_of_the_task():
    position_only = SolveOptions(task_weights=(1, 1, 1, 0, 0, 0))
    assert fault_of(ARM.home, moved(turn=1.0), ARM, position_only) == ''
    assert 'm off' in fault_of(ARM.home, moved(x=1.0), ARM, position_only)


@pytest.mark.parametrize('angle', [np.pi - 1e-3, np.pi - 1e-9, np.pi])
def test_an_axis_that_is_free_may_be_off_by_half_a_turn(angle):
    arm = load_arm('panda')
    options = SolveOptions(task_weights=(1, 1, 1, 1, 1, 0), task_frame='tip')
    turned = arm.forward(arm.home)
    turned[:3, :3] = turned[:3, :3] @ pin.exp3(np.array([0.0, 0.0, angle]))
    assert fault_of(arm.home, turned, arm, options) == ''
    turned[:3, :3] = turned[:3, :3] @ pin.exp3(np.array([0.02, 0.0, 0.0]))
    assert 'turned' in fault_of(arm.home, turned, arm, options)


def test_what_is_within_a_row_s_tolerance_is_no_fault():
    arm = load_arm('panda')
    target = arm.forward(arm.home)
    target[0, 3] += 0.009
    assert fault_of(arm.home, target, arm, SolveOptions(task_tolerances=(0.01, 0, 0, 0, 0, 0))) == ''
    assert '0.001 m off' in fault_of(arm.home, target, arm, SolveOptions(task_tolerances=(0.008, 0, 0, 0, 0, 0)))


def resident() -> int:
    """Return how much memory this process holds [bytes]."""
    return int(Path('/proc/self/statm').read_text().split()[1]) * resource.getpagesize()


def test_judging_many_answers_takes_no_memory():
    # pinocchio.Quaternion(matrix) would lose 80 bytes each time.
    target, options = ARM.forward(ARM.home), SolveOptions(task_weights=(1, 1, 1, 1, 1, 0))
    for _ in range(1000):
        fault_of(ARM.home, target, ARM, options)
    before = resident()
    for _ in range(100_000):
        fault_of(ARM.home, target, ARM, options)
    assert resident() - before < 4e6
