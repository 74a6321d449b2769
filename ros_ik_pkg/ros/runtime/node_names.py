"""Names of nodes, with their namespaces."""

from __future__ import annotations

from rclpy.exceptions import InvalidTopicNameException
from rclpy.expand_topic_name import expand_topic_name
from rclpy.node import Node
from rclpy.validate_full_topic_name import validate_full_topic_name


def full_name(name: str, node: Node) -> str:
    """Return the full name of a node; relative names are in the namespace of `node`.

    Raises ValueError if it is not a valid name.
    """
    try:
        found = expand_topic_name(name, node.get_name(), node.get_namespace())
        validate_full_topic_name(found)
    except (TypeError, ValueError, InvalidTopicNameException) as error:
        why = ' '.join(str(error).split())
        raise ValueError(f'name of the IK node is {name!r}; expected a name such as ik_node or /left/ik_node: {why}') \
            from error
    return found


def name_in_statuses(node: Node) -> str:
    """Return the name of a node for its statuses: with the namespace if it has one, to tell two arms apart."""
    return short_name(node.get_fully_qualified_name())


def short_name(name: str) -> str:
    """Return the full name of a node as in its statuses: without the slash if it has no namespace."""
    return name.removeprefix('/') if name.count('/') == 1 else name
