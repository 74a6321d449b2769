"""The services ~/compute_ik and ~/compute_fk of MoveIt: requests become queries, and results become responses.

Without moveit_msgs there are no such services.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.handling.queries import PoseQuery, Queries
from ros_ik_pkg.ros.handling.result import INTERNAL_ERROR, SOLVED, Result
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.input.joint_states import read_positions
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.input.target import UNREAD, Target
from ros_ik_pkg.ros.interface import topics

LOG_PERIOD = 1.0  # s between log lines of one kind
IK, FK = 'compute_ik', 'compute_fk'
# The names of MoveItErrorCodes by the status of a result; other statuses become NO_IK_SOLUTION.
CODES = {
    'converged': 'SUCCESS',
    'deadline': 'TIMED_OUT',
    'frame': 'FRAME_TRANSFORM_FAILURE',
    'group': 'INVALID_GROUP_NAME',
    'link': 'INVALID_LINK_NAME',
    'robot_state': 'INVALID_ROBOT_STATE',
    'joint_states': 'ROBOT_STATE_STALE',
    'attached': 'COLLISION_CHECKING_UNAVAILABLE',
    'constraints': 'INVALID_GOAL_CONSTRAINTS',
    'not_finite': 'INVALID_GOAL_CONSTRAINTS',
    'position': 'INVALID_GOAL_CONSTRAINTS',
    'quaternion': 'INVALID_GOAL_CONSTRAINTS',
    'argument': 'FAILURE',
    'compiling': 'FAILURE',
    'no_robot': 'FAILURE',
    INTERNAL_ERROR: 'FAILURE',
}
CONSTRAINTS = ('joint', 'position', 'orientation', 'visibility')


class MoveItServices:
    """The two services.

    say(result, latency): reports the result of a request to ~/compute_ik later; latency [s].
    """

    def __init__(self, node: Node, handler: TargetHandler, say: Callable[[Result, float], None]) -> None:
        self._node, self._handler, self._say = node, handler, say
        self._queries, self._name = Queries(handler), node.get_name()
        self._others: tuple[Arm | None, list[str]] = None, []
        try:
            from moveit_msgs.msg import MoveItErrorCodes  # not on PyPI, so a node from wheels has none
            from moveit_msgs.srv import GetPositionFK, GetPositionIK
        except ImportError as error:
            node.get_logger().debug(f'no {topics.COMPUTE_IK}: {error}')
            return
        self._codes = {status: getattr(MoveItErrorCodes, name) for status, name in CODES.items()}
        self._no_solution = MoveItErrorCodes.NO_IK_SOLUTION
        node.create_service(GetPositionIK, topics.COMPUTE_IK, self._compute_ik)
        node.create_service(GetPositionFK, topics.COMPUTE_FK, self._compute_fk)

    def _compute_ik(self, request: Any, response: Any) -> Any:
        """Respond with the joints for a pose, or with an error code."""
        began, target = time.perf_counter(), UNREAD
        try:
            poses = request.ik_request.pose_stamped_vector
            target = Target.of(poses[0] if poses else request.ik_request.pose_stamped)
            result = self._queries.solve(self._read(request.ik_request, target))
            if result.outcome == SOLVED:
                self._write_state(result, request.ik_request.robot_state.joint_state, response.solution.joint_state)
        except RefusedError as error:
            result = self._queries.refused(IK, target, error)
        except Exception as error:  # an unforeseen error must not end the node
            result = self._internal_error(target, error)
        self._write_code(response.error_code, result.status, result.reason)
        self._say(result, time.perf_counter() - began)
        return response

    def _read(self, asked: Any, target: Target) -> PoseQuery:
        """Return the query in a PositionIKRequest; refuse what this node does not support."""
        group = self._handler.require_arm().name, self._handler.settings.group_name
        if group[1] and asked.group_name not in ('', *group):
            raise RefusedError('group', f'group_name is {shorten(asked.group_name, 60)!r}; expected {group[1]!r}')
        links = asked.ik_link_names
        if len(asked.pose_stamped_vector) > 1:
            same = len(links) == len(asked.pose_stamped_vector)
            raise RefusedError(
                'poses' if same else 'link', f'{len(asked.pose_stamped_vector)} poses for {len(links)} links; this arm '
                'has one tip'
            )  # fmt: skip
        if any(len(getattr(asked.constraints, f'{kind}_constraints')) for kind in CONSTRAINTS):
            raise RefusedError('constraints', 'constraints are not supported; expected none')
        if asked.avoid_collisions and len(asked.robot_state.attached_collision_objects):
            raise RefusedError('attached', 'attached_collision_objects are not read: publish them on '
                               'attached_collision_object')  # fmt: skip
        return PoseQuery(
            IK, target, self._joints(asked.robot_state.joint_state),
            (links[0] if links else '') if asked.pose_stamped_vector else asked.ik_link_name,
            asked.avoid_collisions, max(asked.timeout.sec + 1e-9 * asked.timeout.nanosec, 0.0),
        )  # fmt: skip

    def _joints(self, message: JointState) -> dict[str, float]:
        """Return the positions of the robot's joints in a joint state by name [rad, m]."""
        known = self._handler.require_arm().tree.joint_named
        try:
            wanted = [name for name in dict.fromkeys(message.name) if name in known]
            return read_positions(message.name, message, wanted)
        except ValueError as error:
            raise RefusedError('robot_state', f'robot_state has {error}') from None

    def _write_state(self, result: Result, asked: JointState, state: JointState) -> None:
        """Write the solution, followed by the positions of the robot's other joints."""
        arm = result.arm
        names, positions = list(arm.joint_names), result.solution.q.tolist()
        if others := self._other_joints(arm):
            known = self._handler.joint_states.positions(others) | self._joints(asked)
            names += [name for name in others if name in known]
            positions += [known[name] for name in others if name in known]
        state.name, state.position = names, positions
        state.header.frame_id = arm.base_frame  # without a stamp, as move_group responds

    def _other_joints(self, arm: Arm) -> list[str]:
        """Return the names of the joints outside the chain that move; the same list while the robot is the same."""
        if not arm.same_robot(self._others[0]):
            names = [joint.name for joint in arm.tree.joints if joint.movable and joint.name not in arm.joint_names]
            self._others = arm, names
        return self._others[1]

    def _compute_fk(self, request: Any, response: Any) -> Any:
        """Respond with the poses of links."""
        try:
            if not request.fk_link_names:
                raise RefusedError('link', 'fk_link_names is empty')
            frame = request.header.frame_id
            joints = self._joints(request.robot_state.joint_state)
            poses, response.fk_link_names, fault = self._queries.poses(frame, request.fk_link_names, joints)
            header = Header(
                stamp=self._node.get_clock().now().to_msg(), frame_id=frame or self._handler.require_arm().base_frame
            )
            response.pose_stamped = [_stamped(pose, header) for pose in poses]
            status = 'link' if fault else 'converged'
        except RefusedError as error:
            status, fault = error.status, str(error)
        except Exception as error:
            result = self._internal_error(UNREAD, error)
            status, fault = result.status, result.reason
        if fault:
            self._node.get_logger().warning(f'{FK} refused: {shorten(fault, 1000)}', throttle_duration_sec=LOG_PERIOD)
        self._write_code(response.error_code, status, fault)
        return response

    def _write_code(self, code: Any, status: str, reason: str) -> None:
        """Write the code of a status, and the reason if this version of moveit_msgs has a field for it."""
        code.val = self._codes.get(status, self._no_solution)
        if hasattr(code, 'message'):
            code.message, code.source = reason, self._name

    def _internal_error(self, target: Target, error: Exception) -> Result:
        self._node.get_logger().error(traceback.format_exc(), throttle_duration_sec=LOG_PERIOD)
        result = self._handler.internal_error(target, error)
        result.service = IK
        return result


def _stamped(pose: np.ndarray, header: Header) -> PoseStamped:
    message = PoseStamped(header=header)
    p, q = message.pose.position, message.pose.orientation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = pin.SE3ToXYZQUAT(pin.SE3(pose)).tolist()
    return message
