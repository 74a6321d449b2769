"""Collect the IK node's messages about the newest target."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from visualization_msgs.msg import Marker, MarkerArray

from ros_ik_pkg.compare import MethodRun
from ros_ik_pkg.ik import METHODS, TRACE_COLUMNS, Arm, Status
from ros_ik_pkg.ros.handling.result import NOTHING, REFUSED
from ros_ik_pkg.ros.input.pose import stamp_text
from ros_ik_pkg.ros.output.messages import CLEARANCE

STATUS_OF = {status.label: status for status in Status}
PLOTTED = ('attempt', 'iteration', 'position_error', 'orientation_error')
SEARCH = 'search'  # the name of the node's own solve among the descents
WAITING = ('joint_states', 'no_robot')  # causes of a refusal that pass by themselves
RESULT, COMPARISON, PATHS, TRACE = 'result', 'comparison', 'paths', 'trace'  # what there can be news of


@dataclass(frozen=True)
class Curve:
    """The iterates of one method, or of the node's search with all its attempts; all (k,), joint positions (k, n).

    method: of the steps.
    """

    method: str
    attempt: np.ndarray
    iteration: np.ndarray
    position_error: np.ndarray  # m
    orientation_error: np.ndarray  # rad
    joint_positions: np.ndarray  # rad, m


class Answers:
    """Keeps the messages with the expected stamp and drops those about other targets.

    result: values of ~/result by name, and its sentence as 'message'; empty until it comes.
    solution: joint positions by name [rad, m] of the newest target that has a result; empty if it has no solution.
    runs, curves, paths: of the last comparison that came whole, by method.
    search: the iterates of the node's own solve, None until they come.
    compared: whether the comparison of the newest target has come.
    """

    def __init__(self) -> None:
        self.stamp = ''
        self.result: dict[str, str] = {}
        self.solution: dict[str, float] = {}
        self.runs: dict[str, MethodRun] = {}
        self.curves: dict[str, Curve] = {}
        self.paths: dict[str, np.ndarray] = {}
        self.search: Curve | None = None
        self.compared = True
        self._coming: dict[str, Curve] = {}
        self._news: set[str] = set()

    @property
    def refused(self) -> bool:
        """Whether the newest target was refused, so that no comparison follows."""
        return self.result.get('outcome') == REFUSED

    @property
    def passing(self) -> bool:
        """Whether it was refused for a reason that passes."""
        return self.refused and self.result['status'] in WAITING

    def expect(self, stamp: str) -> None:
        """Begin with a new target."""
        self.stamp, self.result, self._coming, self.search = stamp, {}, {}, None
        self.compared = False

    def forget(self) -> None:
        """Drop everything, as for another arm."""
        self.expect('')
        self.solution, self.compared = {}, True
        self.forget_runs()

    def forget_runs(self) -> None:
        """Drop the comparison, for example when no method is compared any more."""
        self.runs, self.curves, self.paths = {}, {}, {}
        self._news |= {COMPARISON, PATHS}

    def take_news(self) -> set[str]:
        """Return the kinds of data that arrived since the last call."""
        news, self._news = self._news, set()
        return news

    def renew(self) -> None:
        """Have everything drawn again."""
        self._news = {RESULT, COMPARISON, PATHS, TRACE}

    def take_solution(self, message: JointState) -> None:
        """Keep the joints of the newest target."""
        if stamp_text(message.header.stamp) == self.stamp:
            self.solution = dict(zip(message.name, message.position))
            self._news.add(RESULT)

    def take_result(self, message: DiagnosticArray) -> None:
        """Keep the result of the newest target; one without a solution takes the solution before away."""
        if stamp_text(message.header.stamp) == self.stamp:
            self.result = {**values_of(message.status[0]), 'message': message.status[0].message}
            if self.result.get('published', NOTHING) == NOTHING:
                self.solution = {}
            if self.refused:
                self.forget_runs()
            self._news.add(RESULT)

    def take_trace(self, message: Float64MultiArray) -> None:
        """Keep the iterates of a method that is compared, or of the node's own solve."""
        about = dict(pair.split('=') for pair in message.layout.dim[0].label.split()[1:])
        if about['stamp'] != self.stamp:
            return
        rows, columns = (dim.size for dim in message.layout.dim)
        matrix = np.array(message.data).reshape(rows, columns)
        names = message.layout.dim[1].label.split(',')
        figures = (matrix[:, names.index(name)] for name in PLOTTED)
        joints = [k for k, name in enumerate(names) if name not in (*TRACE_COLUMNS, CLEARANCE)]
        curve = Curve(about['method'], *figures, matrix[:, joints])
        if about['run'] == 'comparison':
            self._coming[about['method']] = curve
        else:
            self.search = curve
            self._news.add(TRACE)

    def take_comparison(self, message: DiagnosticArray) -> None:
        """Store the figures of all methods; their curves arrived before."""
        if stamp_text(message.header.stamp) == self.stamp:
            runs = [run_of(values_of(status)) for status in message.status]
            self.runs = {run.method: run for run in runs}
            self.compared = True
            self.curves = {method: curve for method, curve in self._coming.items() if method in self.runs}
            self._news.add(COMPARISON)

    def take_paths(self, message: MarkerArray) -> None:
        """Store the tip paths (k, 3) [m], by method."""
        lines = [marker for marker in message.markers if marker.type == Marker.LINE_STRIP and marker.ns in METHODS]
        if lines and stamp_text(lines[0].header.stamp) == self.stamp:
            self.paths = {line.ns: np.array([[p.x, p.y, p.z] for p in line.points]) for line in lines}
            self._news.add(PATHS)


def least_bad_of(result: Mapping[str, str], arm: Arm) -> tuple[np.ndarray, tuple[str, ...]] | None:
    """Return the configuration (n,) of a failure by contact and the names of the two that touch; None of another
    result, and of one for another arm."""
    q = np.array(result.get('least_bad', '').split(), dtype=float)
    return (q, tuple(result['touching'].split(', '))) if len(q) == arm.n else None


def values_of(status: DiagnosticStatus) -> dict[str, str]:
    """Return the key-value pairs of a status."""
    return {pair.key: pair.value for pair in status.values}


def run_of(figures: Mapping[str, Any]) -> MethodRun:
    """Read a run back from the values of ~/comparison."""
    return MethodRun(
        method=figures['method'],
        status=STATUS_OF[figures['status']],
        iterations=int(figures['iterations']),
        position_error=float(figures['position_error']),
        orientation_error=float(figures['orientation_error']),
        time=float(figures['time']),
        sigma_min=float(figures['sigma_min']),
        joints_at_limits=tuple(figures.get('joints_at_limits', '').split()),
    )
