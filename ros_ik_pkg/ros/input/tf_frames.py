"""Frames that the robot does not have: looked up by TF if tf2_ros is installed."""

from __future__ import annotations

import threading
from types import ModuleType

import numpy as np
from builtin_interfaces.msg import Time as Stamp
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.time import Time

from ros_ik_pkg.ros.input.pose import stamp_text, transform_matrix
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.runtime.companion_node import companion_node
from ros_ik_pkg.ros.runtime.spin import spin


class TfFrames:
    """Looks transforms up in a buffer that a second node fills on its own thread.

    Transforms arrive at a high rate on many robots, so they must not delay targets, and the IK node keeps its one
    executor.
    """

    def __init__(self, node: Node) -> None:
        self._node, self._timeout = node, -1.0
        self._listening: _Listening | None = None
        self.why_not = ''  # why TF is not used; empty if it is

    def set_timeout(self, timeout: float) -> None:
        """Set how long targets wait for transforms [s]; 0: do not listen to TF."""
        if timeout == self._timeout:
            return
        self._timeout = timeout
        if timeout == 0.0:
            self.close()
            self.why_not = 'TF is not asked, because tf_timeout is 0'
        elif self._listening is None:
            self._listen()

    def _listen(self) -> None:
        try:
            import tf2_ros  # not on PyPI, so a node from wheels lacks it
        except ImportError as error:
            self.why_not = f'TF is not available here: {error}'
        else:
            self.why_not = ''
            self._listening = _Listening(tf2_ros, companion_node(self._node, 'tf_listener'))

    def base_from_frame(self, base: str, frame: str, stamp: Stamp, waited: float) -> np.ndarray | None:
        """Return the pose (4, 4) of a frame in the base frame at a stamp, 0: the newest, without waiting for it.

        None if TF does not have it yet and a target that has waited for `waited` [s] can still wait for it. Refuses the
        target after that.
        """
        tf2_ros, buffer = self._listening.tf2_ros, self._listening.buffer
        try:
            found = buffer.lookup_transform(base, frame, Time.from_msg(stamp))
        except (tf2_ros.TransformException, ValueError) as error:  # rclpy has no times before 0
            if waited < self._timeout:
                return None
            raise RefusedError(
                'frame',
                f'no transform from {frame!r} to {base!r} at stamp {_described(stamp)}, '
                f'waited {waited:.2f} s (tf_timeout {self._timeout:g} s): {error}',
            ) from error
        return transform_matrix(found.transform)

    def close(self) -> None:
        """Stop listening."""
        if self._listening is not None:
            self._listening.close()
        self._listening = None


class _Listening:
    """A buffer, and the thread that fills it."""

    def __init__(self, tf2_ros: ModuleType, node: Node) -> None:
        self.tf2_ros, self.buffer = tf2_ros, tf2_ros.Buffer()
        self._node, self._stop = node, threading.Event()
        # Without spin_thread=True: a listener's own thread cannot be joined in every release.
        self._listener = tf2_ros.TransformListener(self.buffer, node)
        executor = SingleThreadedExecutor(context=node.context)
        self._thread = threading.Thread(target=spin, args=(executor, node, self._stop.is_set), name='tf')
        self._thread.start()

    def close(self) -> None:
        """End the thread, then the node."""
        self._stop.set()
        self._thread.join()
        self._node.destroy_node()


def _described(stamp: Stamp) -> str:
    return stamp_text(stamp) if stamp.sec or stamp.nanosec else '0, the newest'
