"""Messages to arrays and arrays to messages; pure functions."""

from __future__ import annotations

import math
from array import array

import numpy as np
from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Point, Pose, PoseStamped, Transform
from nav_msgs.msg import Path
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, Header, MultiArrayDimension
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ros_ik_pkg.ik import TRACE_COLUMNS, Trace
from ros_ik_pkg.ik.pose_error import pose_matrix
from ros_ik_pkg.ros.answer import Answer, Command, RefusedError
from ros_ik_pkg.ros.target import Target

QUATERNION_SLACK = 0.01  # a norm this far from 1 is rounding or a slip; beyond it, no rotation was meant
QUATERNION_ROUNDING = 1e-6  # nearer to 1 than this needs no mention
MAX_DISTANCE = 1e6  # m; further off, a millimetre is lost in the rounding


def target_pose(target: Target) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the pose (4, 4) [m] in the frame of the target, and notes on what was mended.

    Raises RefusedError on numbers that are not finite, positions beyond MAX_DISTANCE and quaternions whose
    norm is further than QUATERNION_SLACK from 1.
    """
    position, quaternion = target.position, target.orientation
    norm = math.hypot(*quaternion)
    # NaN is within no bound.
    good = abs(norm - 1.0) <= QUATERNION_ROUNDING and math.hypot(*position) <= MAX_DISTANCE
    return pose_matrix(*position, *quaternion), () if good else _mended(position, quaternion, norm)


def _mended(position: tuple[float, ...], quaternion: tuple[float, ...], norm: float) -> tuple[str, ...]:
    """Say what was mended in a pose that is not quite as it should be; refuse what cannot be meant."""
    for name, values in (('position', position), ('orientation', quaternion)):
        if not all(map(math.isfinite, values)):
            raise RefusedError('not_finite', f'target {name} is {list(values)}; expected finite numbers')
    if max(map(abs, position)) > MAX_DISTANCE:
        raise RefusedError('position', f'target position {list(position)} is beyond {MAX_DISTANCE:g} m')
    if abs(norm - 1.0) > QUATERNION_SLACK:
        raise RefusedError(
            'quaternion',
            f'target orientation has norm {norm:.6g}; expected a unit quaternion x y z w, '
            f'its norm within {QUATERNION_SLACK} of 1',
        )
    return () if abs(norm - 1.0) <= QUATERNION_ROUNDING else (f'quaternion of norm {norm:.6g} normalised',)


def transform_matrix(transform: Transform) -> np.ndarray:
    """Return a transform as a matrix (4, 4) [m]; TF has seen to it that its numbers are good."""
    p, q = transform.translation, transform.rotation
    return pose_matrix(p.x, p.y, p.z, q.x, q.y, q.z, q.w)


def positions_of(command: Command) -> array[float]:
    """Return joint positions [rad, m] as messages hold them."""
    return array('d', command.q.tobytes())


def solution_message(answer: Answer) -> JointState:
    """Return the joint positions [rad, m] under the stamp of the target."""
    return JointState(
        header=base_header(answer),
        name=list(answer.arm.joint_names),
        position=positions_of(answer.command),
    )


def trajectory_message(answer: Answer, duration: float) -> JointTrajectory:
    """Return a trajectory of one point, in `duration` [s], later where the velocity limits need it.

    Its stamp is 0, which joint_trajectory_controller takes for now; one of the past it would leave aside.
    """
    command = answer.command
    nanoseconds = math.ceil(1e9 * max(duration, command.duration))
    point = JointTrajectoryPoint(
        positions=positions_of(command),
        time_from_start=Duration(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9),
    )
    message = JointTrajectory(joint_names=list(answer.arm.joint_names), points=[point])
    message.header.frame_id = answer.arm.base_frame
    return message


def commands_message(answer: Answer) -> Float64MultiArray:
    """Return the joint positions [rad, m] alone, in the order of the arm's joints from base to tip."""
    return Float64MultiArray(data=positions_of(answer.command))


def trace_message(answer: Answer, trace: Trace, method: str, run: str) -> Float64MultiArray:
    """Return a trace as a matrix: TRACE_COLUMNS, then the joint positions.

    The labels name the columns, and say whose rows they are: the method, the stamp of the target, and
    the run, `solve` or `comparison`.
    """
    matrix = np.hstack([trace.rows, trace.joint_positions])
    rows, columns = matrix.shape
    message = Float64MultiArray(data=array('d', matrix.tobytes()))
    message.layout.dim = [
        MultiArrayDimension(label=rows_label(answer, method, run), size=rows, stride=rows * columns),
        MultiArrayDimension(label=','.join(trace_labels(answer)), size=columns, stride=columns),
    ]
    return message


def rows_label(answer: Answer, method: str, run: str) -> str:
    """Return what the rows of a trace message belong to: `rows method=dls run=solve stamp=1.000000002`."""
    return f'rows method={method} run={run} stamp={stamp_text(answer.target.stamp)}'


def stamp_text(stamp: Time) -> str:
    """Write a stamp [s] with all its digits."""
    return f'{stamp.sec}.{stamp.nanosec:09d}'


def trace_labels(answer: Answer) -> tuple[str, ...]:
    """Names of the columns of the trace message."""
    return (*TRACE_COLUMNS, *answer.arm.joint_names)


def path_message(answer: Answer) -> Path:
    """Return the positions of the tip, row by row of the trace, in the base frame."""
    header = base_header(answer)
    points = (Point(x=x, y=y, z=z) for x, y, z in answer.solution.trace.tip_positions.tolist())
    return Path(header=header, poses=[PoseStamped(header=header, pose=Pose(position=p)) for p in points])


def base_header(answer: Answer) -> Header:
    """Header with the stamp of the target and the base frame of the arm."""
    return Header(stamp=answer.target.stamp, frame_id=answer.arm.base_frame)
