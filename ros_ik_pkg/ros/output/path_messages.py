"""A path's result as messages: the motion, one status, markers for RViz; pure functions."""

from __future__ import annotations

from typing import Any

import numpy as np
from builtin_interfaces.msg import Duration
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA, Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from visualization_msgs.msg import Marker, MarkerArray

from ros_ik_pkg.ik import PathSolution
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.handling.path_handler import PARTIAL, PathResult
from ros_ik_pkg.ros.handling.result import FAILED, INTERNAL_ERROR, REFUSED, SOLVED
from ros_ik_pkg.ros.input.pose import stamp_text
from ros_ik_pkg.ros.output.statuses import key_values, tool_text

LEVELS = {
    SOLVED: DiagnosticStatus.OK, PARTIAL: DiagnosticStatus.WARN, FAILED: DiagnosticStatus.WARN,
    REFUSED: DiagnosticStatus.ERROR,
}  # fmt: skip
LINE_WIDTH, HALO_WIDTH, BREAK_SIZE = 0.004, 0.012, 0.02  # m
SINGULAR = 0.1  # smallest singular value of the task Jacobian below which the line has a halo
MOST_POINTS = 5000  # of a line; RViz draws no more of them smoothly
BREAK_COLOUR = ColorRGBA(r=1.0, g=0.0, b=0.0, a=1.0)


def path_trajectory_message(result: PathResult) -> JointTrajectory:
    """Return the motion: positions, velocities, accelerations and times of all points.

    Its stamp is 0, which joint_trajectory_controller takes for now.
    """
    arm, solution = result.job.arm, result.solution
    rows = zip(solution.q.tolist(), solution.velocities.tolist(), solution.accelerations.tolist(), solution.times)
    message = JointTrajectory(joint_names=list(arm.joint_names))
    message.header.frame_id = arm.base_frame
    message.points = [
        JointTrajectoryPoint(positions=q, velocities=v, accelerations=a, time_from_start=row_time(t))
        for q, v, a, t in rows
    ]
    return message


def row_time(seconds: float) -> Duration:
    """Return the time of a row as in the motion: the nearest nanosecond."""
    nanoseconds = round(1e9 * seconds)
    return Duration(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


def path_result_message(result: PathResult, node_name: str) -> DiagnosticArray:
    """Return the one status of a path, under the stamp of the path."""
    header = result.message.header
    status = DiagnosticStatus(
        level=DiagnosticStatus.ERROR if result.status == INTERNAL_ERROR else LEVELS[result.outcome],
        name=f'{node_name}: path {result.outcome}',
        message=result.reason,
        hardware_id=result.job.arm.name if result.job else '',
        values=key_values(_figures(result)),
    )
    return DiagnosticArray(header=Header(stamp=header.stamp, frame_id=shorten(header.frame_id)), status=[status])


def _figures(result: PathResult) -> dict[str, Any]:
    figures: dict[str, Any] = {
        'outcome': result.outcome,
        'status': result.status,
        'tool': tool_text(result.job.arm if result.job else None),
        'poses': len(result.message.poses),
        'path_stamp': stamp_text(result.message.header.stamp),
    }
    solution = result.solution
    if solution is None or not len(solution.q):
        return figures
    lowest = int(np.argmin(solution.sigma_min))
    return figures | {
        'points': len(solution.q),
        'duration': float(solution.times[-1]),
        'joint_travel': solution.length,
        'largest_joint_travel': solution.largest_joint_travel,
        'start_distance': float(np.abs(solution.q[int(solution.led)] - result.job.seed).max()),
        'led_to_start': solution.led,
        'reached_pose': float(solution.place[-1]),
        'reconfigurations': len(solution.reconfigurations),
        'reconfigured_at_poses': ' '.join(f'{solution.place[row]:.3f}' for row in solution.reconfigurations),
        'reconfigured_at_times': ' '.join(f'{solution.times[row]:.6f}' for row in solution.reconfigurations),
        'slowed_intervals': int(solution.slowed.sum()),
        'line_error': solution.line_error,
        'line_angle': solution.line_angle,
        'sigma_min': float(solution.sigma_min[lowest]),
        'sigma_min_at_pose': float(solution.place[lowest]),
        'solve_time': solution.solve_time,
    }


def path_markers_message(result: PathResult) -> MarkerArray:
    """Return the line of the tip, from blue at rest to red at its highest speed; a halo, from yellow to red, where the
    arm is near a singularity; and a red cube where the path breaks."""
    header = Header(stamp=result.message.header.stamp, frame_id=result.job.arm.base_frame)
    markers = [Marker(header=header, action=Marker.DELETEALL)]
    solution = result.solution
    if len(solution.q) > 1:
        markers += [_line(header, solution), _halo(header, solution)]
    for found in solution.breaks:
        position = result.job.poses[min(round(found.place), len(result.job.poses) - 1), :3, 3]
        if len(solution.q):
            position = solution.base_from_tip[-1, :3, 3]
        cube = Marker(header=header, ns='break', type=Marker.CUBE, color=BREAK_COLOUR, scale=_size(BREAK_SIZE))
        cube.pose.position = _point(position)
        cube.pose.orientation.w = 1.0
        markers.append(cube)
    return MarkerArray(markers=markers)


def _halo(header: Header, solution: PathSolution) -> Marker:
    """Return the wider line, seen only where the smallest singular value is below SINGULAR."""
    near = np.clip(1.0 - solution.sigma_min / SINGULAR, 0.0, 1.0)
    marker, chosen = _strip(header, 'singularity', HALO_WIDTH, solution)
    marker.colors = [ColorRGBA(r=1.0, g=0.9 * (1.0 - share), b=0.0, a=0.6 * (share > 0.0))
                     for share in near[chosen].tolist()]  # fmt: skip
    return marker


def _line(header: Header, solution: PathSolution) -> Marker:
    positions = solution.base_from_tip[:, :3, 3]
    speeds = np.linalg.norm(np.diff(positions, axis=0), axis=1) / np.diff(solution.times)
    speeds = np.append(speeds, speeds[-1]) / max(speeds.max(), 1e-9)
    marker, chosen = _strip(header, 'path', LINE_WIDTH, solution)
    marker.colors = [ColorRGBA(r=speed, g=0.2, b=1.0 - speed, a=1.0) for speed in speeds[chosen].tolist()]
    return marker


def _strip(header: Header, name: str, width: float, solution: PathSolution) -> tuple[Marker, np.ndarray]:
    """Return a line through the tip's positions without colours, and the rows that it goes through."""
    count = len(solution.q)
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_POINTS)).astype(int))
    marker = Marker(header=header, ns=name, type=Marker.LINE_STRIP, scale=Vector3(x=width))
    marker.pose.orientation.w = 1.0
    marker.points = [_point(position) for position in solution.base_from_tip[chosen, :3, 3]]
    return marker, chosen


def _point(position: np.ndarray) -> Point:
    x, y, z = position.tolist()
    return Point(x=x, y=y, z=z)


def _size(length: float) -> Vector3:
    return Vector3(x=length, y=length, z=length)
