"""Reads twist messages: numbers, stamp and frame."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import TwistStamped

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand

FASTEST = 1e3  # m/s, rad/s; more is certainly an error


def command_of(message: TwistStamped, arm: Arm, handler: TargetHandler, timeout: float) -> TwistCommand:
    """Return the command in a message; refuse invalid numbers, stamps and frames.

    The twist is that of the origin of the tool, or of the tip without a tool, in the axes of frame_id: the base frame
    if it is empty, the turning axes of tool or tip, or any frame of the robot or of TF. A stamp of 0 means now.
    """
    linear, angular = message.twist.linear, message.twist.angular
    twist = np.array([linear.x, linear.y, linear.z, angular.x, angular.y, angular.z])
    if not np.all(np.abs(twist) <= FASTEST):
        raise RefusedError('not_finite', f'twist is {twist.tolist()}; expected numbers up to {FASTEST:g} m/s and rad/s')
    stamp = message.header.stamp
    handler.refuse_stale(stamp.sec, stamp.nanosec, timeout, 'twist', 'command_timeout')
    frame = message.header.frame_id.removeprefix('/')
    if frame == arm.moving_frame:
        return TwistCommand(twist)
    if frame == arm.tip_frame:
        return TwistCommand((twist.reshape(2, 3) @ arm.tip_from_tool[:3, :3]).ravel())
    base_from_frame, _ = handler.base_from_frame(frame, stamp, arm)
    assert base_from_frame is not None  # it does not wait for a transform
    return TwistCommand(twist, base_from_frame[:3, :3])
