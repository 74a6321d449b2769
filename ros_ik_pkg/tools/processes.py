"""Nodes for the time of a program: one in this process, others in processes of their own."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

STOP_TIMEOUT = 10.0  # s


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


@contextlib.contextmanager
def running(module: str, *arguments: str, **options: Any) -> Iterator[subprocess.Popen[bytes]]:
    """Run a module as a process, and stop it as Ctrl-C would; `options` are those of Popen."""
    process = subprocess.Popen([sys.executable, '-m', module, *arguments], start_new_session=True, **options)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(timeout=STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
