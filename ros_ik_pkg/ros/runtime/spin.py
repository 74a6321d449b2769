"""The life of a node: init, spin, stop, and exit codes."""

from __future__ import annotations

import gc
import sys
import traceback
from collections.abc import Callable

import rclpy
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from ros_ik_pkg.ik import IkError, OptionError
from ros_ik_pkg.ros.interface.topics import NODE_NAME
from ros_ik_pkg.ros.runtime.stop_flag import StopFlag

CANNOT_START, BAD_VALUE = 1, 2  # exit codes
SPIN_PERIOD = 0.1  # s, how often a pending signal is looked for
SWITCH_INTERVAL = 0.0005  # s that another thread may continue while a target waits for the interpreter
LOG_PERIOD = 1.0  # s between tracebacks in the log


def run(make_node: Callable[[], Node], flag: StopFlag, args: list[str] | None) -> int:
    """Make the node, spin it until the flag is set, and return the exit code."""
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # any error in the command line or the parameters file
        print(f'{NODE_NAME}: cannot start: {error}', file=sys.stderr, flush=True)  # without init there is no ROS log
        return CANNOT_START
    try:
        node = make_node()
        flag.spinning = True
        sys.setswitchinterval(SWITCH_INTERVAL)
        gc.freeze()  # these objects stay: the collector need not scan them between two targets
        gc.enable()
        spin(make_executor(), node, lambda: flag.stopped)
        node.destroy_node()
    except IkError as error:
        get_logger(NODE_NAME).fatal(f'cannot start: {error}')
        return BAD_VALUE if isinstance(error, OptionError) else CANNOT_START
    finally:
        rclpy.try_shutdown()
    return 0


def spin(executor: Executor, node: Node, stopped: Callable[[], bool]) -> None:
    """Handle the events of a node until it is stopped; errors in callbacks are logged."""
    executor.add_node(node)
    while not stopped() and node.context.ok():
        try:
            executor.spin_once(timeout_sec=SPIN_PERIOD)  # without a timeout it would not notice that it is stopped
        except Exception:
            if node.context.ok():  # a signal during the start shuts down the context while other threads spin
                node.get_logger().error(traceback.format_exc(), throttle_duration_sec=LOG_PERIOD)
    executor.remove_node(node)


def make_executor() -> Executor:
    """Return the executor with the shortest delay that this rclpy has; both handle one callback at a time."""
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor()
    return EventsExecutor()
