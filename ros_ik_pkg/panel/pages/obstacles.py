"""Obstacles that the page adds and drags; the node hears of them as markers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser
from visualization_msgs.msg import Marker, MarkerArray

from ros_ik_pkg.ik import ArgumentError
from ros_ik_pkg.ik.text import shorten

NAMESPACE = 'panel'
BOX, BALL, NONE = 'Box', 'Ball', 'Remove all'
KINDS = {BOX: Marker.CUBE, BALL: Marker.SPHERE}
SIZE = 0.15  # m, edge or diameter
COLOUR, GIZMO = (150, 112, 72), 0.16
MOST = 20


@dataclass
class Item:
    """One obstacle: its kind, and its pose in the base frame."""

    kind: str
    position: np.ndarray  # (3,) [m]
    wxyz: np.ndarray  # (4,)


class Obstacles:
    """The obstacles of the page.

    changed: called after each change, on the thread that `later` hands it to.
    """

    def __init__(
        self, scene: viser.SceneApi, later: Callable[[Callable[[], object]], object], changed: Callable[[], object]
    ) -> None:
        self._scene, self._later, self._changed = scene, later, changed
        self._items: dict[int, Item] = {}
        self._handles: list[viser.SceneNodeHandle] = []
        self._drawn = self._next = 0

    def choose(self, kind: str, position: np.ndarray) -> None:
        """Add an obstacle of a kind at a position (3,) [m], or remove all; raises ArgumentError."""
        if kind == NONE:
            self._items.clear()
        elif kind not in KINDS:
            raise ArgumentError(f'no obstacle {shorten(kind, 40)!r}; expected one of {", ".join((*KINDS, NONE))}')
        elif len(self._items) >= MOST:
            raise ArgumentError(f'there are {MOST} obstacles already')
        else:
            self._next += 1
            self._items[self._next] = Item(kind, np.array(position, dtype=float), np.array([1.0, 0.0, 0.0, 0.0]))
        self.draw()
        self._changed()

    def message(self) -> MarkerArray:
        """Return all obstacles as markers in the base frame, after one that deletes those before."""
        markers = [Marker(action=Marker.DELETEALL)]
        for number, item in self._items.items():
            marker = Marker(ns=NAMESPACE, id=number, type=KINDS[item.kind], action=Marker.ADD)
            marker.scale.x = marker.scale.y = marker.scale.z = SIZE
            p, q = marker.pose.position, marker.pose.orientation
            p.x, p.y, p.z = item.position.tolist()
            q.w, q.x, q.y, q.z = (item.wxyz / np.linalg.norm(item.wxyz)).tolist()
            markers.append(marker)
        return MarkerArray(markers=markers)

    @property
    def empty(self) -> bool:
        """Whether there are none."""
        return not self._items

    def draw(self) -> None:
        """Draw all anew, as after a reset of the scene."""
        for handle in self._handles:
            handle.remove()
        self._handles = []
        self._drawn += 1  # a page gives the pose of a node that was removed to the next of its name
        for number, item in self._items.items():
            name = f'/obstacles{self._drawn}/{number}'
            gizmo = self._scene.add_transform_controls(name, scale=GIZMO, position=item.position, wxyz=item.wxyz)
            if item.kind == BOX:
                self._scene.add_box(f'{name}/shape', dimensions=(SIZE,) * 3, color=COLOUR, opacity=0.8)
            else:
                self._scene.add_icosphere(f'{name}/shape', 0.5 * SIZE, color=COLOUR, opacity=0.8)
            self._handles.append(gizmo)

            @gizmo.on_update
            def _(event: viser.TransformControlsEvent, number: int = number) -> None:
                if event.client is not None:
                    position, wxyz = np.array(event.target.position), np.array(event.target.wxyz)
                    self._later(lambda: self.move(number, position, wxyz))

    def forget_drawing(self) -> None:
        """Take note that the scene was reset."""
        self._handles = []

    def move(self, number: int, position: np.ndarray, wxyz: np.ndarray) -> None:
        """Take the pose that an obstacle was dragged to; one that is none raises ArgumentError."""
        if number not in self._items:
            return
        if not (np.isfinite(position).all() and np.isfinite(wxyz).all() and np.linalg.norm(wxyz) > 0.0):
            raise ArgumentError('the pose of the obstacle is not finite')
        self._items[number].position, self._items[number].wxyz = position, wxyz
        self._changed()
