"""Start an IK node and the panel for it; one Ctrl-C ends both."""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys

from ros_ik_pkg.compare.problem import NOTES_ROBOT
from ros_ik_pkg.panel import panel_node

STOP_TIMEOUT = 10.0  # s
# Descents long enough for the transpose method to converge, tolerances at the lower end of the plots.
PARAMETERS = {'max_iterations': '2000', 'position_tolerance': '1.0e-6', 'orientation_tolerance': '1.0e-6'}


def arguments() -> argparse.ArgumentParser:
    """Describe the command line: that of the panel, and the robot."""
    common = panel_node.arguments()
    parser = argparse.ArgumentParser(prog='panel', description=__doc__, parents=[common], add_help=False)
    parser.add_argument('--robot', default=NOTES_ROBOT, help='name, .urdf, .xacro or DH .yaml (%(default)s)')
    return parser


def main() -> int:
    """Run both; returns 1 if the node ends by itself, which also ends the panel, or if the panel can't be served."""
    given = arguments().parse_args()
    try:
        panel_node.check_host(given.host)
    except OSError as error:  # said before there is a node, which could not yet be stopped quietly
        print(f'panel: {error}', file=sys.stderr, flush=True)
        return 1
    node = subprocess.Popen(node_command(given), start_new_session=True)  # Ctrl-C reaches it only through this process

    def ended() -> str:
        return '' if node.poll() is None else f'the IK node ended by itself, with code {node.returncode}'

    try:
        return panel_node.main(['--host', given.host, '--port', str(given.port), '--node', given.node], ended)
    finally:
        node.send_signal(signal.SIGINT)
        try:
            node.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            node.kill()


def node_command(given: argparse.Namespace) -> list[str]:
    """Return the command line of the node."""
    robot = given.robot.replace("'", "''")
    settings = {'robot': f"'{robot}'", **PARAMETERS}
    return [
        sys.executable, '-m', 'ros_ik_pkg.ros.ik_node', '--ros-args', '-r', f'__node:={given.node}',
        *(word for name, value in settings.items() for word in ('-p', f'{name}:={value}')),
    ]  # fmt: skip


if __name__ == '__main__':
    sys.exit(main())
