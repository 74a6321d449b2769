"""Keeps page and node in step: whether the node is there, its parameters, and those that the page changes."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any, Protocol

from ros_ik_pkg.panel.node_link import NodeLink
from ros_ik_pkg.panel.node_parameters import NodeParameters

PATIENCE = 3.0  # s for an answer of a parameter service


class View(Protocol):
    """What the page does about it."""

    @property
    def parameter_names(self) -> list[str]:
        """Parameters that the page shows."""

    def node_gone(self) -> None:
        """Say that there is no node."""

    def take_node(self) -> bool:
        """Show the node's parameters and robot; return whether the robot can be shown here."""

    def refused(self, reason: str) -> None:
        """Say what the node refused, and show its values again."""

    def in_step(self) -> None:
        """Take note that the node has everything that the page shows."""


class NodeSync:
    """The parameters of the node, and whether they are those of the page.

    ready: whether the node has the robot of the page. alive: whether it is there.
    """

    def __init__(self, link: NodeLink, view: View) -> None:
        self._link, self._view = link, view
        self.parameters = NodeParameters()
        self.ready = self.alive = False
        self._ask_again = math.inf  # when to repeat a question about parameters
        self._questions = 0

    def watch(self) -> None:
        """Detect that the node appears or disappears; when it appears, synchronise page and node."""
        alive = self._link.alive
        unheard = alive and time.monotonic() > self._ask_again  # the first answers may get lost in discovery
        if alive == self.alive and not unheard:
            return
        self.alive, self.ready, self._ask_again = alive, False, math.inf
        if alive:
            self._read()
        else:
            self._view.node_gone()

    def _read(self) -> None:
        self._ask_again = time.monotonic() + PATIENCE
        self._link.get_parameters(self._view.parameter_names, self._take_over)

    def _take_over(self, values: dict[str, Any]) -> None:
        """Show the node's settings, and send it the changes made on the page."""
        self._ask_again = math.inf
        self.parameters.node = dict(values)
        if self._view.take_node():
            self._send(self.parameters.changed)

    def change(self, values: Mapping[str, Any]) -> None:
        """Set parameters of the node, now or when it appears."""
        self.parameters.changed |= values
        if self.alive:
            self._send(values)

    def change_robot(self, values: Mapping[str, Any]) -> None:
        """Set the parameters of another robot; the page waits until the node has it."""
        self.ready = False
        self.change(values)

    def _send(self, values: Mapping[str, Any]) -> None:
        """Send these parameters; the page is in step with the node once the newest of them are answered."""
        values = dict(values)
        self._questions += 1
        question = self._questions

        def done(refusal: str) -> None:
            newest = question == self._questions
            if newest:
                self._ask_again = math.inf
            if refusal:
                self._refused(values, refusal)
                return
            self.parameters.take(values)
            if newest:
                self.ready = True
                self._view.in_step()

        self._ask_again = time.monotonic() + PATIENCE
        self._link.set_parameters(values, done)

    def _refused(self, values: dict[str, Any], reason: str) -> None:
        """Take the changes back."""
        self.parameters.take_back(values)
        self._view.refused(reason)
        if not self.ready:
            self._read()
