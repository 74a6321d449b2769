"""Results as messages; pure functions."""

from __future__ import annotations

import math
from array import array

import numpy as np
from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point, Pose, PoseStamped
from nav_msgs.msg import Path
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, Header, MultiArrayDimension
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ros_ik_pkg.ik import TRACE_COLUMNS, Arm, Trace
from ros_ik_pkg.ros.handling.result import Command, Result
from ros_ik_pkg.ros.input.pose import stamp_text
from ros_ik_pkg.ros.servo.limiter import Motion

CLEARANCE = 'clearance'  # the column [m]


def positions_of(command: Command) -> array[float]:
    """Return joint positions [rad, m] as the array type of messages."""
    return array('d', command.q.tobytes())


def positions_message(arm: Arm, q: np.ndarray) -> JointState:
    """Return joint positions (n,) [rad, m] of an arm, without a stamp."""
    message = JointState(name=list(arm.joint_names), position=array('d', q.tobytes()))
    message.header.frame_id = arm.base_frame
    return message


def motion_trajectory_message(arm: Arm, motion: Motion, period: float) -> JointTrajectory:
    """Return a trajectory of one point a period [s] from now, with the velocity and the acceleration that belong to it.

    Its stamp is 0, as in trajectory_message.
    """
    point = JointTrajectoryPoint(
        positions=array('d', motion.position.tobytes()),
        velocities=array('d', motion.velocity.tobytes()),
        accelerations=array('d', motion.acceleration.tobytes()),
        time_from_start=duration_message(period),
    )
    message = JointTrajectory(joint_names=list(arm.joint_names), points=[point])
    message.header.frame_id = arm.base_frame
    return message


def duration_message(duration: float) -> Duration:
    """Return a duration [s] as a message, rounded up."""
    nanoseconds = math.ceil(1e9 * duration)
    return Duration(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


def trajectory_message(result: Result, duration: float) -> JointTrajectory:
    """Return a trajectory of one point at `duration` [s], or later if the velocity limits need it.

    Its stamp is 0, which joint_trajectory_controller takes as now; it would ignore a point in the past.
    """
    command = result.command
    point = JointTrajectoryPoint(
        positions=positions_of(command),
        time_from_start=duration_message(max(duration, command.duration)),
    )
    message = JointTrajectory(joint_names=list(result.arm.joint_names), points=[point])
    message.header.frame_id = result.arm.base_frame
    return message


def commands_message(result: Result) -> Float64MultiArray:
    """Return only the joint positions [rad, m], in the order of the arm's joints from base to tip."""
    return Float64MultiArray(data=positions_of(result.command))


def trace_message(result: Result, trace: Trace, method: str, run: str) -> Float64MultiArray:
    """Return a trace as a matrix: TRACE_COLUMNS, then the joint positions; if contact counts, CLEARANCE last.

    The labels name the columns, and the rows' method, stamp of the target, and run, `solve` or `comparison`.
    """
    matrix = np.hstack([trace.rows, trace.joint_positions])
    if result.room is not None:  # a lower bound
        matrix = np.column_stack([matrix, result.room.least_clearances(trace.joint_positions)])
    rows, columns = matrix.shape
    message = Float64MultiArray(data=array('d', matrix.tobytes()))
    message.layout.dim = [
        MultiArrayDimension(label=rows_label(result, method, run), size=rows, stride=rows * columns),
        MultiArrayDimension(label=','.join(trace_labels(result)), size=columns, stride=columns),
    ]
    return message


def rows_label(result: Result, method: str, run: str) -> str:
    """Return the label of the rows of a trace message: `rows method=dls run=solve stamp=1.000000002`."""
    return f'rows method={method} run={run} stamp={stamp_text(result.target.stamp)}'


def trace_labels(result: Result) -> tuple[str, ...]:
    """Names of the columns of the trace message."""
    return (*TRACE_COLUMNS, *result.arm.joint_names, *(() if result.room is None else (CLEARANCE,)))


def path_message(result: Result) -> Path:
    """Return the positions of the tip, row by row of the trace, in the base frame."""
    header = base_header(result)
    points = (Point(x=x, y=y, z=z) for x, y, z in result.solution.trace.tip_positions.tolist())
    return Path(header=header, poses=[PoseStamped(header=header, pose=Pose(position=p)) for p in points])


def base_header(result: Result) -> Header:
    """Header with the stamp of the target and the base frame of the arm."""
    return Header(stamp=result.target.stamp, frame_id=result.arm.base_frame)
