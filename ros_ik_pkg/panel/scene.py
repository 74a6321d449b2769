"""The 3D view: the arm, the seed as a ghost, the ways of the tip, and the target with its gizmo."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pinocchio as pin
import viser

from ros_ik_pkg.compare.palette import COLOURS, COLOURS_ON_DARK, TARGET, rgb
from ros_ik_pkg.ik import Arm
from ros_ik_pkg.panel.arm_drawing import ArmDrawing, floor_of, size_of, wxyz_of
from ros_ik_pkg.panel.camera import Camera
from ros_ik_pkg.panel.mesh_drawing import mesh_drawing

LINK, JOINT = (205, 211, 219), (84, 96, 112)
GHOST = (140, 150, 165)
LIGHT_FLOOR, DARK_FLOOR = ((225, 228, 232), (200, 205, 211)), ((48, 51, 56), (66, 70, 77))
PATH_WIDTH = 3.5  # pixels
EASE = 0.3  # of the way to the solution that the arm goes in one tick
TARGET_RADIUS, AXES, GIZMO = 0.042, 0.13, 0.22  # of the arm's size


class Scene:
    """Draws one arm and what belongs to it; `show_arm` begins anew with another.

    moved: called with the target (4, 4) that the user dragged the gizmo to; on a thread of viser.
    """

    def __init__(self, server: viser.ViserServer, moved: Callable[[np.ndarray], object]) -> None:
        self._server, self._scene, self._moved = server, server.scene, moved
        # Shadows take half of the frames of a page without a graphics card, and a frame is when a page takes messages.
        self._scene.configure_default_lights(cast_shadow=False)
        self._camera = Camera(server)
        self._paths: dict[str, viser.LineSegmentsHandle] = {}
        self._shown = self._goal = np.empty(0)
        self._dark = False

    def show_arm(self, arm: Arm, source: str, seed: np.ndarray, target: np.ndarray) -> None:
        """Draw an arm, with the meshes of its source where it has them, at its seed (n,), and the target (4, 4)."""
        self._scene.reset()
        self._arm, size = arm, size_of(arm)
        self._paths = {}
        self._add_floor(arm, size)
        self._body = mesh_drawing(self._server, '/arm', arm, source) or ArmDrawing(
            self._scene, '/arm', arm, LINK, JOINT
        )
        self._ghost = ArmDrawing(self._scene, '/seed', arm, GHOST, GHOST, opacity=0.22)
        self._tip = self._scene.add_frame('/tip', axes_length=AXES * size, axes_radius=0.006 * size, origin_radius=0.0)
        self._add_target(size)
        self._shown = self._goal = seed
        self._place_arm()
        self.show_seed(seed)
        self.show_target(target)
        self._camera.begin(size, floor_of(arm))
        self._camera.follow(target[:3, 3])

    def show_seed(self, seed: np.ndarray) -> None:
        """Move the ghost to the seed (n,)."""
        self._ghost.show(seed)

    def show_target(self, target: np.ndarray) -> None:
        """Move the target to a pose (4, 4), and the camera where it would be out of view."""
        self._gizmo.wxyz, self._gizmo.position = wxyz_of(target), target[:3, 3]
        self._camera.follow(target[:3, 3])

    def go_to(self, q: np.ndarray | None) -> None:
        """Let the arm move to q (n,), tick by tick; without a q there is no arm to be seen, only the seed."""
        self._body.visible = self._tip.visible = q is not None
        if q is not None:
            self._goal = q

    def tick(self) -> None:
        """Move the arm on."""
        left = self._goal - self._shown
        if len(left) and np.abs(left).max() > 0.0:
            self._shown = self._goal if np.abs(left).max() < 1e-3 else self._shown + EASE * left
            self._place_arm()

    def show_paths(self, paths: Mapping[str, np.ndarray]) -> None:
        """Draw the ways of the tip (k, 3), by method; those that are not there any more vanish."""
        for method in COLOURS:
            points = paths.get(method, np.empty((0, 3)))
            self._show_path(method, np.stack([points[:-1], points[1:]], axis=1).astype(np.float32))

    def _show_path(self, method: str, segments: np.ndarray) -> None:
        line = self._paths.get(method)
        if line is None and len(segments):
            self._paths[method] = self._scene.add_line_segments(
                f'/paths/{method}', segments, self._colour(method), thickness=PATH_WIDTH, thickness_units='screen'
            )
        elif line is not None:
            line.visible = len(segments) > 0
            if len(segments):
                line.points = segments

    def choose_theme(self, dark: bool) -> None:
        """Take a floor for a light or a dark page; the ways of the tip are gone until they are shown again."""
        self._dark = dark
        self._floor.cell_color, self._floor.section_color = DARK_FLOOR if dark else LIGHT_FLOOR
        for line in self._paths.values():
            line.remove()
        self._paths = {}

    def _colour(self, method: str) -> tuple[int, int, int]:
        return rgb((COLOURS_ON_DARK if self._dark else COLOURS)[method])

    def _place_arm(self) -> None:
        self._body.show(self._shown)
        tip = self._arm.forward(self._shown)
        self._tip.wxyz, self._tip.position = wxyz_of(tip), tip[:3, 3]

    def _add_floor(self, arm: Arm, size: float) -> None:
        height = floor_of(arm)
        self._floor = self._scene.add_grid(
            '/floor', 4 * size, 4 * size, cell_size=0.1, section_size=0.5,
            fade_distance=8.0 * size, fade_strength=1.5, position=(0.0, 0.0, height),
        )  # fmt: skip
        self.choose_theme(self._dark)
        if height < 0.0:
            self._scene.add_cylinder(
                '/column', 0.045 * size, -height, color=JOINT, position=(0.0, 0.0, height / 2)
            )

    def _add_target(self, size: float) -> None:
        self._gizmo = self._scene.add_transform_controls(
            '/target', scale=GIZMO * size, line_width=3.0, depth_test=False
        )
        self._scene.add_icosphere(
            '/target/point', TARGET_RADIUS * size, color=rgb(TARGET), opacity=0.6
        )

        @self._gizmo.on_update
        def _(event: viser.TransformControlsEvent) -> None:
            if event.client is not None:
                rotation = pin.Quaternion(*event.target.wxyz).normalized().matrix()
                self._moved(pin.SE3(rotation, np.array(event.target.position)).homogeneous)
