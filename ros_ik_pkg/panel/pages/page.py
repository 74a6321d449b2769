"""What a page of the panel is: a closed folder of the tab *Motion* with controls and a drawing of its own.

A new page is a module in this folder with a subclass of Page, a line in PAGES of panel.py, and its texts in
markup/texts.py.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import viser

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.panel.drawing.scene import Scene
from ros_ik_pkg.panel.markup.texts import Texts
from ros_ik_pkg.panel.node_link import NodeLink


class Desk(Protocol):
    """What the panel does for its pages, on its own thread."""

    @property
    def target(self) -> np.ndarray:
        """The target (4, 4) in the base frame [m]."""

    @property
    def parameters(self) -> Mapping[str, Any]:
        """The node's parameters as the page shows them."""

    def set_target(self, target: np.ndarray) -> None:
        """Send another target (4, 4)."""

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Set parameters of the node."""

    def start_from(self, q: np.ndarray) -> None:
        """Take q (n,) [rad, m] as the seed, and the pose of its tip as the target."""

    def stand_at(self, q: np.ndarray, text: str) -> None:
        """Put the arm at q (n,) [rad, m]; the text says what that is."""

    def say(self, text: str) -> None:
        """Show a notice for a while."""


@dataclass(frozen=True)
class Tools:
    """What every page works with. later: queue for the calls of viser's threads."""

    server: viser.ViserServer
    scene: Scene
    link: NodeLink
    texts: Texts
    later: Callable[[Callable[[], object]], object]
    desk: Desk

    def on(self, handle: Any, call: Callable[[Any], object]) -> None:
        """Have a call made with the handle's value when the user, not the program, changes it."""

        @handle.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                value = event.target.value
                self.later(lambda: call(value))

    def buttons(self, label: str, calls: Mapping[str, Callable[[], object]]) -> None:
        """Add a row of buttons, each with the key of its text and its call."""
        by_text = {self.texts[key]: call for key, call in calls.items()}
        group = self.server.gui.add_button_group(label, tuple(by_text))

        @group.on_click
        def _(event: viser.GuiEvent) -> None:
            text = event.target.value
            self.later(lambda: by_text[text]())


class Page:
    """A folder of the tab *Motion*. The panel calls these methods; a page overrides those that it needs."""

    title = ''  # key of its text
    parameters: tuple[str, ...] = ()  # of the node, that the page shows
    _arm: Arm  # of the page, from the first call of `begin` on
    drives = False  # whether the page moves the arm by itself: the panel sends neither joint states nor targets then

    def __init__(self, tools: Tools) -> None:
        self._tools, self._texts, self._desk = tools, tools.texts, tools.desk

    def add(self) -> None:
        """Add the controls; first of all, and again if the language of the page changes."""

    def begin(self, arm: Arm) -> None:
        """Begin with an arm, in a scene that was emptied."""
        self._arm = arm

    def show(self, parameters: Mapping[str, Any]) -> None:
        """Show the node's parameters."""

    def interrupt(self) -> None:
        """Let go of the arm: something else moves it."""

    def tick(self) -> None:
        """Go on; called 25 times a second."""
