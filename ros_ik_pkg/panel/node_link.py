"""The panel's connection to the topics and parameters of the IK node; never blocks, and queues what it receives."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pinocchio as pin
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Pose, PoseStamped
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.panel.answers import Answers
from ros_ik_pkg.ros.input.pose import stamp_text
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.interface.parameters import PARAMETERS, ListOption
from ros_ik_pkg.ros.runtime.node_names import full_name, short_name

SILENCE = 3.0  # s without /diagnostics, which come once a second, after which the node counts as gone


class NodeLink:
    """Talks to the IK node called `name`; `answers` has the results of the newest target.

    later: queue for the calls that messages and service responses cause.
    """

    def __init__(self, node: Node, name: str, later: Callable[[Callable[[], object]], object]) -> None:
        self._node, self._later = node, later
        self.name = full_name(name, node)
        self.answers = Answers()
        self._heard = -SILENCE  # when the node last gave a sign of life, by time.monotonic
        self._targets = self.publisher(topics.TARGET_POSE)
        self._joint_states = self.publisher(topics.JOINT_STATES)
        self._obstacles = self.publisher(topics.OBSTACLES)
        for topic, callback in (
            (topics.SOLUTION, self.answers.take_solution),
            (topics.RESULT, self.answers.take_result),
            (topics.TRACE, self.answers.take_trace),
            (topics.COMPARISON, self.answers.take_comparison),
            (topics.COMPARISON_PATHS, self.answers.take_paths),
            (topics.DIAGNOSTICS, self._on_diagnostics),
        ):
            self.listen(topic, callback)
        self._parameters = AsyncParameterClient(node, self.name)

    def _queued(self, callback: Callable[[Any], object]) -> Callable[[Any], None]:
        """Return a callback that queues this one, so that its exceptions are caught."""
        return lambda message: self._later(lambda: callback(message))

    def listen(self, topic: topics.Topic, callback: Callable[[Any], None], queue: int = 0) -> Subscription:
        """Have the messages of a topic handled on the panel's thread; of a fast topic, so many wait for it."""
        qos = topic.qos
        qos.depth = queue or qos.depth
        return self._node.create_subscription(topic.type, topic.of(self.name), self._queued(callback), qos)

    def call(self, service: str, done: Callable[[str], object]) -> None:
        """Call a service of type std_srvs/Trigger, such as ~/map_reach; `done` gets what it answers."""
        client = self._node.create_client(Trigger, self.name + service.removeprefix('~'))

        def answered(future: Any) -> None:
            self._node.destroy_client(client)
            done(future.result().message)

        client.call_async(Trigger.Request()).add_done_callback(self._queued(answered))

    def leave(self, subscription: Subscription | None) -> None:
        """Listen no more."""
        if subscription is not None:
            self._node.destroy_subscription(subscription)

    def publisher(self, topic: topics.Topic) -> Publisher:
        """Return a publisher of a topic that the node hears."""
        return self._node.create_publisher(topic.type, topic.of(self.name), topic.qos)

    @property
    def alive(self) -> bool:
        """Whether the node was heard recently and its services are available."""
        return time.monotonic() - self._heard < SILENCE and self._parameters.services_are_ready()

    def now(self) -> Time:
        """Return the time for the stamp of a message."""
        return self._node.get_clock().now().to_msg()

    def publish_joints(self, arm: Arm, positions: np.ndarray) -> None:
        """Publish joint positions (n,) [rad, m], as a robot does."""
        message = JointState(name=list(arm.joint_names), position=positions.tolist())
        message.header.stamp = self.now()
        self._joint_states.publish(message)

    def publish_obstacles(self, message: MarkerArray) -> None:
        """Publish obstacles."""
        self._obstacles.publish(message)

    def send_target(self, arm: Arm, base_from_target: np.ndarray) -> None:
        """Send a target (4, 4) and drop the results of earlier ones."""
        message = PoseStamped()
        message.header.frame_id = arm.base_frame
        message.header.stamp = self.now()
        write_pose(message.pose, base_from_target)
        self.answers.expect(stamp_text(message.header.stamp))
        self._targets.publish(message)

    def set_parameters(self, values: Mapping[str, Any], done: Callable[[str], object]) -> None:
        """Set parameters atomically; `done` receives the reason of a refusal, or an empty text."""
        request = [_parameter(name, value) for name, value in values.items()]
        future = self._parameters.set_parameters_atomically(request)
        future.add_done_callback(self._queued(lambda answer: done(_refusal(answer))))

    def get_parameters(self, names: list[str], done: Callable[[dict[str, Any]], object]) -> None:
        """Ask for parameters; `done` gets them by name."""
        future = self._parameters.get_parameters(names)
        future.add_done_callback(self._queued(lambda answer: done(dict(zip(names, _values(answer))))))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        if any(status.name.startswith(f'{short_name(self.name)}:') for status in message.status):
            self._heard = time.monotonic()


def write_pose(message: Pose, base_from_target: np.ndarray) -> None:
    """Write a pose (4, 4) [m] to a message."""
    p, q = message.position, message.orientation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = pin.SE3ToXYZQUAT(pin.SE3(base_from_target)).tolist()


def _parameter(name: str, value: Any) -> Parameter:
    """Make a parameter of the declared type; an empty list does not tell its own."""
    if isinstance(value, (list, tuple)):
        texts = isinstance(PARAMETERS[name], ListOption)
        return Parameter(name, Parameter.Type.STRING_ARRAY if texts else Parameter.Type.DOUBLE_ARRAY, list(value))
    return Parameter(name, Parameter.Type.from_parameter_value(value), value)


def _values(answer: Any) -> list[Any]:
    return [parameter_value_to_python(value) for value in answer.result().values]


def _refusal(answer: Any) -> str:
    result = answer.result().result
    return '' if result.successful else result.reason
