"""A result as diagnostic statuses: one for ~/result, one per iteration for ~/iterations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pinocchio as pin
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

from ros_ik_pkg.ik import TRACE_COLUMNS, Arm
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.handling.result import FAILED, INTERNAL_ERROR, NOTHING, REFUSED, SOLVED, Result
from ros_ik_pkg.ros.input.pose import stamp_text
from ros_ik_pkg.ros.output.messages import base_header
from ros_ik_pkg.ros.servo.codes import Code
from ros_ik_pkg.ros.servo.limiter import Motion
from ros_ik_pkg.ros.servo.stream import State

LEVELS = {SOLVED: DiagnosticStatus.OK, FAILED: DiagnosticStatus.WARN, REFUSED: DiagnosticStatus.ERROR}
MAX_ITERATION_STATUSES = 5000  # about 0.3 s of work; ~/trace has every row
AS_ASKED = (Code.FOLLOWING, Code.STANDING, Code.PAUSED, Code.COMMANDS_STOPPED, Code.WAITING)  # nothing is wrong
WHOLE_COLUMNS = ('attempt', 'iteration', 'joints_at_limits')


def result_message(result: Result, node_name: str) -> DiagnosticArray:
    """Return the one status of a target, under the stamp of the target."""
    status = DiagnosticStatus(
        level=DiagnosticStatus.ERROR if result.status == INTERNAL_ERROR else LEVELS[result.outcome],
        name=f'{node_name}: {result.outcome}',
        message=result.reason,
        hardware_id=result.arm.name if result.arm else '',
        values=key_values(_result_values(result)),
    )
    header = Header(stamp=result.target.stamp, frame_id=shorten(result.target.frame_id))
    return DiagnosticArray(header=header, status=[status])


def _result_values(result: Result) -> dict[str, Any]:
    """Return the figures of a result: those of the solver, if it was called, and those of every target."""
    return {
        'outcome': result.outcome,
        'method': result.method,
        'status': result.status,
        **_figures(result),
        **_command_figures(result),
        'tool': tool_text(result.arm),
        **({'service': result.service} if result.service else {}),
        'notes': '; '.join(result.notes),
        'target_frame': shorten(result.target.frame_id),
        'target_stamp': stamp_text(result.target.stamp),
    }


def tool_text(arm: Arm | None) -> str:
    """Return the pose of the tool in the tip frame, x y z [m] and quaternion x y z w; empty without a tool."""
    if arm is None or not arm.tool_frame:
        return ''
    return ' '.join(map(repr, pin.SE3ToXYZQUAT(pin.SE3(arm.tip_from_tool)).tolist()))


def _figures(result: Result) -> dict[str, Any]:
    solution = result.solution
    if solution is None:
        return {}
    names = result.arm.joint_names
    return {
        'position_error': solution.position_error,
        'orientation_error': solution.orientation_error,
        **(_wish_figures(result) if solution.wished else {}),
        'iterations': solution.iterations,
        'attempts': solution.attempts,
        'completeness': solution.completeness,
        'solve_time': solution.solve_time,
        'joint_distance': solution.joint_distance,
        'sigma_min': solution.sigma_min,
        'joints_at_limits': ' '.join(names[i] for i in solution.joints_at_limits),
        **({} if solution.room is None else _contact_figures(result)),
    }


def _wish_figures(result: Result) -> dict[str, Any]:
    """Return which rows were demanded and which wished for only, and how near the solution came to those."""
    solution = result.solution
    return {
        'demanded_rows': ' '.join(result.demanded_rows),
        'wished_rows': ' '.join(solution.wished),
        'wished_position_error': solution.wished_position_error,
        'wished_orientation_error': solution.wished_orientation_error,
    }


def _contact_figures(result: Result) -> dict[str, Any]:
    """Return the clearance; if contact prevents a solution, also what touches and the best configuration."""
    if not result.touching:
        return {'clearance': result.clearance}
    least_bad = ' '.join(str(value) for value in result.solution.q.tolist())
    return {'clearance': result.clearance, 'touching': ', '.join(result.touching), 'least_bad': least_bad}


def _command_figures(result: Result) -> dict[str, Any]:
    """Return what was published, and why it is not the solution itself."""
    command = result.command
    if command is None:
        return {'published': NOTHING}
    figures: dict[str, Any] = {'published': command.published}
    if command.errors is not None:
        figures |= dict(zip(('published_position_error', 'published_orientation_error'), command.errors))
    if command.fraction is not None:
        figures |= {'velocity_limited': command.fraction, 'step_time': command.step_time}
    return figures


def iterations_message(result: Result, node_name: str) -> DiagnosticArray:
    """Return one status for every row of the trace, up to MAX_ITERATION_STATUSES."""
    rows = result.solution.trace.rows[:MAX_ITERATION_STATUSES].tolist()
    return DiagnosticArray(
        header=base_header(result),
        status=[_iteration_status(dict(zip(TRACE_COLUMNS, row)), result, node_name) for row in rows],
    )


def _iteration_status(row: dict[str, Any], result: Result, node_name: str) -> DiagnosticStatus:
    row |= {name: int(row[name]) for name in WHOLE_COLUMNS}
    return DiagnosticStatus(
        level=DiagnosticStatus.OK,
        name=f'{node_name}: attempt {row["attempt"]} iteration {row["iteration"]}',
        message=f'{row["position_error"]:.3g} m, {row["orientation_error"]:.3g} rad',
        hardware_id=result.arm.name,
        values=key_values(row),
    )


def servo_message(state: State, arm: Arm | None, node_name: str) -> DiagnosticArray:
    """Return the one status of the stream of commands, without a stamp."""
    finding = state.finding
    level = DiagnosticStatus.WARN if finding.share < 1.0 else DiagnosticStatus.OK
    status = DiagnosticStatus(
        level=DiagnosticStatus.OK if finding.code in AS_ASKED else level,
        name=f'{node_name}: servo',
        message=shorten(finding.sentence),
        hardware_id=arm.name if arm else '',
        values=key_values(
            {
                'code': int(finding.code),
                'label': finding.code.label,
                'share': round(min(finding.share, 1.0), 4),
                'owner': state.owner,
                'tip_frame': arm.moving_frame if arm else '',
                'tool': tool_text(arm),
                'smoothing': state.smoothing,
                'late_periods': state.late,
                **_motion_figures(state.motion),
            }
        ),
    )
    return DiagnosticArray(status=[status])


def _motion_figures(motion: Motion | None) -> dict[str, str]:
    if motion is None:
        return {}
    return {
        'velocity': ' '.join(f'{value:.6g}' for value in motion.velocity),
        'acceleration': ' '.join(f'{value:.6g}' for value in motion.acceleration),
    }


def key_values(figures: Mapping[str, Any]) -> list[KeyValue]:
    """Write figures as text; floats with as many digits as it takes to read the same number back."""
    return [KeyValue(key=key, value=str(value)) for key, value in figures.items()]
