"""The tool on the arm: it is always that of the parameter `tool`, which messages set too."""

from __future__ import annotations

from collections.abc import Callable

from geometry_msgs.msg import PoseStamped, TransformStamped
from rclpy.node import Node
from rclpy.parameter import Parameter

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ik.model.tool import read_tool
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.interface.parameters import TOOL, Settings

LOG_PERIOD = 1.0  # s between log lines, however often the tool changes


class Tools:
    """Puts the tool of the settings on the arm, and messages into the settings.

    arm: returns the present arm. A message that arrives before there is one waits for it.
    """

    def __init__(self, node: Node, arm: Callable[[], Arm | None]) -> None:
        self._node, self._arm = node, arm
        self._waiting: TransformStamped | PoseStamped | None = None
        self._sent: tuple[tuple[float, ...], str] = ((), '')  # numbers of the last message, and its child frame

    def mounted(self, arm: Arm, settings: Settings) -> Arm:
        """Return the arm with the tool of the settings; itself if it has that. Raises ArgumentError."""
        pose = read_tool(settings.tool)
        frame = self._sent[1] if settings.tool == self._sent[0] else ''
        if (pose == arm.tip_from_tool).all() and frame in ('', arm.tool_frame):
            return arm
        return arm.with_tool(pose, frame)

    def take(self, message: TransformStamped | PoseStamped) -> None:
        """Set the parameter to the tool of a message, from the next target on; log the reason if it is refused."""
        arm = self._arm()
        if arm is None:
            self._waiting = message
            return
        frame = message.header.frame_id.removeprefix('/')
        if frame not in ('', arm.tip_frame):
            self._refuse(f'its frame_id is {shorten(frame, 60)!r}; expected the tip frame {arm.tip_frame!r}')
            return
        before = self._sent
        self._sent = _numbers(message), _child_frame(message)
        if self._sent != before or tuple(self._node.get_parameter(TOOL).value) != self._sent[0]:
            result = self._node.set_parameters_atomically(
                [Parameter(TOOL, Parameter.Type.DOUBLE_ARRAY, list(self._sent[0]))]
            )
            if not result.successful:
                self._sent = before
                self._refuse(result.reason)

    def take_waiting(self) -> None:
        """Take the message that waits for an arm, if there is an arm by now."""
        if self._waiting is not None and self._arm() is not None:
            waiting, self._waiting = self._waiting, None
            self.take(waiting)

    def _refuse(self, why: str) -> None:
        self._node.get_logger().error(f'tool refused: {why}', throttle_duration_sec=LOG_PERIOD)


def _numbers(message: TransformStamped | PoseStamped) -> tuple[float, ...]:
    """Return x y z [m] and the quaternion x y z w of a tool."""
    if isinstance(message, TransformStamped):
        p, q = message.transform.translation, message.transform.rotation
    else:
        p, q = message.pose.position, message.pose.orientation
    return p.x, p.y, p.z, q.x, q.y, q.z, q.w


def _child_frame(message: TransformStamped | PoseStamped) -> str:
    """Return the name that a message gives to the tool's frame, empty for none."""
    return message.child_frame_id.removeprefix('/') if isinstance(message, TransformStamped) else ''
