"""A node as a process: start, spin, stop by signal, and exit codes."""

from __future__ import annotations

import gc
import signal
import sys
import traceback
from collections.abc import Callable
from types import FrameType

import rclpy
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from ros_ik_pkg.ik import IkError, OptionError

CANNOT_START, BAD_VALUE = 1, 2  # exit codes
SPIN_PERIOD = 0.1  # s, how often a pending signal is looked for
LOG_PERIOD = 1.0  # s between tracebacks in the log


class StopFlag:
    """Set by SIGINT and SIGTERM; until the node spins, they interrupt what it does instead."""

    def __init__(self) -> None:
        self.stopped = False
        self.spinning = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._stop)

    def _stop(self, _number: int, _frame: FrameType | None) -> None:
        self.stopped = True
        if not self.spinning:
            raise KeyboardInterrupt


def run(make_node: Callable[[], Node], name: str, args: list[str] | None) -> int:
    """Make the node, spin it until a signal comes, and return the exit code."""
    flag = StopFlag()
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # whatever is wrong with the command line or the parameters file
        return _give_up(name, error, CANNOT_START)
    try:
        node = make_node()
        flag.spinning = True
        _spin(node, flag)
        node.destroy_node()
    except KeyboardInterrupt:
        pass
    except IkError as error:
        return _give_up(name, error, BAD_VALUE if isinstance(error, OptionError) else CANNOT_START)
    finally:
        rclpy.try_shutdown()
    return 0


def _give_up(name: str, error: Exception, code: int) -> int:
    print(f'{name}: cannot start: {error}', file=sys.stderr, flush=True)
    return code


def _spin(node: Node, flag: StopFlag) -> None:
    """Handle events until a signal comes; an error in one callback is logged and ends nothing."""
    executor = _make_executor()
    executor.add_node(node)
    gc.freeze()  # what is here now stays: the collector need not look at it again between two targets
    while not flag.stopped:
        try:
            executor.spin_once(timeout_sec=SPIN_PERIOD)  # without a timeout it would not see signals
        except Exception:
            node.get_logger().error(traceback.format_exc(), throttle_duration_sec=LOG_PERIOD)
    executor.remove_node(node)


def _make_executor() -> Executor:
    """Return the executor with the shortest delay that this rclpy has; both handle one callback at a time."""
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor()
    return EventsExecutor()
