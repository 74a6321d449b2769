"""A second node in the process of another, for what must not wait for the first one's callbacks."""

from __future__ import annotations

import rclpy
from rclpy.node import Node


def companion_node(node: Node, role: str) -> Node:
    """Make a node in the namespace of `node`, named after it and its role; remappings of the program count for both."""
    name = f'_{node.get_name().lstrip("_")}_{role}'  # hidden: without services, ros2 param list would wait for it
    return rclpy.create_node(
        name,
        context=node.context,
        namespace=node.get_namespace(),
        cli_args=['--ros-args', '-r', f'__node:={name}'],  # goes before a __node for the whole program
        enable_rosout=False,
        start_parameter_services=False,
    )
