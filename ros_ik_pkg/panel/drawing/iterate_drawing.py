"""One iterate in the scene: columns of the Jacobian as arrows, manipulability ellipsoid, step, the other iterates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import viser

from ros_ik_pkg.compare.iterate import Iterate, ellipsoid_of
from ros_ik_pkg.compare.palette import rgb
from ros_ik_pkg.compare.skeleton import joint_origins
from ros_ik_pkg.ik import Arm
from ros_ik_pkg.panel.drawing.arm_drawing import size_of
from ros_ik_pkg.panel.markup.iterate_html import joint_colour
from ros_ik_pkg.panel.markup.joint_labels import short_names

LONGEST = 0.34  # of the arm's size: the longest linear arrow
AXIS = 0.13  # of the arm's size: an angular arrow
ELLIPSOID = 0.16  # of the arm's size: its longest half axis
SHAFT, HEAD, HEAD_LENGTH = 0.006, 0.015, 0.035  # of the arm's size
THIN = 0.45  # of that: angular arrows
NAMED = 0.15  # of the longest linear arrow: shorter ones would write their names over each other
PALE, MOST_SHADOWS = (150, 160, 175), 24  # the other iterates; of many, these are spread over all
ELLIPSOID_COLOUR = (120, 150, 190)


class IterateDrawing:
    """Nodes below one frame that exist only while an iterate is shown: hidden ones cost each frame of the page, too."""

    def __init__(self, scene: viser.SceneApi, arm: Arm, colour_of: Callable[[str], tuple[int, int, int]]) -> None:
        self._scene, self._arm, self._colour_of = scene, arm, colour_of
        self._size = size_of(arm)
        self._root: viser.FrameHandle | None = None

    def _add(self) -> None:
        scene, arm = self._scene, self._arm
        self._root = scene.add_frame('/iterate', show_axes=False)
        nothing = np.zeros((1, 2, 3))
        size = {'shaft_radius': SHAFT * self._size, 'head_radius': HEAD * self._size}
        self.linear = scene.add_arrows(
            '/iterate/linear', nothing, PALE, head_length=HEAD_LENGTH * self._size, **size
        )
        thin = {name: THIN * value for name, value in size.items()}
        self.angular = scene.add_arrows(
            '/iterate/angular', nothing, PALE, head_length=THIN * HEAD_LENGTH * self._size, **thin
        )
        self.step = scene.add_arrows('/iterate/step', nothing, PALE, head_length=HEAD_LENGTH * self._size, **size)
        self.ellipsoid = scene.add_icosphere(
            '/iterate/ellipsoid', 1.0, color=ELLIPSOID_COLOUR, subdivisions=2, opacity=0.28
        )
        self._shadows = scene.add_line_segments(
            '/iterate/others', nothing, nothing, thickness=1.2, thickness_units='screen'
        )
        self._names = [
            scene.add_label(f'/iterate/name{i}', name, anchor='center-left', font_screen_scale=0.75)
            for i, name in enumerate(short_names(arm.joint_names))
        ]
        self._shadows_of: np.ndarray | None = None

    def hide(self) -> None:
        """Show nothing."""
        if self._root is not None:
            self._root.remove()
            self._root = None

    def show(self, iterate: Iterate, method: str, positions: np.ndarray) -> None:
        """Show an iterate of a descent with these joint positions (k, n)."""
        if self._root is None:
            self._add()
        tip = iterate.base_from_tip[:3, 3]
        colours = np.array([rgb(joint_colour(i)) for i in range(self._arm.n)])
        linear, angular = iterate.jacobian[:3].T, iterate.jacobian[3:].T
        longest = np.linalg.norm(linear, axis=1).max()
        scale = LONGEST * self._size / longest if longest > 0.0 else 0.0
        self._set(self.linear, tip, scale * linear, colours)
        self._set(self.angular, tip, AXIS * self._size * angular, colours)
        self._set(self.step, tip, (iterate.jacobian[:3] @ iterate.step)[None], np.array([self._colour_of(method)]))
        axes, lengths = ellipsoid_of(iterate.jacobian)
        self.ellipsoid.position = tip
        self.ellipsoid.wxyz = np.roll(pin.SE3ToXYZQUAT(pin.SE3(axes, np.zeros(3)))[3:], 1)
        self.ellipsoid.scale = tuple(np.maximum(ELLIPSOID * self._size * lengths / max(lengths[0], 1e-12), 1e-4))
        for label, column in zip(self._names, linear):
            label.visible = bool(np.linalg.norm(column) > NAMED * longest)
            label.position = tip + 1.08 * scale * column
        if positions is not self._shadows_of:
            self._show_others(positions)

    def _set(self, arrows: viser.ArrowsHandle, start: np.ndarray, vectors: np.ndarray, colours: np.ndarray) -> None:
        """Draw vectors (k, 3) from one point; those without length are left out."""
        kept = np.linalg.norm(vectors, axis=1) > 1e-6
        arrows.visible = bool(kept.any())
        if arrows.visible:
            ends = start + vectors[kept]
            arrows.points = np.stack([np.broadcast_to(start, ends.shape), ends], axis=1).astype(np.float32)
            arrows.colors = colours[kept].astype(np.uint8)

    def _show_others(self, positions: np.ndarray) -> None:
        """Draw the arm at other iterates as pale lines, spread over the descent."""
        chosen = np.unique(np.linspace(0, len(positions) - 1, min(len(positions), MOST_SHADOWS)).round().astype(int))
        lines = np.concatenate([skeleton(self._arm, positions[k]) for k in chosen])
        self._shadows.points = lines.astype(np.float32)
        self._shadows.colors = np.broadcast_to(np.array(PALE, np.uint8), lines.shape).copy()
        self._shadows_of = positions


def skeleton(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Return the links of an arm as segments (k, 2, 3) [m] between the origins of its joints."""
    points = joint_origins(arm, q)
    return np.stack([points[:-1], points[1:]], axis=1)
