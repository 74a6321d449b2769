"""The ROS adapter: messages in, messages out, parameters; the only part of the package that imports rclpy.

For programs: `from ros_ik_pkg.ros import IkClient, NodeError, PathReply, Reply`.
"""

from importlib import import_module
from importlib.util import find_spec
from typing import Any

if find_spec('rclpy') is None:
    raise ModuleNotFoundError(
        "this part of ros_ik_pkg needs ROS 2: source an installed one, or pip install 'ros_ik_pkg[ros]' (Linux x86_64)",
        name='rclpy',
    )

_MODULES = {'IkClient': 'client', 'NodeError': 'client', 'PathReply': 'reply', 'Reply': 'reply'}


def __getattr__(name: str) -> Any:
    """Import what programs use when they ask for it; the other modules need no client."""
    if name not in _MODULES:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module(f'{__name__}.{_MODULES[name]}'), name)
