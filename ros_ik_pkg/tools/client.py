"""A client of the IK node: one target out, everything that comes back for it in."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState

from ros_ik_pkg.ros import interface
from ros_ik_pkg.ros.interface import Topic

DISCOVERY_TIMEOUT = 10.0  # s; discovery takes up to 3 s on a quiet machine
ASK_AGAIN = 0.5  # s without an answer to the first question


class NodeError(RuntimeError):
    """The node is not there, does not answer, or refuses a parameter; the text says which."""


@dataclass
class Reply:
    """What the node said about one target: status, joint positions [rad, m] if solved, iterations."""

    status: DiagnosticStatus | None = None
    joints: dict[str, float] = field(default_factory=dict)
    iterations: list[dict[str, str]] = field(default_factory=list)

    @property
    def solved(self) -> bool:
        """Whether there are joint positions; anything else has its reason in `message`."""
        return self.status is not None and self.status.level == DiagnosticStatus.OK

    @property
    def message(self) -> str:
        """The node's sentence about the target."""
        return self.status.message if self.status else 'no result'

    @property
    def figures(self) -> dict[str, str]:
        """The figures of the result, by name."""
        return values(self.status) if self.status else {}


def values(status: DiagnosticStatus) -> dict[str, str]:
    """Return the key-value pairs of a diagnostic status."""
    return {pair.key: pair.value for pair in status.values}


class IkClient:
    """Talks to the IK node called `name` over its topics and its parameter services.

    with_iterations: also collect `~/iterations`, which makes the node compute them.
    """

    def __init__(self, node: Node, name: str = interface.NODE_NAME, with_iterations: bool = False) -> None:
        self.node = node
        self.name = name if name.startswith('/') else f'/{name}'
        self.replies: dict[tuple[int, int], Reply] = {}
        self.with_iterations = with_iterations
        self._targets = self._publisher(interface.TARGET_POSE)
        self._joint_states = self._publisher(interface.JOINT_STATES)
        self._subscribe(interface.SOLUTION, self._on_solution)
        self._subscribe(interface.RESULT, self._on_result)
        if with_iterations:
            self._subscribe(interface.ITERATIONS, self._on_iterations)
        self._parameters: AsyncParameterClient

    def connect(self, timeout: float = DISCOVERY_TIMEOUT) -> None:
        """Wait until messages pass both ways; raises NodeError after `timeout` seconds.

        DDS announces subscriptions in order, so an answer of the service that was made last proves that the node
        knows all of this client. The question, to set nothing, is repeated: a service drops its answer to a client
        that it has not discovered yet.
        """
        deadline = time.monotonic() + timeout
        self._parameters = AsyncParameterClient(self.node, self.name)
        if not self._parameters.wait_for_services(timeout):
            raise NodeError(
                f'no node {self.name} within {timeout:g} s; start it with scripts/run, and check that '
                'ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE are the same for both'
            )
        while not self._spin_until(
            self._parameters.set_parameters_atomically([]).done, min(deadline, time.monotonic() + ASK_AGAIN)
        ):
            if time.monotonic() > deadline:
                raise NodeError(f'{self.name} did not answer within {timeout:g} s')
        self._wait_until(self._targets.get_subscription_count, deadline, 'a subscription of targets')

    def solve(self, pose: PoseStamped, timeout: float) -> Reply:
        """Send a target under a new stamp and wait for what belongs to it; raises NodeError on silence."""
        pose.header.stamp = self.node.get_clock().now().to_msg()
        reply = self.replies.setdefault(_key(pose.header.stamp), Reply())
        self._targets.publish(pose)
        deadline = time.monotonic() + timeout
        self._wait_until(lambda: reply.status is not None, deadline, 'a result')
        if reply.solved:
            self._wait_until(lambda: reply.joints, deadline, 'the solution of a solved target')
        if self.with_iterations and 'iterations' in reply.figures:
            self._wait_until(lambda: reply.iterations, deadline, 'the iterations of a target')
        return reply

    def publish_joints(self, positions: Mapping[str, float]) -> None:
        """Publish joint positions [rad, m], as a robot does."""
        message = JointState(name=list(positions), position=list(positions.values()))
        message.header.stamp = self.node.get_clock().now().to_msg()
        self._joint_states.publish(message)

    def parameter(self, name: str) -> Any:
        """Return the value of a parameter of the node."""
        return parameter_value_to_python(self._call(self._parameters.get_parameters([name])).values[0])

    def parameter_type(self, name: str) -> int:
        """Return the type of a parameter that the node has, one of rcl_interfaces ParameterType."""
        return self._call(self._parameters.get_parameter_types([name])).types[0]

    def parameter_names(self) -> Sequence[str]:
        """Return the names of all parameters of the node."""
        return sorted(self._call(self._parameters.list_parameters()).result.names)

    def set_parameters(self, parameters: Mapping[str, Any]) -> None:
        """Set parameters by name, all or none; raises NodeError with the node's reason."""
        request = [Parameter(name, value=value) for name, value in parameters.items()]
        result = self._call(self._parameters.set_parameters_atomically(request)).result
        if not result.successful:
            raise NodeError(result.reason)

    def _topic(self, topic: Topic) -> str:
        """Resolve a name of the table as the node does."""
        if topic.name.startswith('~/'):
            return self.name + topic.name[1:]
        namespace = self.name.rpartition('/')[0]
        return f'{namespace}/{topic.name}'

    def _publisher(self, topic: Topic) -> Any:
        return self.node.create_publisher(topic.type, self._topic(topic), topic.qos)

    def _subscribe(self, topic: Topic, callback: Callable[[Any], None]) -> None:
        self.node.create_subscription(topic.type, self._topic(topic), callback, topic.qos)

    def _on_solution(self, message: JointState) -> None:
        self._reply(message).joints = dict(zip(message.name, message.position))

    def _on_result(self, message: DiagnosticArray) -> None:
        self._reply(message).status = message.status[0]

    def _on_iterations(self, message: DiagnosticArray) -> None:
        self._reply(message).iterations = [values(status) for status in message.status]

    def _reply(self, message: Any) -> Reply:
        """Find the reply that a message belongs to; other clients' targets get one that nobody reads."""
        return self.replies.get(_key(message.header.stamp)) or Reply()

    def _call(self, future: Any, deadline: float | None = None) -> Any:
        deadline = deadline or time.monotonic() + DISCOVERY_TIMEOUT
        self._wait_until(future.done, deadline, 'an answer of its parameter services')
        return future.result()

    def _wait_until(self, condition: Callable[[], object], deadline: float, what: str) -> None:
        if not self._spin_until(condition, deadline):
            raise NodeError(f'{self.name} did not send {what} in time')

    def _spin_until(self, condition: Callable[[], object], deadline: float) -> bool:
        """Take messages until the condition holds or the time is over; return which."""
        while not condition():
            if time.monotonic() > deadline:
                return False
            rclpy.spin_once(self.node, timeout_sec=0.1)
        return True


def _key(stamp: Time) -> tuple[int, int]:
    return stamp.sec, stamp.nanosec


@contextlib.contextmanager
def ros_node(name: str, args: Sequence[str] | None = None) -> Iterator[Node]:
    """Make a ROS node for the time of a program; Ctrl-C stays a KeyboardInterrupt."""
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node(name)
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
