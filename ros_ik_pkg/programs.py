"""Console programs that need ROS, which they name as what is missing if it is not there."""

from __future__ import annotations

import sys
from importlib import import_module


def ik_node() -> int:
    """Run the node."""
    return _run('ros.ik_node')


def demo() -> int:
    """Start a node, send it targets with every method, and check the solutions."""
    return _run('tools.demo')


def send_target() -> int:
    """Send one target to a running node and print the solution."""
    return _run('tools.send_target')


def send_path() -> int:
    """Send a path to a running node and print the motion."""
    return _run('tools.send_path')


def teleop() -> int:
    """Move the tip by keys."""
    return _run('tools.teleop')


def set_param() -> int:
    """Set a parameter of a running node."""
    return _run('tools.set_param')


def panel() -> int:
    """Serve the page for the browser."""
    return _run('panel.panel_node')


def _run(module: str) -> int:
    """Call the `main` of a module of this package; return its exit code, 1 without ROS."""
    try:
        import_module('ros_ik_pkg.ros')
    except ModuleNotFoundError as error:
        print(error, file=sys.stderr)
        return 1
    return import_module(f'ros_ik_pkg.{module}').main()
