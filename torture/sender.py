"""A process that only sends targets and joint states, so that it keeps its rates.

It sends to one node or alternately to several, each with the stamps of a separate client (`waypoints.py`). Every
line of its input is a JSON order: rates and a duration, or stop. After an order it prints what it sent.
"""

from __future__ import annotations

import json
import math
import sys
import threading
import time
from queue import SimpleQueue
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import JointState

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.tools.processes import ros_node
from ros_ik_pkg.tools.send_target import pose_message
from torture.waypoints import SECOND, WAYPOINTS, Stamps, waypoints

DISCOVERY = 60.0  # s


def main(robot: str, seed: str, first_client: str, *names: str) -> None:
    """Follow orders until the input is closed."""
    orders: SimpleQueue[str] = SimpleQueue()
    threading.Thread(target=_read, args=[orders], daemon=True).start()
    with ros_node('sender') as node:
        sender = Sending(node, robot, int(seed), int(first_client), names, orders)
        sender.wait_for_nodes()
        print(json.dumps('ready'), flush=True)
        while order := orders.get():
            print(json.dumps(sender.send(**json.loads(order))), flush=True)


def _read(orders: SimpleQueue[str]) -> None:
    for line in sys.stdin:
        orders.put(line)
    orders.put('')


class Sending:
    """Publishers for the nodes of these full names, and messages that were made beforehand."""

    def __init__(
        self, node: Node, robot: str, seed: int, first_client: int, names: tuple[str, ...], orders: SimpleQueue[str]
    ) -> None:
        arm = load_arm(robot)
        joints = waypoints(arm, seed)
        self._poses = [pose_message(arm.forward(q)) for q in joints]
        self._states = [JointState(name=list(arm.joint_names), position=q.tolist()) for q in joints]
        self._targets, self._joint_states = (
            [node.create_publisher(topic.type, topic.of(name), topic.qos) for name in names]
            for topic in (topics.TARGET_POSE, topics.JOINT_STATES)
        )
        self._first_client, self._stamps, self._orders = first_client, Stamps(), orders
        self._number = 0

    def wait_for_nodes(self) -> None:
        """Wait until every publisher has a subscriber; raises RuntimeError."""
        end = time.monotonic() + DISCOVERY
        while not all(publisher.get_subscription_count() for publisher in (*self._targets, *self._joint_states)):
            if time.monotonic() > end:
                raise RuntimeError('a node is not found')
            time.sleep(0.01)

    def send(self, rate: float, joint_rate: float, seconds: float, count: float = math.inf) -> dict[str, Any]:
        """Send at these rates [Hz] for a duration [s], up to a number of targets, or until the next order."""
        began, targets, joints, last = time.monotonic(), 0, 0, {}
        while (elapsed := time.monotonic() - began) < seconds and targets < count and self._orders.empty():
            if joints <= elapsed * joint_rate:
                self._joint_states[joints % len(self._targets)].publish(self._states[self._number % WAYPOINTS])
                joints += 1
            if targets <= elapsed * rate:
                client, stamp = self._send_target()
                last[client] = stamp
                targets += 1
            rest = min(targets / rate, joints / joint_rate) - (time.monotonic() - began)
            time.sleep(max(rest, 0.0))
        if not self._orders.empty():
            self._orders.get()  # it was the word to stop
        return {'targets': targets, 'joint_states': joints, 'seconds': time.monotonic() - began, 'last': last}

    def _send_target(self) -> tuple[int, int]:
        """Send the next waypoint to the node whose turn it is; return the client and the stamp [ns]."""
        turn, which = self._number % len(self._targets), self._number % WAYPOINTS
        client, pose = self._first_client + turn, self._poses[which]
        stamp = self._stamps.next(client, which)
        pose.header.stamp.sec, pose.header.stamp.nanosec = divmod(stamp, SECOND)
        self._targets[turn].publish(pose)
        self._number += 1
        return client, stamp


if __name__ == '__main__':
    main(*sys.argv[1:])
