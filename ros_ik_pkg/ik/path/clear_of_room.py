"""The check of a path for contact with the arm itself and the world."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik.contacts.contacts import Room
from ros_ik_pkg.ik.contacts.lines import clear_lines
from ros_ik_pkg.ik.options import SolveOptions
from ros_ik_pkg.ik.path.path_options import PathOptions

MOST_SPARE = 1e-3  # m


class ClearOfRoom:
    """Whether configurations, and straight lines between them, are clear of contact in a room."""

    def __init__(self, room: Room, options: SolveOptions, path: PathOptions) -> None:
        # The motion in time leaves the straight lines between its rows by about as much as the tip may leave its line.
        self._margin = options.collision_margin + min(path.tolerance, MOST_SPARE)
        self._room, self._meshes = room, options.collision_geometry == 'mesh'

    def __call__(self, q: np.ndarray) -> np.ndarray:
        """Return whether each configuration (k, n) is clear, (k,) bool."""
        return self._room.clear(q, self._margin, self._meshes)

    def lines(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Return whether each straight line of the joints from start (k, n) to end (k, n) is clear, (k,) bool."""
        return clear_lines(self._room, start, end, self._margin, self._meshes)
