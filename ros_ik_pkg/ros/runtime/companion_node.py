"""A second node in the process of another, for what must not wait for the first one's callbacks."""

from __future__ import annotations

import rclpy
from rclpy.node import Node


def companion_node(node: Node, role: str) -> Node:
    """Make a node in the namespace of `node`, named after it and its role; remappings of the program count for both."""
    name = f'_{node.get_name().lstrip("_")}_{role}'  # hidden: without services, ros2 param list would wait for it
    made = rclpy.create_node(
        name,
        context=node.context,
        namespace=node.get_namespace(),
        cli_args=['--ros-args', '-r', f'__node:={name}'],  # goes before a __node for the whole program
        enable_rosout=False,
        start_parameter_services=False,
    )
    let_owner_destroy(made)
    return made


def let_owner_destroy(node: Node) -> None:
    """Keep the context from destroying a node while it shuts down, as newer releases do, Kilted for one.

    The context then holds the lock that says whether it is shut down. The threads that `destroy_node` waits for ask
    that too, so neither would ever go on.
    """
    if hasattr(node.context, 'untrack_node'):
        node.context.untrack_node(node)
