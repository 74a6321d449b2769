"""The executable `panel`: serves the page until SIGINT or SIGTERM."""

from __future__ import annotations

import argparse
import contextlib
import io
import socket
import sys
import time
from collections.abc import Callable

import rclpy
import viser
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from ros_ik_pkg.panel.exposure import stay_private, warning_about
from ros_ik_pkg.panel.panel import Panel
from ros_ik_pkg.ros.interface.topics import NODE_NAME
from ros_ik_pkg.ros.runtime.stop_flag import StopFlag

TICK = 0.04  # s
LAST_PORT = 65535


def arguments() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(prog='panel', description=__doc__)
    parser.add_argument('--host', default='127.0.0.1', help='address to bind (default: %(default)s)')
    parser.add_argument('--port', type=port, default=8080, help='first port to try (default: %(default)s)')
    parser.add_argument('--node', default=NODE_NAME, help='name of the IK node (default: %(default)s)')
    return parser


def port(text: str) -> int:
    """Read a port that a server can have."""
    if not text.isdecimal() or not 1 <= int(text) <= LAST_PORT:
        raise argparse.ArgumentTypeError(f'{text!r} is not a port; expected 1 to {LAST_PORT}')
    return int(text)


def main(args: list[str] | None = None, end: Callable[[], str] = lambda: '') -> int:
    """Run the panel; 0 when a signal ended it, 1 when it cannot be served or `end` gives a reason to stop."""
    args = sys.argv if args is None else ['panel', *args]
    given = arguments().parse_args(remove_ros_args(args)[1:])
    flag = StopFlag()
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    try:
        check_host(given.host)
        reason = serve(given, flag, end)
    except KeyboardInterrupt:  # while starting
        return 0
    except (OSError, ValueError) as error:  # no such address, no free port; no name of a node
        reason = str(error)
    finally:
        rclpy.try_shutdown()
    if reason:
        print(f'panel: {reason}', file=sys.stderr, flush=True)
    return 1 if reason else 0


def check_host(host: str) -> None:
    """Raise OSError if this machine cannot serve on an address; viser would wait forever."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host or None, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.bind(address)
    except OSError as error:
        why = error.strerror or error
        raise OSError(f'cannot serve on --host {host}: {why}; expected an address of this machine') from error


def serve(given: argparse.Namespace, flag: StopFlag, end: Callable[[], str]) -> str:
    """Serve the page until the flag is set, or until `end` gives the reason that is returned."""
    if warning := warning_about(given.host):
        print(warning, file=sys.stderr, flush=True)
    with contextlib.redirect_stdout(io.StringIO()):  # viser's own banner
        server = viser.ViserServer(host=given.host, port=given.port, label='ros_ik_pkg', verbose=False)
    stay_private(server)
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    node = rclpy.create_node('panel')
    try:
        panel = Panel(server, node, given.node)
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        print(f'panel: open http://{given.host}:{server.get_port()} in a browser; Ctrl-C ends it', flush=True)
        flag.spinning = True
        while not flag.stopped and not (reason := end()):
            spin_for(executor, TICK)
            panel.tick()
        return '' if flag.stopped else reason
    finally:
        node.destroy_node()
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def spin_for(executor: SingleThreadedExecutor, seconds: float) -> None:
    """Handle incoming messages for a time [s]."""
    deadline = time.monotonic() + seconds
    while (left := deadline - time.monotonic()) > 0.0:
        executor.spin_once(timeout_sec=left)


if __name__ == '__main__':
    sys.exit(main())
