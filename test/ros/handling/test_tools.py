"""The tool of messages becomes the parameter `tool`."""

from __future__ import annotations

from types import SimpleNamespace

from geometry_msgs.msg import PoseStamped

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.handling.tools import Tools


def test_a_tool_that_came_before_the_robot_is_taken_when_there_is_one():
    sent, arm = [], [None]

    def set_parameters(parameters):
        sent.append(parameters[0].value)
        return SimpleNamespace(successful=True, reason='')

    node = SimpleNamespace(
        get_logger=None, set_parameters_atomically=set_parameters,
        get_parameter=lambda name: SimpleNamespace(value=[]),
    )  # fmt: skip
    tools, message = Tools(node, lambda: arm[0]), PoseStamped()
    message.pose.position.z, message.pose.orientation.w = 0.2, 1.0
    tools.take(message)
    tools.take_waiting()
    assert sent == []
    arm[0] = load_arm('panda')
    tools.take_waiting()
    tools.take_waiting()
    assert sent == [[0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 1.0]]
