"""Joint states whose velocities or efforts are odd, without DDS."""

from __future__ import annotations

import numpy as np
import pytest
from ros_helpers import joint_state

from ros_ik_pkg.ros.input.joint_states import JointStates

NAMES, POSITIONS = ('one', 'two', 'three'), (0.1, -0.2, 0.3)


def with_lengths(velocities: int, efforts: int, names=NAMES):
    """Return a message with positions of every joint and other arrays of these lengths."""
    message = joint_state(names, POSITIONS)
    message.velocity, message.effort = [0.0] * velocities, [0.0] * efforts
    return message


@pytest.mark.parametrize(('velocities', 'efforts'), [(2, 0), (0, 4), (3, 1)])
def test_positions_are_taken_beside_arrays_of_another_length_which_are_noted_once(velocities, efforts):
    joint_states, notes = JointStates('/robot/joint_states'), []
    for _ in range(3):
        joint_states.keep(with_lengths(velocities, efforts))
        np.testing.assert_array_equal(joint_states.seed(NAMES), POSITIONS)
        notes += joint_states.take_notes()
    assert notes == [f'/robot/joint_states has 3 names, {velocities} velocities and {efforts} efforts; '
                     'the positions were taken']  # fmt: skip


def test_each_publisher_with_arrays_of_another_length_is_noted():
    joint_states = JointStates()
    for names in (NAMES, ('four', 'five', 'six')):
        joint_states.keep(with_lengths(1, 0, names))
    assert len(joint_states.take_notes()) == 2


@pytest.mark.parametrize(('velocities', 'efforts'), [(0, 0), (3, 0), (0, 3), (3, 3)])
def test_arrays_of_the_right_length_are_not_noted(velocities, efforts):
    joint_states = JointStates()
    joint_states.keep(with_lengths(velocities, efforts))
    assert joint_states.take_notes() == ()
