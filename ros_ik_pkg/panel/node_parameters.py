"""The node's parameters and those that the page has changed: what the panel sends, and nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class NodeParameters:
    """Values by name.

    node: what the node said that it has. changed: what was set on the page, which a node that was started again gets
    anew; everything else stays as the node has it.
    """

    def __init__(self) -> None:
        self.node: dict[str, Any] = {}
        self.changed: dict[str, Any] = {}

    @property
    def shown(self) -> dict[str, Any]:
        """What the page shows."""
        return {**self.node, **self.changed}

    def take(self, values: Mapping[str, Any]) -> None:
        """Note what the node was given and has taken."""
        self.node |= values

    def take_back(self, names: Mapping[str, Any]) -> None:
        """Forget changes that the node refused."""
        for name in names:
            self.changed.pop(name, None)
