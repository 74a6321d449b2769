"""Names of nodes, with their namespaces."""

from __future__ import annotations

from rclpy.node import Node


def name_in_statuses(node: Node) -> str:
    """Return the name of a node for its statuses: with the namespace if it has one, to tell two arms apart."""
    return node.get_name() if node.get_namespace() == '/' else node.get_fully_qualified_name()
