"""The methods side by side on the node's targets: after the solution, on a thread of its own."""

from __future__ import annotations

import threading
import traceback
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node

from ros_ik_pkg.compare import compare_methods
from ros_ik_pkg.ik import METHODS, SolveOptions
from ros_ik_pkg.ros import interface
from ros_ik_pkg.ros.answer import Answer
from ros_ik_pkg.ros.comparison_messages import comparison_message, paths_message
from ros_ik_pkg.ros.messages import trace_message

LOG_PERIOD = 1.0  # s between tracebacks in the log


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

    def __init__(self, node: Node, trace_publisher: Any) -> None:
        self._node = node
        self._statuses = interface.publisher(node, interface.COMPARISON)
        self._paths = interface.publisher(node, interface.COMPARISON_PATHS)
        self._traces = trace_publisher
        self._wake = threading.Condition()
        self._waiting: Job | None = None
        self._stopped = False
        self._thread: threading.Thread | None = None

    def submit(self, answer: Answer, compare: tuple[str, ...], options: SolveOptions) -> None:
        """Compare on an answered target, where methods are asked for and somebody listens."""
        methods = METHODS if 'all' in compare else compare
        if not methods or answer.solution is None or not self._wanted():
            return
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name='comparison')
            self._thread.start()
        with self._wake:
            self._waiting = Job(answer, methods, options)
            self._wake.notify()

    def close(self) -> None:
        """Finish what is under way and end the thread: one that still runs at exit aborts the process."""
        with self._wake:
            self._stopped = True
            self._wake.notify()
        if self._thread is not None:
            self._thread.join()

    def _wanted(self) -> bool:
        return any(map(interface.heard, (self._statuses, self._paths, self._traces)))

    def _work(self) -> None:
        """Take job after job until closed; an error in one ends nothing."""
        while job := self._next():
            try:
                self._publish(job)
            except Exception:
                self._node.get_logger().error(traceback.format_exc(), throttle_duration_sec=LOG_PERIOD)

    def _next(self) -> Job | None:
        """Wait for a job; None when closed."""
        with self._wake:
            self._wake.wait_for(lambda: self._waiting or self._stopped)
            job, self._waiting = self._waiting, None
            return None if self._stopped else job

    def _publish(self, job: Job) -> None:
        """Run the methods and publish: traces, then figures, so that who has the figures has the traces too."""
        answer = job.answer
        runs = compare_methods(answer.arm, answer.base_from_target, answer.seed, job.methods, job.options)
        if interface.heard(self._traces):
            for run in runs:
                self._traces.publish(trace_message(answer, run.trace, run.method, 'comparison'))
        if interface.heard(self._statuses):
            self._statuses.publish(comparison_message(answer, runs, self._node.get_name()))
        if interface.heard(self._paths):
            self._paths.publish(paths_message(answer, runs))
