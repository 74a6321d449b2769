"""For tests over DDS: the IK node as a process of its own, and a client that notes all that comes back."""

from __future__ import annotations

import contextlib
import math
import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path as FilePath

import numpy as np
import pinocchio as pin
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, String

from ros_ik_pkg.ros.client import IkClient, NodeError
from ros_ik_pkg.ros.input.target import Target
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.interface.parameters import PARAMETERS
from ros_ik_pkg.ros.reply import Reply, values
from ros_ik_pkg.tools.processes import ros_node

ROOT = FilePath(__file__).resolve().parents[1]
START_TIMEOUT = 900.0  # s; the first start on a machine compiles, a busy one for minutes
TIMEOUT = 60.0  # s; far beyond what anything here takes, on a busy machine too
# rclpy loads lark when a node is made or a message written, and lark a module that Python 3.12 calls deprecated.
allow_lark = pytest.mark.filterwarnings("ignore:module 'sre_.*' is deprecated:DeprecationWarning")
CALM = {'deadline': 10.0}  # s; no solve here takes a thousandth of it, unless a busy machine holds it up
DEFAULTS = {name: option.default for name, option in PARAMETERS.items()} | CALM
CALM_ARGUMENTS = [word for name, value in CALM.items() for word in ('-p', f'{name}:={value}')]


class Client(IkClient):
    """An IkClient that keeps every message of the node, by stamp, and can send what nobody should."""

    def __init__(self, node, name: str = topics.NODE_NAME) -> None:
        self.statuses: dict[tuple[int, int], list[DiagnosticStatus]] = defaultdict(list)
        self.solutions: dict[tuple[int, int], list[JointState]] = defaultdict(list)
        self.health: list[DiagnosticStatus] = []
        super().__init__(node, name, with_joint_states=True)
        self._descriptions = self._publisher(topics.ROBOT_DESCRIPTION)
        self._set_one_by_one = self.node.create_client(SetParameters, f'{self.name}/set_parameters')
        self.node.create_subscription(
            topics.DIAGNOSTICS.type, topics.DIAGNOSTICS.name, self._on_health, topics.DIAGNOSTICS.qos
        )

    def _on_solution(self, message: JointState) -> None:
        super()._on_solution(message)
        self.solutions[stamp_of(message)].append(message)

    def _on_result(self, message: DiagnosticArray) -> None:
        super()._on_result(message)
        self.statuses[stamp_of(message)].append(message.status[0])

    def _on_health(self, message: DiagnosticArray) -> None:
        self.health.append(message.status[0])

    def health_figure(self, name: str) -> int:
        """Return the sum of a count over the health reports that were kept."""
        return sum(int(values(status)[name]) for status in self.health)

    def connect(self, timeout: float = TIMEOUT) -> None:
        """Wait until messages pass both ways."""
        super().connect(timeout)

    def _send(self, pose: PoseStamped) -> float:
        """Send a target once, however long its answer takes: between those that are connected nothing is lost."""
        super()._send(pose)
        return math.inf

    def solve(self, pose: PoseStamped, timeout: float) -> Reply:
        """Leave in the pose the stamp under which it was answered, too."""
        reply = super().solve(pose, timeout)
        pose.header.stamp.sec, pose.header.stamp.nanosec = reply.stamp
        return reply

    def send(self, pose: PoseStamped) -> None:
        """Publish a target as it is, and wait for nothing."""
        self._targets.publish(pose)

    def send_joint_state(self, message: JointState) -> None:
        """Publish a joint state as it is."""
        self._joint_states.publish(message)

    def send_description(self, text: str) -> None:
        """Publish a robot description, latched."""
        self._descriptions.publish(String(data=text))

    def set_one(self, parameter: Parameter) -> str:
        """Set a parameter as `ros2 param set` does; return the reason of a refusal, else nothing."""
        request = SetParameters.Request(parameters=[parameter.to_parameter_msg()])
        result = self._call(self._set_one_by_one.call_async(request)).results[0]
        assert result.successful or result.reason
        return result.reason

    def refusal_of(self, **parameters) -> str:
        """Set parameters all at once and return the reason of the refusal that must follow."""
        try:
            self.set_parameters({name.replace('__', '.'): value for name, value in parameters.items()})
        except NodeError as error:
            return str(error)
        raise AssertionError(f'{parameters} were taken')

    def settle(self, pose: PoseStamped, wanted: Callable[[Reply], object], joint_state: JointState) -> Reply:
        """Send both again until the reply is the wanted one: the two topics have no common order."""
        deadline = time.monotonic() + TIMEOUT
        while True:
            self.send_joint_state(joint_state)
            reply = self.solve(pose, TIMEOUT)
            if wanted(reply):
                return reply
            assert time.monotonic() < deadline, reply.message

    def wait_for(self, condition: Callable[[], object], what: str) -> None:
        """Take messages until the condition holds."""
        self._wait_until(condition, time.monotonic() + TIMEOUT, what)


class TraceClient(Client):
    """A client that listens to iterations, trace and path as well."""

    def __init__(self, node, name: str = topics.NODE_NAME) -> None:
        self.traces: list[Float64MultiArray] = []
        self.iterations: list[DiagnosticArray] = []
        self.paths: list[Path] = []
        super().__init__(node, name)
        self._subscribe(topics.ITERATIONS, self.iterations.append)
        self._subscribe(topics.TRACE, self.traces.append)
        self._subscribe(topics.TCP_PATH, self.paths.append)


@contextlib.contextmanager
def node_process(log: FilePath, *ros_args: str) -> Iterator[subprocess.Popen]:
    """Run the node as a process; it must end within reason, with code 0 and without a traceback."""
    with log.open('wb') as output:
        process = subprocess.Popen(
            [sys.executable, '-m', 'ros_ik_pkg.ros.ik_node', '--ros-args', *CALM_ARGUMENTS, *ros_args],
            cwd=ROOT, stdout=output, stderr=subprocess.STDOUT,
        )  # fmt: skip
        try:
            yield process
        finally:
            process.send_signal(signal.SIGINT)
            try:
                code = process.wait(TIMEOUT)
            except subprocess.TimeoutExpired:
                process.kill()
                raise
    assert code == 0, log.read_text()


@contextlib.contextmanager
def connected(kind: type[Client], log: FilePath, *ros_args: str) -> Iterator[Client]:
    """Run a node and a client of it that have found each other."""
    with node_process(log, *ros_args) as process, ros_node('test_client') as node, kind(node) as client:
        wait_until_ready(process, log)
        client.connect()
        yield client


def wait_until_ready(process: subprocess.Popen, log: FilePath, word: str = 'ready: ') -> None:
    """Wait until the node says so, or something else instead; it may have to compile first."""
    deadline = time.monotonic() + START_TIMEOUT
    while word not in log.read_text():
        assert process.poll() is None and time.monotonic() < deadline, log.read_text()
        time.sleep(0.02)


def seconds_to_end(process: subprocess.Popen) -> float:
    """Wait for the end of a process; return the time [s] that it took, without that in which there was no core for it.

    On an idle machine that is all of the time. On a busy one the threads wait for a core, one or several at a time, and
    so does this one; /proc counts how long.
    """
    began, delays, threads = time.monotonic(), {}, FilePath(f'/proc/{process.pid}/task')
    while process.poll() is None:
        assert time.monotonic() < began + TIMEOUT, 'it does not end'
        for path in (FilePath('/proc/thread-self/schedstat'), *threads.glob('*/schedstat')):
            with contextlib.suppress(OSError, IndexError):  # the thread is gone
                delay = 1e-9 * int(path.read_text().split()[1])
                delays[path] = delays.get(path, (delay, 0.0))[0], delay
        time.sleep(0.005)
    return time.monotonic() - began - sum(last - first for first, last in delays.values())


def stamp_of(message) -> tuple[int, int]:
    """Return the stamp of a message as a key."""
    return message.header.stamp.sec, message.header.stamp.nanosec


def pose_of(base_from_tip: np.ndarray, frame: str = '') -> PoseStamped:
    """Return a (4, 4) pose as a message."""
    message = PoseStamped()
    message.header.frame_id = frame
    p, q = message.pose.position, message.pose.orientation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = pin.SE3ToXYZQUAT(pin.SE3(base_from_tip)).tolist()
    return message


def target_of(base_from_tip: np.ndarray, frame: str = '') -> Target:
    """Return a (4, 4) pose as the node takes it in."""
    return Target.of(pose_of(base_from_tip, frame))


def joint_state(names, positions) -> JointState:
    """Return joint positions as a message."""
    return JointState(name=list(names), position=[float(position) for position in positions])
