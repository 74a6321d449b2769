"""The comparison of methods on the node's targets, after the solution and on a thread of its own."""

from __future__ import annotations

from dataclasses import dataclass

from rclpy.node import Node

from ros_ik_pkg.compare import compare_methods
from ros_ik_pkg.ik import METHODS, SolveOptions
from ros_ik_pkg.ros.handling.result import Result
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.output.comparison_messages import comparison_message, paths_message
from ros_ik_pkg.ros.output.messages import trace_message
from ros_ik_pkg.ros.output.publisher import Publisher
from ros_ik_pkg.ros.runtime.background_worker import BackgroundWorker
from ros_ik_pkg.ros.runtime.node_names import name_in_statuses


@dataclass(frozen=True)
class Job:
    """The input of a comparison: a solved target, and the methods and options at that time."""

    result: Result
    methods: tuple[str, ...]
    options: SolveOptions


class Comparison:
    """Runs the methods of the parameter `compare` on solved targets, one at a time; the newest target waits.

    A comparison takes longer than a solve, and the next target must not wait for it: the compiled solver
    lets other threads run. During a comparison, a newer target replaces the one that waits.
    """

    def __init__(self, node: Node, traces: Publisher) -> None:
        self._name = name_in_statuses(node)
        self._statuses = Publisher(node, topics.COMPARISON)
        self._paths = Publisher(node, topics.COMPARISON_PATHS)
        self._traces = traces
        self.worker: BackgroundWorker[Job] = BackgroundWorker(node, 'comparison', self._publish, 1)

    def submit(self, result: Result, compare: tuple[str, ...], options: SolveOptions) -> None:
        """Compare on a solved target, if methods are selected and a topic has subscribers."""
        methods = METHODS if 'all' in compare else compare
        if methods and result.base_from_target is not None and result.solution is not None and self._wanted():
            self.worker.submit(Job(result, methods, options))

    def _wanted(self) -> bool:
        return self._statuses.heard or self._paths.heard or self._traces.heard

    def _publish(self, job: Job) -> None:
        """Run the methods and publish: traces first, so that subscribers who have the figures have the traces too."""
        result = job.result
        runs = compare_methods(result.arm, result.base_from_target, result.seed, job.methods, job.options)
        if self._traces.heard:
            for run in runs:
                self._traces.publish(trace_message(result, run.trace, run.method, 'comparison'))
        if self._statuses.heard:
            self._statuses.publish(comparison_message(result, runs, self._name))
        if self._paths.heard:
            self._paths.publish(paths_message(result, runs))
