"""Whose axes a twist is in: the tool's, the tip frame's, or those of any other frame."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
from geometry_msgs.msg import TwistStamped

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.servo.twist_input import command_of

TOOL = pin.SE3(pin.rpy.rpyToMatrix(0.3, -1.0, 2.0), np.array([0.1, 0.0, 0.2]))
BARE = load_arm('panda')
ARM = BARE.with_tool(TOOL, 'gripper')
HANDLER = SimpleNamespace(refuse_stale=lambda *_: None, base_from_frame=lambda *_: (np.eye(4), ()))
TWIST = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])


def in_base_axes(frame: str, arm, base_from_tip: np.ndarray) -> np.ndarray:
    """Return the twist (6,) of a message in base axes, with the tip turned by base_from_tip (3, 3)."""
    message = TwistStamped()
    message.header.frame_id = frame
    linear, angular = message.twist.linear, message.twist.angular
    linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = TWIST.tolist()
    command = command_of(message, arm, HANDLER, 0.0)
    own = base_from_tip @ arm.tip_from_tool[:3, :3]
    axes = own if command.base_from_axes is None else command.base_from_axes
    return (axes @ command.twist.reshape(2, 3).T).T.ravel()


def turned(rotation: np.ndarray) -> np.ndarray:
    return np.hstack([rotation @ TWIST[:3], rotation @ TWIST[3:]])


def test_a_twist_in_the_frame_of_the_tool_is_in_its_axes():
    base_from_tip = pin.rpy.rpyToMatrix(1.0, 0.2, -0.7)
    np.testing.assert_allclose(in_base_axes('gripper', ARM, base_from_tip), turned(base_from_tip @ TOOL.rotation))


def test_a_twist_in_the_tip_frame_is_in_its_axes_with_and_without_a_tool():
    base_from_tip = pin.rpy.rpyToMatrix(1.0, 0.2, -0.7)
    for arm in (BARE, ARM):
        np.testing.assert_allclose(in_base_axes(arm.tip_frame, arm, base_from_tip), turned(base_from_tip))


def test_a_twist_without_a_frame_is_in_base_axes():
    np.testing.assert_allclose(in_base_axes('', ARM, np.eye(3)), TWIST)
