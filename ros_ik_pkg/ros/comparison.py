"""The methods side by side on the node's targets: after the solution, on a thread of its own."""

from __future__ import annotations

from dataclasses import dataclass

from rclpy.node import Node

from ros_ik_pkg.compare import compare_methods
from ros_ik_pkg.ik import METHODS, SolveOptions
from ros_ik_pkg.ros import interface
from ros_ik_pkg.ros.answer import Answer
from ros_ik_pkg.ros.comparison_messages import comparison_message, paths_message
from ros_ik_pkg.ros.interface import Output
from ros_ik_pkg.ros.messages import trace_message
from ros_ik_pkg.ros.names import name_in_statuses
from ros_ik_pkg.ros.worker import Worker


@dataclass(frozen=True)
class Job:
    """What to compare on: an answered target, and the methods and options of that moment."""

    answer: Answer
    methods: tuple[str, ...]
    options: SolveOptions


class Comparison:
    """Runs the methods of the parameter `compare` on targets that were answered; the newest one waits.

    A comparison takes longer than a solve, and the next target must not wait for it: the compiled solver
    lets other threads run. While one is under way, a newer target takes the place of the one that waits.
    """

    def __init__(self, node: Node, traces: Output) -> None:
        self._name = name_in_statuses(node)
        self._statuses = Output(node, interface.COMPARISON)
        self._paths = Output(node, interface.COMPARISON_PATHS)
        self._traces = traces
        self.worker: Worker[Job] = Worker(node, 'comparison', self._publish, 1)

    def submit(self, answer: Answer, compare: tuple[str, ...], options: SolveOptions) -> None:
        """Compare on an answered target, where methods are asked for and somebody listens."""
        methods = METHODS if 'all' in compare else compare
        if methods and answer.solution is not None and self._wanted():
            self.worker.submit(Job(answer, methods, options))

    def _wanted(self) -> bool:
        return self._statuses.heard or self._paths.heard or self._traces.heard

    def _publish(self, job: Job) -> None:
        """Run the methods and publish: traces, then figures, so that who has the figures has the traces too."""
        answer = job.answer
        runs = compare_methods(answer.arm, answer.base_from_target, answer.seed, job.methods, job.options)
        if self._traces.heard:
            for run in runs:
                self._traces.publish(trace_message(answer, run.trace, run.method, 'comparison'))
        if self._statuses.heard:
            self._statuses.publish(comparison_message(answer, runs, self._name))
        if self._paths.heard:
            self._paths.publish(paths_message(answer, runs))
