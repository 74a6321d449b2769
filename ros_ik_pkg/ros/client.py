"""A client of the IK node: sends a target and returns everything that the node answers to it."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Mapping, Sequence
from threading import RLock
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory

from ros_ik_pkg.ik.text import did_you_mean, shorten
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.interface.topics import Topic
from ros_ik_pkg.ros.reply import PathMotions, PathReply, Reply, values
from ros_ik_pkg.ros.runtime.companion_node import companion_node
from ros_ik_pkg.ros.runtime.node_names import full_name

DISCOVERY_TIMEOUT = 10.0  # s; discovery takes up to 3 s on a quiet machine
ASK_AGAIN = 0.5  # s without an answer to the first question
SEND_AGAIN = 1.0  # s without an answer to a target: it was lost, or the node is slow or not there
SPIN_PERIOD = 0.1  # s, how often Ctrl-C is looked for
MILLISECOND, SECOND = 10**6, 10**9  # ns
WHAT_TO_CHECK = (
    'start it with scripts/run, and check that ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE are the same for both'
)


class NodeError(RuntimeError):
    """The node is not there, does not answer, or refuses a parameter; the text says which."""


class IkClient:
    """Talks to the IK node called `name` over its topics and its parameter services.

    The client has its own node beside `node` and spins it only while it waits. So its methods may be called from any
    thread and from callbacks, also while another thread spins `node`; calls of several threads take turns.
    An IK node that is restarted is found again.

    Parameters
    ----------
    node : rclpy.node.Node
        Any node of the program; its clock stamps the targets.
    name : str
        Name of the IK node, such as `/left/ik_node`; without a leading slash in the namespace of `node`.
    with_iterations : bool
        Also collect `~/iterations`, which makes the IK node compute them.
    with_joint_states : bool
        Also create a publisher of joint states, which needs the permission to publish them.

    Raises
    ------
    ValueError
        If `name` is not the name of a node.

    """

    def __init__(
        self,
        node: Node,
        name: str = topics.NODE_NAME,
        with_iterations: bool = False,
        with_joint_states: bool = False,
    ) -> None:
        self.name = full_name(name, node)
        self.with_iterations = with_iterations
        self.node = companion_node(node, f'client_of{self.name.replace("/", "_")}')
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(self.node)
        self._one_call = RLock()
        self._clock = node.get_clock()
        # So that two clients of one simulated clock, which stands still between its ticks, choose different stamps.
        self._newest_stamp = self._stamp_delay = random.randrange(MILLISECOND)
        self._pending: dict[tuple[int, int], Reply] = {}
        self._pending_frame = ''
        self._targets = self._publisher(topics.TARGET_POSE)
        # Created here, so that the node knows it when `connect` returns: messages published before that are lost.
        self._joint_states = self._publisher(topics.JOINT_STATES) if with_joint_states else None
        self._subscribe(topics.SOLUTION, self._on_solution)
        self._subscribe(topics.RESULT, self._on_result)
        if with_iterations:
            self._subscribe(topics.ITERATIONS, self._on_iterations)
        self._paths: Any = None  # publisher, made by the first call of solve_path
        self._path_stamp = (0, 0)
        self._path_motions = PathMotions()
        self._path_reply: PathReply | None = None
        self._parameters: AsyncParameterClient | None = None
        self._closed = False

    def __enter__(self) -> IkClient:
        """Return the client; leaving the `with` block closes it."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()

    def close(self) -> None:
        """Destroy the client's own node; `node` stays."""
        if self._closed:
            return
        self._closed = True
        self._executor.shutdown()
        self.node.destroy_node()

    def connect(self, timeout: float = DISCOVERY_TIMEOUT) -> None:
        """Wait until messages pass both ways; raises NodeError after `timeout` seconds.

        `solve` does this by itself; call it to learn early whether the node is there, or before using more topics.
        """
        deadline = self._deadline(timeout)
        if self._parameters is None:
            self._parameters = AsyncParameterClient(self.node, self.name)
        if not self._parameters.wait_for_services(timeout):
            raise NodeError(f'no node {self.name} within {timeout:g} s; {WHAT_TO_CHECK}')
        # DDS announces subscriptions in order, and publishers too, so an answer of the service that was made last
        # proves that the node knows all of this client. The question, to set nothing, is repeated: a service drops its
        # answer to a client that it has not discovered yet.
        while not self._spin_until(
            self._parameters.set_parameters_atomically([]).done, min(deadline, time.monotonic() + ASK_AGAIN)
        ):
            if time.monotonic() > deadline:
                raise NodeError(f'{self.name} did not answer within {timeout:g} s')
        self._wait_until(self._targets.get_subscription_count, deadline, 'a subscription of targets')

    def solve(self, pose: PoseStamped, timeout: float) -> Reply:
        """Send a target and return the node's reply.

        The target is stamped with the current time, whatever stamp `pose` has. It is sent again with a new stamp if
        nothing came back for a while, because a node that has just started may miss it.

        Parameters
        ----------
        pose : geometry_msgs.msg.PoseStamped
            The target, in the frame of its header; empty: the base frame. It is not modified.
        timeout : float
            Seconds to wait for the node and for its answer, both together.

        Raises
        ------
        NodeError
            If no answer came, or the client is closed. A target that is refused or cannot be reached has an answer.
        ValueError
            If `timeout` is not above 0.

        """
        with self._one_call:
            deadline = self._deadline(timeout)
            topic = self._targets.topic_name
            if not self._spin_until(self._targets.get_subscription_count, deadline):
                raise NodeError(f'no node takes targets on {topic} within {timeout:g} s; {WHAT_TO_CHECK}')
            self._pending, self._pending_frame = {}, shorten(pose.header.frame_id)
            while not self._spin_until(self._whole_reply, min(deadline, self._send(pose) + SEND_AGAIN)):
                if time.monotonic() >= deadline:
                    raise NodeError(
                        f'no answer of {self.name} within {timeout:g} s to a target that was sent '
                        f'{len(self._pending)} times on {topic}; does the node run, and is this its name?'
                    )
            return self._whole_reply()

    def solve_path(self, path: Path, timeout: float) -> PathReply:
        """Send a path and return its result, with the motion if the whole path is solved.

        Parameters
        ----------
        path : nav_msgs.msg.Path
            Poses in the frames of their headers, or of the path's header; empty: the base frame. Stamps of poses that
            differ are times to keep. The path is stamped with the current time; `path` is not modified.
        timeout : float
            Seconds to wait for the node and for its result, both together; the node's own limit is `path.deadline`.

        Raises
        ------
        NodeError
            If no result came, or the client is closed.
        ValueError
            If `timeout` is not above 0.

        """
        with self._one_call:
            deadline = self._deadline(timeout)
            self._listen_to_paths(deadline, timeout)
            sec, nanosec = self._path_stamp = self._new_stamp()
            self._path_reply = None
            self._path_motions.clear()
            header = Header(stamp=Time(sec=sec, nanosec=nanosec), frame_id=path.header.frame_id)
            self._paths.publish(Path(header=header, poses=path.poses))
            if not self._spin_until(self._whole_path_reply, deadline):
                raise NodeError(f'no answer of {self.name} within {timeout:g} s to a path on {self._paths.topic_name}')
            return self._path_reply

    def _listen_to_paths(self, deadline: float, timeout: float) -> None:
        """Make the publisher and the subscriptions of paths once, and wait until the node has found them."""
        if self._paths is None:
            self._path_subscriptions = [self._subscribe(topics.PATH_SOLUTION, self._on_path_solution),
                                        self._subscribe(topics.PATH_RESULT, self._on_path_result)]  # fmt: skip
            self._paths = self._publisher(topics.TARGET_PATH)
        heard = [subscription.get_publisher_count for subscription in self._path_subscriptions]
        if not self._spin_until(lambda: self._paths.get_subscription_count() and all(count() for count in heard),
                                deadline):  # fmt: skip
            raise NodeError(f'no node takes paths on {self._paths.topic_name} within {timeout:g} s; {WHAT_TO_CHECK}')

    def _on_path_solution(self, message: JointTrajectory) -> None:
        self._path_motions.add(message)

    def _on_path_result(self, message: DiagnosticArray) -> None:
        if (message.header.stamp.sec, message.header.stamp.nanosec) == self._path_stamp:
            self._path_reply = PathReply(message.status[0])

    def _whole_path_reply(self) -> bool:
        """Return whether everything that belongs to the path has arrived."""
        reply = self._path_reply
        if reply is None or not reply.solved:
            return reply is not None
        reply.trajectory = self._path_motions.of(reply.figures)
        return reply.trajectory is not None

    def publish_joints(self, positions: Mapping[str, float]) -> None:
        """Publish joint positions [rad, m], as a robot does; the first call waits a little for subscribers.

        Their order relative to targets is not kept: a target sent right after them may be handled before them.
        """
        if self._joint_states is None:
            raise TypeError('to publish joint states, make the client with_joint_states=True')
        self._spin_until(self._joint_states.get_subscription_count, time.monotonic() + SEND_AGAIN)
        message = JointState(name=list(positions), position=list(positions.values()))
        message.header.stamp = self._clock.now().to_msg()
        self._joint_states.publish(message)

    def parameter(self, name: str) -> Any:
        """Return the value of a parameter of the node; raises NodeError if it has none of this name."""
        value = parameter_value_to_python(self._ask('get_parameters', [name]).values[0])
        if value is None:
            self._refuse_unknown(name)
        return value

    def parameter_type(self, name: str) -> int:
        """Return the type of a parameter, one of rcl_interfaces ParameterType; raises NodeError as `parameter`."""
        self._refuse_unknown(name)  # first, because not every node answers a question about an unknown name
        return self._ask('get_parameter_types', [name]).types[0]

    def parameter_names(self) -> Sequence[str]:
        """Return the names of all parameters of the node."""
        return sorted(self._ask('list_parameters').result.names)

    def set_parameters(self, parameters: Mapping[str, Any]) -> None:
        """Set parameters by name, all or none; raises NodeError with the node's reason."""
        request = [Parameter(name, value=value) for name, value in parameters.items()]
        result = self._ask('set_parameters_atomically', request).result
        if not result.successful:
            raise NodeError(result.reason)

    def _refuse_unknown(self, name: str) -> None:
        """Raise NodeError with all names if the node has no parameter of this name."""
        names = self.parameter_names()
        if name not in names:
            meant = ' '.join(filter(None, [did_you_mean(name, names), 'it has']))
            raise NodeError(f'{self.name} has no parameter {name!r}; {meant} {", ".join(names)}')

    def _publisher(self, topic: Topic) -> Any:
        return self.node.create_publisher(topic.type, topic.of(self.name), topic.qos)

    def _subscribe(self, topic: Topic, callback: Callable[[Any], None]) -> Any:
        return self.node.create_subscription(topic.type, topic.of(self.name), callback, topic.qos)

    def _deadline(self, timeout: float) -> float:
        """Return the end of a timeout [s] that begins now."""
        self._refuse_closed()
        if not timeout > 0.0:
            raise ValueError(f'timeout is {timeout}; expected seconds above 0')
        return time.monotonic() + timeout

    def _refuse_closed(self) -> None:
        if self._closed:
            raise NodeError(f'the client of {self.name} is closed; expected a call before close() or in the with block')

    def _send(self, pose: PoseStamped) -> float:
        """Send the pending target with a stamp that was not used before; return the time of sending [s]."""
        sec, nanosec = stamp = self._new_stamp()
        self._pending[stamp] = Reply(stamp)
        header = Header(stamp=Time(sec=sec, nanosec=nanosec), frame_id=pose.header.frame_id)
        self._targets.publish(PoseStamped(header=header, pose=pose.pose))
        return time.monotonic()

    def _new_stamp(self) -> tuple[int, int]:
        """Return the current time [s, ns], or a little more if that stamp was used before."""
        now = self._clock.now().nanoseconds - self._stamp_delay
        # A clock that was set back, or a simulation that was restarted, is followed.
        self._newest_stamp = now if now < self._newest_stamp - SECOND else max(self._newest_stamp + 1, now)
        return divmod(self._newest_stamp, SECOND)

    def _whole_reply(self) -> Reply | None:
        """Return the first complete reply to any of the stamps that were sent."""
        return next((reply for reply in self._pending.values() if reply.is_whole(self.with_iterations)), None)

    def _on_solution(self, message: JointState) -> None:
        self._reply_to(message).joints = dict(zip(message.name, message.position))

    def _on_result(self, message: DiagnosticArray) -> None:
        if message.header.frame_id == self._pending_frame:
            self._reply_to(message).status = message.status[0]

    def _on_iterations(self, message: DiagnosticArray) -> None:
        self._reply_to(message).iterations = [values(status) for status in message.status]

    def _reply_to(self, message: Any) -> Reply:
        """Return the reply that a message belongs to; replies to other clients' targets are never read."""
        stamp = message.header.stamp.sec, message.header.stamp.nanosec
        return self._pending.get(stamp) or Reply(stamp)

    def _ask(self, question: str, *arguments: Any) -> Any:
        """Call one of the parameter services."""
        self._refuse_closed()
        if self._parameters is None:
            self.connect()
        return self._call(getattr(self._parameters, question)(*arguments))

    def _call(self, future: Any) -> Any:
        self._wait_until(future.done, time.monotonic() + DISCOVERY_TIMEOUT, 'an answer of its parameter services')
        return future.result()

    def _wait_until(self, condition: Callable[[], object], deadline: float, what: str) -> None:
        if not self._spin_until(condition, deadline):
            raise NodeError(f'{self.name} did not send {what} in time')

    def _spin_until(self, condition: Callable[[], object], deadline: float) -> bool:
        """Handle messages until the condition holds or the time is over; return whether it holds."""
        with self._one_call:
            self._refuse_closed()
            while not condition():
                if (left := deadline - time.monotonic()) <= 0.0:
                    return False
                self._executor.spin_once(timeout_sec=min(left, SPIN_PERIOD))
        return True
