"""The other side of DDS: sends targets, joint states and parameters, and notes what comes back and when."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically
from rclpy.client import Client
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState

from bench.judge import Judge
from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.interface.parameters import PARAMETERS
from ros_ik_pkg.ros.interface.topics import Topic
from ros_ik_pkg.ros.runtime.spin import make_executor
from ros_ik_pkg.tools.processes import ros_node
from ros_ik_pkg.tools.send_target import pose_message
from torture.waypoints import SECOND, is_of_a_sender

TIMEOUT = 20.0  # s without an answer: a hang
START_TIMEOUT = 60.0  # s
TOLERANCE = 1e-5  # m, rad: the default
DEFAULTS = {name: option.default for name, option in PARAMETERS.items()}


class Listener(Protocol):
    """Receives the results of targets that the peer did not send itself."""

    def solution(self, stamp: int, names: Sequence[str], positions: Sequence[float], arrived: float) -> None:
        """Store a solution and its time [s]."""

    def result(self, stamp: int, outcome: str) -> None:
        """Note a result."""


def full_name(namespace: str) -> str:
    """Return the full name of the node in a namespace."""
    return f'/{namespace}/{topics.NODE_NAME}' if namespace else f'/{topics.NODE_NAME}'


class Peer:
    """One client of the node in `namespace`, with increasing stamps that identify its targets.

    Several peers on one ROS node share an `executor`, and each of them handles messages for all.
    """

    def __init__(self, node: Node, arm: Arm, namespace: str = '', executor: Executor | None = None) -> None:
        self.node, self.arm, self.judge = node, arm, Judge(arm)
        self.name = full_name(namespace)
        self.executor = executor or make_executor()
        if executor is None:
            self.executor.add_node(node)
        self._stamp = SECOND
        self.on_others: Listener | None = None  # is told of answers to targets of others
        self.heard = 0  # results, whosever the target
        self.sent: dict[int, float] = {}  # when [s] a target went out, by stamp [ns]
        self.solutions: dict[int, JointState] = {}
        self.arrived: dict[int, float] = {}  # when its solution came
        self.outcomes: dict[int, str] = {}
        self.targets = self.publisher(topics.TARGET_POSE)
        self.joint_states = self.publisher(topics.JOINT_STATES)
        self._subscribe(topics.SOLUTION, self._on_solution)
        self._subscribe(topics.RESULT, self._on_result)
        self._one_by_one = node.create_client(SetParameters, f'{self.name}/set_parameters')
        self._atomically = node.create_client(SetParametersAtomically, f'{self.name}/set_parameters_atomically')
        self._values = node.create_client(GetParameters, f'{self.name}/get_parameters')

    def publisher(self, topic: Topic) -> Any:
        """Make a publisher of a topic that the node takes."""
        return self.node.create_publisher(topic.type, topic.of(self.name), topic.qos)

    def _subscribe(self, topic: Topic, callback: Callable[[Any], None]) -> None:
        self.node.create_subscription(topic.type, topic.of(self.name), callback, topic.qos)

    def _on_solution(self, message: JointState) -> None:
        stamp, now = _nanoseconds(message), time.monotonic()
        if stamp in self.sent:
            self.solutions[stamp], self.arrived[stamp] = message, now
        elif self.on_others and is_of_a_sender(stamp):
            self.on_others.solution(stamp, message.name, message.position, now)

    def _on_result(self, message: DiagnosticArray) -> None:
        stamp, outcome = _nanoseconds(message), message.status[0].name.rpartition(': ')[2]
        self.heard += 1
        if stamp in self.sent:
            self.outcomes[stamp] = outcome
        elif self.on_others and is_of_a_sender(stamp):
            self.on_others.result(stamp, outcome)

    def forget(self) -> None:
        """Start a new run: forget sent targets and results."""
        for notes in (self.sent, self.solutions, self.arrived, self.outcomes):
            notes.clear()

    def send(self, pose: PoseStamped) -> int:
        """Send a target under the next stamp; return the stamp [ns]."""
        self._stamp += 1
        pose.header.stamp.sec, pose.header.stamp.nanosec = divmod(self._stamp, SECOND)
        self.sent[self._stamp] = time.monotonic()
        self.targets.publish(pose)
        return self._stamp

    def send_joints(self, q: np.ndarray) -> None:
        """Send a joint state of the arm (n,)."""
        self.joint_states.publish(JointState(name=list(self.arm.joint_names), position=[float(v) for v in q]))

    def spin(self, seconds: float) -> None:
        """Handle messages for a time [s]."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self.executor.spin_once(timeout_sec=left)

    def spin_once(self) -> None:
        """Handle one pending message, if any."""
        self.executor.spin_once(timeout_sec=0.0)

    def wait(self, condition: Callable[[], object], timeout: float = TIMEOUT) -> bool:
        """Handle messages until a condition is true; return whether it is."""
        end = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > end:
                return False
            self.executor.spin_once(timeout_sec=0.01)
        return True

    def fault(self, q: np.ndarray, timeout: float = TIMEOUT) -> str:
        """Send joints and pose of q (n,) until it is solved; return the fault of the solution."""
        pose, end, stamps = self.pose(q), time.monotonic() + timeout, []
        while time.monotonic() < end:
            self.send_joints(q)
            stamps.append(self.send(pose))
            if self.wait(lambda: not self.solutions.keys().isdisjoint(stamps), 0.5):
                return next(filter(None, (self.wrongness(stamp, q) for stamp in stamps if stamp in self.solutions)), '')
        return f'no solution of a good target for {timeout:g} s; outcomes {set(self.outcomes.values()) or "none"}'

    def pose(self, q: np.ndarray) -> PoseStamped:
        """Return the tip's pose at q (n,) as a target."""
        return pose_message(self.arm.forward(q))

    def wrongness(self, stamp: int, q: np.ndarray) -> str:
        """Return the error of a solution for the pose of q (n,), by Pinocchio; empty if it is right."""
        message = self.solutions[stamp]
        if tuple(message.name) != self.arm.joint_names:
            return f'a solution for the joints {message.name}'
        solved = self.judge.solved(self.judge.forward(q[None]), np.array([message.position]), TOLERANCE)
        return '' if solved[0] else f'a wrong solution {list(message.position)}'

    def latencies(self) -> np.ndarray:
        """Return the times from sending a target to its solution [s]."""
        return np.array([arrived - self.sent[stamp] for stamp, arrived in self.arrived.items()])

    def set_parameters(
        self, changes: Sequence[ParameterMessage], atomically: bool = True, timeout: float = TIMEOUT
    ) -> list[Any] | None:
        """Set parameters and return the results, or None after the timeout."""
        client, kind = (
            (self._atomically, SetParametersAtomically) if atomically else (self._one_by_one, SetParameters)
        )
        response = self._call(client, kind.Request(parameters=list(changes)), timeout)
        if response is None:
            return None
        return [response.result] if atomically else response.results

    def all_values(self) -> str:
        """Return the values of all parameters as a text to compare; NaN equals NaN there. Raises RuntimeError."""
        response = self._call(self._values, GetParameters.Request(names=[*DEFAULTS, 'use_sim_time']), TIMEOUT)
        if response is None:
            raise RuntimeError('no answer of the parameter service')
        return repr(response.values)

    def _call(self, client: Client, request: Any, timeout: float) -> Any:
        """Call a service; return its response, or None after the timeout."""
        end = time.monotonic() + timeout
        if not self.wait(client.service_is_ready, timeout):
            return None
        future = client.call_async(request)
        return future.result() if self.wait(future.done, end - time.monotonic()) else None

    def unheard(self, timeout: float) -> str:
        """Ask until the parameter service answers: it drops answers to a client that it has not discovered yet."""
        end = time.monotonic() + timeout
        while self.set_parameters([], timeout=0.5) is None:
            if time.monotonic() > end:
                return f'no answer of the parameter service for {timeout:g} s'
        return ''

    def send_unanswered(self, changes: Sequence[ParameterMessage]) -> None:
        """Call the parameter service once for each change, and wait for nothing."""
        for change in changes:
            self._one_by_one.call_async(SetParameters.Request(parameters=[change]))
            self.spin(0.001)

    def set_values(self, values: Mapping[str, Any]) -> str:
        """Set parameters by name; return the fault."""
        plain = [(name, list(value) if isinstance(value, tuple) else value) for name, value in values.items()]
        results = self.set_parameters([Parameter(name, value=value).to_parameter_msg() for name, value in plain])
        if results is None:
            return f'no answer of the parameter service to {list(values)}'
        return '' if results[0].successful else f'refused: {results[0].reason}'

    def set_defaults(self) -> str:
        """Set every parameter to its default; return the fault."""
        return self.set_values(DEFAULTS)


def _nanoseconds(message: Any) -> int:
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


@contextlib.contextmanager
def connected(arm: Arm, namespace: str = '') -> Iterator[Peer]:
    """Make a peer in this process that the running node answers."""
    with ros_node('torture') as node:
        peer = Peer(node, arm, namespace)
        if fault := peer.fault(arm.home, START_TIMEOUT) or peer.unheard(START_TIMEOUT):
            raise RuntimeError(fault)
        yield peer
