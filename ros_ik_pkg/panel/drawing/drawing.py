"""Interface of the drawings of an arm."""

from __future__ import annotations

import viser


class Drawing:
    """All that is drawn below one frame, its root; seen and hidden with it."""

    def __init__(self, root: viser.FrameHandle) -> None:
        self._root = root

    @property
    def visible(self) -> bool:
        """Whether the arm is to be seen."""
        return self._root.visible

    @visible.setter
    def visible(self, visible: bool) -> None:
        self._root.visible = visible
