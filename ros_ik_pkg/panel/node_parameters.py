"""The node's parameters, and those changed on the page, which are the only ones that the panel sends."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class NodeParameters:
    """Values by name.

    node: values reported by the node. changed: values set on the page, which the panel sends again to a restarted node;
    all other parameters keep the node's values.
    """

    def __init__(self) -> None:
        self.node: dict[str, Any] = {}
        self.changed: dict[str, Any] = {}

    @property
    def shown(self) -> dict[str, Any]:
        """Return the values that the page shows."""
        return {**self.node, **self.changed}

    def take(self, values: Mapping[str, Any]) -> None:
        """Store values that the node accepted."""
        self.node |= values

    def take_back(self, names: Mapping[str, Any]) -> None:
        """Forget changes that the node refused."""
        for name in names:
            self.changed.pop(name, None)
