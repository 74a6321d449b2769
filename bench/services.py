"""Calls of ~/compute_ik and of an empty service of the same type, in turns."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rclpy.executors import Executor
from rclpy.node import Node
from sensor_msgs.msg import JointState
from tqdm import tqdm

from bench.cases import make_case
from bench.process import ROOT
from bench.ros import TIMEOUT, running
from ros_ik_pkg.ik import Arm, load_arm
from ros_ik_pkg.ros.client import NodeError
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.runtime.spin import make_executor
from ros_ik_pkg.tools.domain import own_domain
from ros_ik_pkg.tools.processes import ros_node
from ros_ik_pkg.tools.send_target import pose_message

SERVICE_HEAD = ['node', 'calls', 'p50 us', 'p99 us', 'p50 over empty', 'answered with a solution %']
SERVICE_TEXT = (
    'Calls one after the other from another process, one of each in turns: ~/compute_ik for poses of a closed path of '
    '{arm}, each with the joints of the pose before as robot_state, and a service of this type that answers with an '
    'empty response.'
)
SIDES = ('empty', 'ik')
CALLS, WARM_UP = 3000, 100
CACHE = Path.home() / '.cache' / 'ros_ik_pkg' / 'moveit_stand_in'


def service_rows(robot: str) -> Iterator[tuple[str, str, list[list[str]]]]:
    """Yield title, text and table; nothing if there is no moveit_msgs and none can be made."""
    sys.path.insert(0, str(ROOT / 'test'))
    import moveit_helpers

    if why := moveit_helpers.why_not():
        yield 'Service over ROS', f'Not measured: {why}.', []
        return
    moveit_helpers.provide(CACHE)
    arm = load_arm(robot)
    with own_domain(), ros_node('bench') as node, contextlib.ExitStack() as nodes:
        executor = make_executor()
        executor.add_node(node)
        for side in SIDES:
            nodes.enter_context(running(_command(side, robot), side))
        callers = {side: Caller(node, executor, side) for side in SIDES}
        requests = tqdm(_requests(arm), total=WARM_UP + CALLS, desc='service', leave=False)
        trips = np.array([[callers[side].call(request) for side in SIDES] for request in requests])[WARM_UP:]
        rows = [_row(side, trips[:, k], np.median(trips[:, 0]), callers[side].solved) for k, side in enumerate(SIDES)]
        yield 'Service over ROS', SERVICE_TEXT.format(arm=arm.name), [SERVICE_HEAD, *rows]


class Caller:
    """Calls one of the two services, and counts solutions."""

    def __init__(self, node: Node, executor: Executor, side: str) -> None:
        from moveit_msgs.srv import GetPositionIK

        self._executor, self.solved = executor, 0
        name = topics.COMPUTE_IK.replace('~', f'/{side}/{topics.NODE_NAME}')
        self._client = node.create_client(GetPositionIK, name)
        if not self._client.wait_for_service(TIMEOUT):
            raise NodeError(f'{name} is not there within {TIMEOUT:g} s')

    def call(self, request: Any) -> float:
        """Call once; return how long it takes [s]."""
        began = time.perf_counter()
        future = self._client.call_async(request)
        while not future.done():
            self._executor.spin_once(timeout_sec=1.0)
        took = time.perf_counter() - began
        self.solved += future.result().error_code.val == 1
        return took


def _command(side: str, robot: str) -> list[str]:
    if side == 'empty':
        return ['bench.ros_nodes', 'empty_service', '--ros-args']
    return ['ros_ik_pkg.ros.ik_node', '--ros-args', '-p', f'robot:={robot}', '-p', 'avoid_collisions:=false']


def _requests(arm: Arm) -> Iterator[Any]:
    from moveit_msgs.srv import GetPositionIK

    case = make_case(arm, 'tracking', WARM_UP + CALLS)
    for target, seed in zip(case.targets, case.seeds):
        request = GetPositionIK.Request()
        request.ik_request.group_name = arm.name
        request.ik_request.pose_stamped = pose_message(target, arm.base_frame)
        request.ik_request.robot_state.joint_state = JointState(name=list(arm.joint_names), position=seed.tolist())
        yield request


def _row(side: str, trips: np.ndarray, empty: float, solved: int) -> list[str]:
    """Write one row of SERVICE_HEAD."""
    p50, p99 = np.percentile(trips, [50, 99])
    share = '' if side == 'empty' else f'{100.0 * solved / (len(trips) + WARM_UP):.1f}'
    return [side, str(len(trips)), f'{1e6 * p50:.0f}', f'{1e6 * p99:.0f}', f'{p50 / empty:.2f}', share]
