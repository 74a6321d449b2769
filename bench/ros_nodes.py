"""The other nodes of the measurement over ROS: one that only echoes, one that only listens, one with an empty service.

    python -m bench.ros_nodes echo JOINTS --ros-args ...
    python -m bench.ros_nodes listen TOPIC [TOPIC ...] --ros-args ...
    python -m bench.ros_nodes empty_service --ros-args ...
"""

from __future__ import annotations

import sys

from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState

from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.runtime.spin import run
from ros_ik_pkg.ros.runtime.stop_flag import StopFlag


class Echo(Node):
    """Echo node: answers every target with constant joint positions, to measure the cost of ROS itself."""

    def __init__(self, joints: int) -> None:
        super().__init__(topics.NODE_NAME)
        self._names = [f'joint{k}' for k in range(joints)]
        self._positions = [0.0] * joints
        solution, topic = topics.SOLUTION, topics.TARGET_POSE
        self._solution = self.create_publisher(solution.type, solution.name, solution.qos)
        self.create_subscription(topic.type, topic.name, self._on_target, topic.qos)

    def _on_target(self, target: PoseStamped) -> None:
        self._solution.publish(JointState(header=target.header, name=self._names, position=self._positions))


class Listener(Node):
    """Subscribes to topics of the IK node and does nothing with them."""

    def __init__(self, names: list[str]) -> None:
        super().__init__('listener')
        for topic in topics.TOPICS:
            if topic.name in names:
                name = topic.name.replace('~', topics.NODE_NAME)
                self.create_subscription(topic.type, name, lambda message: None, topic.qos)


class EmptyService(Node):
    """Answers every request for joint positions with an empty response."""

    def __init__(self) -> None:
        from moveit_msgs.srv import GetPositionIK

        super().__init__(topics.NODE_NAME)
        self.create_service(GetPositionIK, topics.COMPUTE_IK, lambda request, response: response)


def main() -> int:
    """Run the node that the first argument names."""
    role, *arguments = sys.argv[1:]
    before = arguments[: arguments.index('--ros-args')]
    makers = {'echo': lambda: Echo(int(before[0])), 'listen': lambda: Listener(before), 'empty_service': EmptyService}
    return run(makers[role], StopFlag(), sys.argv)


if __name__ == '__main__':
    sys.exit(main())
