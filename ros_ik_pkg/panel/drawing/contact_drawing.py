"""The links that touch, in red: their shapes as the check for contact has them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import viser

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ik.contacts.bodies import Piece
from ros_ik_pkg.ik.contacts.coal_library import convex
from ros_ik_pkg.ik.exceptions import ArgumentError
from ros_ik_pkg.panel.drawing.arm_drawing import ROUND, wxyz_of

RED, OPACITY = (214, 40, 40), 0.75
LEAST_CORNERS = 4  # of a hull with a volume; what has fewer is drawn as balls


class ContactDrawing:
    """Draws the shapes of some links of an arm in red, where a configuration puts them."""

    def __init__(self, scene: viser.SceneApi, arm: Arm) -> None:
        self._scene, self._arm = scene, arm
        self._frames: list[viser.FrameHandle] = []
        self._shown = 0

    @property
    def links(self) -> tuple[str, ...]:
        """Names of the links that are red."""
        return tuple(frame.name.rpartition('/')[2] for frame in self._frames)

    def show(self, q: np.ndarray, names: Iterable[str]) -> None:
        """Draw those of the names that are links at q (n,) [rad, m]; nothing else stays red."""
        self.hide()
        links = [name for name in names if name in self._arm.frame_names]
        positions = dict(zip(self._arm.joint_names, q.tolist()))
        for link in links:
            try:
                base_from_link = self._arm.base_from_frame(link, {**self._at_rest(link), **positions})
            except ArgumentError:  # it hangs on a joint that has no single position
                continue
            self._shown += 1  # a page gives the pose of a frame that was removed to the next of its name
            frame = self._scene.add_frame(
                f'/contact{self._shown}/{link}', show_axes=False, wxyz=wxyz_of(base_from_link),
                position=base_from_link[:3, 3],
            )  # fmt: skip
            self._frames.append(frame)
            for number, piece in enumerate(self._arm.contacts.pieces_of(link)):
                self._draw(f'{frame.name}/{number}', piece)

    def hide(self) -> None:
        """Let nothing be red."""
        for frame in self._frames:
            frame.remove()
        self._frames = []

    def _at_rest(self, link: str) -> dict[str, float]:
        """Return positions of the joints outside the chain that place a link."""
        return dict.fromkeys(self._arm.joints_to(link), 0.0)

    def _draw(self, name: str, piece: Piece) -> None:
        cover = piece.cover
        if len(cover.points) < LEAST_CORNERS:
            for number, point in enumerate(cover.points):
                self._scene.add_icosphere(
                    f'{name}/{number}', max(cover.fine_radius, 1e-3), subdivisions=ROUND, color=RED, opacity=OPACITY,
                    position=point,
                )  # fmt: skip
            return
        hull = convex(cover.points)
        faces = [[hull.polygons(k)[corner] for corner in range(3)] for k in range(hull.num_polygons)]
        self._scene.add_mesh_simple(
            name, np.array(hull.points()), np.array(faces), color=RED, opacity=OPACITY, side='double'
        )
