"""The executable `panel`: serves the page until SIGINT or SIGTERM."""

from __future__ import annotations

import argparse
import contextlib
import io
import sys
import time

import rclpy
import viser
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from ros_ik_pkg.panel.exposure import stay_private, warning_about
from ros_ik_pkg.panel.panel import Panel
from ros_ik_pkg.ros.interface import NODE_NAME
from ros_ik_pkg.ros.stop_flag import StopFlag

TICK = 0.04  # s


def arguments() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(prog='panel', description=__doc__)
    parser.add_argument('--host', default='127.0.0.1', help='address to bind (default: %(default)s)')
    parser.add_argument('--port', type=int, default=8080, help='first port to try (default: %(default)s)')
    parser.add_argument('--node', default=NODE_NAME, help='name of the IK node (default: %(default)s)')
    return parser


def main(args: list[str] | None = None) -> int:
    """Run the panel; 0 when a signal ended it."""
    args = sys.argv if args is None else ['panel', *args]
    given = arguments().parse_args(remove_ros_args(args)[1:])
    flag = StopFlag()
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    try:
        serve(given, flag)
    except KeyboardInterrupt:  # while starting
        pass
    finally:
        rclpy.try_shutdown()
    return 0


def serve(given: argparse.Namespace, flag: StopFlag) -> None:
    """Serve the page until the flag is set."""
    if warning := warning_about(given.host):
        print(warning, file=sys.stderr, flush=True)
    with contextlib.redirect_stdout(io.StringIO()):  # viser's own banner
        server = viser.ViserServer(host=given.host, port=given.port, label='ros_ik_pkg', verbose=False)
    stay_private(server)
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    node = rclpy.create_node('panel')
    panel = Panel(server, node, given.node)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    print(f'panel: open http://{given.host}:{server.get_port()} in a browser; Ctrl-C ends it', flush=True)
    flag.spinning = True
    while not flag.stopped:
        spin_for(executor, TICK)
        panel.tick()
    node.destroy_node()
    server.stop()


def spin_for(executor: SingleThreadedExecutor, seconds: float) -> None:
    """Handle what comes in for so long."""
    deadline = time.monotonic() + seconds
    while (left := deadline - time.monotonic()) > 0.0:
        executor.spin_once(timeout_sec=left)


if __name__ == '__main__':
    sys.exit(main())
