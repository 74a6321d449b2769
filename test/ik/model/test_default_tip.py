"""The tip frame where none is named: before a gripper, and with words about it."""

from __future__ import annotations

import pytest
from chains import joint_xml, urdf

from ros_ik_pkg.ik import ModelError, load_arm


def arm_with(*hand, wrist='wrist_roll', palm='palm'):
    """Write an arm of two joints that ends at the palm, and what hangs on it: (name, kind, parent, child)."""
    joints = [joint_xml('lift', 'revolute', 'base', 'upper'), joint_xml(wrist, 'revolute', 'upper', palm),
              *(joint_xml(*joint) for joint in hand)]
    return urdf(['base', 'upper', palm, *(joint[3] for joint in hand)], joints)


@pytest.mark.parametrize(
    ('hand', 'tip'),
    [
        ([('gripper', 'revolute', 'palm', 'moving_jaw')], 'palm'),
        ([('frame', 'fixed', 'palm', 'gripper_frame_link'), ('gripper', 'revolute', 'palm', 'moving')],
         'gripper_frame_link'),
        ([('frame', 'fixed', 'palm', 'camera'), ('weld', 'fixed', 'palm', 'arm_tool0'),
          ('left_finger', 'prismatic', 'palm', 'left'), ('right_finger', 'prismatic', 'palm', 'right')], 'arm_tool0'),
        ([('knuckle', 'revolute', 'palm', 'k'), ('finger', 'revolute', 'k', 'f')], 'palm'),
    ],
)
def test_the_chain_ends_before_the_gripper(hand, tip):
    arm = load_arm(arm_with(*hand))
    assert (arm.tip_frame, arm.joint_names) == (tip, ('lift', 'wrist_roll'))
    assert f"the chain ends at '{tip}', before the gripper" in arm.warnings[0]


def test_the_joint_that_turns_a_gripper_is_one_of_the_arm():
    text = arm_with(('gripper', 'revolute', 'gripper_link', 'moving_jaw'), wrist='gripper_roll', palm='gripper_link')
    assert load_arm(text).joint_names == ('lift', 'gripper_roll')


def test_a_tip_that_is_named_may_be_in_the_gripper():
    arm = load_arm(arm_with(('gripper', 'revolute', 'palm', 'moving_jaw')), tip='moving_jaw')
    assert (arm.n, arm.warnings) == (3, ())


def test_a_hand_without_an_arm_keeps_its_fingers():
    text = urdf(('base', 'a', 'b'), [joint_xml('finger_1', 'revolute', 'base', 'a'),
                                     joint_xml('finger_2', 'revolute', 'a', 'b')])
    assert load_arm(text).joint_names == ('finger_1', 'finger_2')


def test_two_ends_that_are_no_gripper_are_still_listed():
    text = arm_with(('one', 'revolute', 'palm', 'a'), ('two', 'revolute', 'palm', 'b'))
    with pytest.raises(ModelError, match='several possible tips: a, b'):
        load_arm(text)
