"""Solves whole paths on a background thread, so that targets are solved meanwhile."""

from __future__ import annotations

import traceback
from typing import NamedTuple

from nav_msgs.msg import Path
from rclpy.node import Node

from ros_ik_pkg.ik import World
from ros_ik_pkg.ros.handling.path_handler import PathJob, PathResult, answer_path, read_path, refused
from ros_ik_pkg.ros.handling.result import INTERNAL_ERROR, SOLVED
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.output.path_messages import path_markers_message, path_result_message, path_trajectory_message
from ros_ik_pkg.ros.output.publisher import Publisher
from ros_ik_pkg.ros.runtime.background_worker import BackgroundWorker
from ros_ik_pkg.ros.runtime.node_names import name_in_statuses

WAITING = 100  # paths; all but the newest are refused
LOG_PERIOD = 1.0  # s


class _Numbered(NamedTuple):
    """A path and its place in the order of arrival."""

    number: int
    job: PathJob | PathResult


class Paths:
    """Publishes one result for each path; a new path replaces the one that is being solved."""

    def __init__(self, node: Node, handler: TargetHandler) -> None:
        self._node, self._handler, self._name = node, handler, name_in_statuses(node)
        self._motion = Publisher(node, topics.PATH_SOLUTION)
        self._result = Publisher(node, topics.PATH_RESULT)
        self._markers = Publisher(node, topics.PATH_MARKERS)
        self._newest, self._ended = 0, False
        self._worker: BackgroundWorker[_Numbered] = BackgroundWorker(node, 'paths', self._answer, WAITING)

    def take(self, message: Path) -> None:
        """Solve a path with the present settings, frames and joint states."""
        try:
            job = read_path(message, self._handler)
        except Exception as error:  # an unforeseen error must not end the node
            job = self._internal_error(message, error)
        self._newest += 1
        self._worker.submit(_Numbered(self._newest, job))

    def close(self) -> None:
        """End the present solve and the thread."""
        self._ended = True
        self._worker.close()

    def _answer(self, numbered: _Numbered) -> None:
        """Solve one path and publish: the motion, then the result."""
        job = numbered.job
        result = job if isinstance(job, PathResult) else self._solve(numbered.number, job)
        if result.outcome == SOLVED:
            self._motion.publish(path_trajectory_message(result))
        else:
            self._node.get_logger().warning(f'path {result.outcome}: {result.reason}', throttle_duration_sec=LOG_PERIOD)
        if result.solution is not None and self._markers.heard:
            self._markers.publish(path_markers_message(result))
        self._result.publish(path_result_message(result, self._name))

    def _solve(self, number: int, job: PathJob) -> PathResult:
        def go_on(_: int) -> None:
            if self._ended:
                raise RefusedError('shutdown', 'the node ends')
            if number != self._newest:
                raise RefusedError('superseded', 'a newer path came')
            if job.source is not self._handler.arm:
                raise RefusedError('superseded', 'the robot or its tool changed meanwhile')

        def newest() -> World | None:
            return self._handler.surroundings.newest(job.source, self._handler.settings)

        try:
            go_on(0)
            result = answer_path(job, go_on, newest)
            go_on(0)  # a motion that was replaced meanwhile must not start
        except RefusedError as error:
            return refused(job.message, error.status, str(error))
        except Exception as error:
            return self._internal_error(job.message, error)
        return result

    def _internal_error(self, message: Path, error: Exception) -> PathResult:
        self._node.get_logger().error(traceback.format_exc(), throttle_duration_sec=LOG_PERIOD)
        return refused(message, INTERNAL_ERROR, f'internal error {type(error).__name__}: {error}')
