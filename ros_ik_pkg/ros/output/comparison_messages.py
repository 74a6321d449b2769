"""A comparison as messages: figures for tables, paths for RViz; pure functions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point, Pose, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from ros_ik_pkg.compare import MethodRun, describe_run
from ros_ik_pkg.compare.palette import COLOURS, TARGET, rgb
from ros_ik_pkg.ik import Status
from ros_ik_pkg.ros.handling.result import Result
from ros_ik_pkg.ros.output.messages import base_header
from ros_ik_pkg.ros.output.statuses import key_values

FIGURES = ('method', 'iterations', 'position_error', 'orientation_error', 'time', 'sigma_min')
MAX_POINTS = 400  # of a path; a run of transpose has thousands, less than a pixel apart
EVERY_ONE = 100  # points at the start, where steps are long
LINE_WIDTH, TARGET_SIZE, TEXT_HEIGHT, LINE_SPACING = 0.004, 0.03, 0.03, 0.04  # m


def comparison_message(result: Result, runs: Sequence[MethodRun], node_name: str) -> DiagnosticArray:
    """Return one status for each method, under the stamp of the target."""
    return DiagnosticArray(header=base_header(result), status=[_status(result, run, node_name) for run in runs])


def _status(result: Result, run: MethodRun, node_name: str) -> DiagnosticStatus:
    converged = run.status is Status.CONVERGED
    return DiagnosticStatus(
        level=DiagnosticStatus.OK if converged else DiagnosticStatus.WARN,
        name=f'{node_name}: {run.method}',
        message=describe_run(run),
        hardware_id=result.arm.name,
        values=key_values(_figures(run)),
    )


def _figures(run: MethodRun) -> dict[str, Any]:
    figures = {name: getattr(run, name) for name in FIGURES}
    return {'status': run.status.label, **figures, 'joints_at_limits': ' '.join(run.joints_at_limits)}


def paths_message(result: Result, runs: Sequence[MethodRun]) -> MarkerArray:
    """Return the path of the tip for each method, a legend above the target, and the target in red."""
    header = base_header(result)
    target = result.base_from_target[:3, 3].tolist()
    markers = [Marker(header=header, action=Marker.DELETEALL), _target(header, target)]
    for k, run in enumerate(runs):
        markers += [_path(header, run), _legend(header, run, [*target[:2], target[2] + (2 + k) * LINE_SPACING])]
    return MarkerArray(markers=markers)


def _path(header: Header, run: MethodRun) -> Marker:
    return Marker(
        header=header,
        ns=run.method,
        type=Marker.LINE_STRIP,
        pose=_pose(),
        scale=Vector3(x=LINE_WIDTH),
        color=_colour(COLOURS[run.method]),
        points=list(_points(run.trace.tip_positions)),
    )


def _points(positions: np.ndarray) -> Iterator[Point]:
    """Thin out a long path: keep all of the first points and evenly chosen others."""
    last = len(positions) - 1
    chosen = np.linspace(0, last, MAX_POINTS - EVERY_ONE).astype(int) if last >= MAX_POINTS else np.arange(last + 1)
    chosen = np.union1d(chosen, np.arange(min(EVERY_ONE, last)))
    return (Point(x=x, y=y, z=z) for x, y, z in positions[chosen].tolist())


def _legend(header: Header, run: MethodRun, position: Sequence[float]) -> Marker:
    return Marker(
        header=header,
        ns=f'{run.method} legend',
        type=Marker.TEXT_VIEW_FACING,
        pose=_pose(position),
        scale=Vector3(z=TEXT_HEIGHT),
        color=_colour(COLOURS[run.method]),
        text=f'{run.method} {run.iterations} {run.status.label}',
    )


def _target(header: Header, position: Sequence[float]) -> Marker:
    size = Vector3(x=TARGET_SIZE, y=TARGET_SIZE, z=TARGET_SIZE)
    return Marker(
        header=header, ns='target', type=Marker.SPHERE, pose=_pose(position), scale=size, color=_colour(TARGET)
    )


def _pose(position: Sequence[float] = (0.0, 0.0, 0.0)) -> Pose:
    pose = Pose()
    pose.position.x, pose.position.y, pose.position.z = position
    return pose


def _colour(text: str) -> ColorRGBA:
    red, green, blue = (part / 255.0 for part in rgb(text))
    return ColorRGBA(r=red, g=green, b=blue, a=1.0)
