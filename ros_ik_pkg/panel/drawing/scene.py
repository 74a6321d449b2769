"""The 3D view: arm, seed as a ghost, tip paths, and the target with its gizmo."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pinocchio as pin
import viser

from ros_ik_pkg.compare.iterate import Iterate
from ros_ik_pkg.compare.palette import COLOURS, COLOURS_ON_DARK, TARGET, rgb
from ros_ik_pkg.ik import Arm
from ros_ik_pkg.panel.drawing.arm_drawing import ROUND, ArmDrawing, floor_of, size_of, wxyz_of
from ros_ik_pkg.panel.drawing.camera import Camera
from ros_ik_pkg.panel.drawing.contact_drawing import ContactDrawing
from ros_ik_pkg.panel.drawing.iterate_drawing import IterateDrawing
from ros_ik_pkg.panel.drawing.mesh_drawing import mesh_drawing

LINK, JOINT = (205, 211, 219), (84, 96, 112)
GHOST = (140, 150, 165)
LIGHT_FLOOR, DARK_FLOOR = ((225, 228, 232), (200, 205, 211)), ((48, 51, 56), (66, 70, 77))
GROUND, SKY, SUN = (150, 150, 165), 2.6, 1.6  # colour from below, brightness
SUN_FROM = (0.3, -0.5, 1.0)
PATH_WIDTH = 3.5  # pixels
STRIDE = 0.004  # of the arm's size, about a pixel: smallest distance between points of a path
EASE = 0.3  # fraction of the motion to the solution per tick
TARGET_RADIUS, AXES, GIZMO = 0.042, 0.13, 0.22  # of the arm's size


class Scene:
    """Draws one arm with its seed, target and paths; `show_arm` replaces the arm.

    moved: called with the target (4, 4) when the user drags the gizmo, on a thread of viser.
    """

    def __init__(self, server: viser.ViserServer, moved: Callable[[np.ndarray], object]) -> None:
        self._server, self._scene, self._moved = server, server.scene, moved
        # Shadows and reflections dominate the frame time with software rendering.
        self._scene.configure_default_lights(enabled=False)
        self._scene.configure_environment_map(hdri=None)
        self._camera = Camera(server)
        self._shown = self._goal = np.empty(0)
        self._dark = self._hidden = False
        self._arms = 0
        self.released: Callable[[], object] = lambda: None  # called, on a thread of viser, when the gizmo is let go

    def show_arm(self, arm: Arm, source: str, seed: np.ndarray, target: np.ndarray) -> None:
        """Draw an arm at its seed (n,), with meshes if its source has them, and the target (4, 4)."""
        self._scene.reset()
        self._hidden = False
        self._arm = arm
        self._size = size = size_of(arm)
        self._add_lights()
        self._add_paths()
        self._add_floor(arm, size)
        # A page keeps the pose of a frame that is removed, and gives it to the next frame of that name.
        self._arms += 1
        name, seed_name = f'/arm{self._arms}', f'/seed{self._arms}'
        self._body = mesh_drawing(self._server, name, arm, source) or ArmDrawing(self._scene, name, arm, LINK, JOINT)
        self._ghost = ArmDrawing(self._scene, seed_name, arm, GHOST, GHOST, opacity=0.22)
        self._tip = self._scene.add_frame('/tip', axes_length=AXES * size, axes_radius=0.006 * size, origin_radius=0.0)
        self.contact = ContactDrawing(self._scene, arm)
        self.iterate = IterateDrawing(self._scene, arm, lambda method: rgb(self._colours[method]))
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
        """Move the target to a pose (4, 4), and the camera if the target is out of view."""
        self._gizmo.wxyz, self._gizmo.position = wxyz_of(target), target[:3, 3]
        self._camera.follow(target[:3, 3])

    def go_to(self, q: np.ndarray | None) -> None:
        """Let the arm move to q (n,), tick by tick; without a q there is no arm to be seen, only the seed."""
        self._body.visible = self._tip.visible = q is not None
        if q is not None:
            self._goal = q

    @property
    def standing(self) -> np.ndarray:
        """Where the arm stands, or moves to (n,) [rad, m]."""
        return self._goal

    def put(self, q: np.ndarray) -> None:
        """Put the arm at q (n,) at once."""
        self._body.visible = self._tip.visible = True
        self._shown = self._goal = q
        self._place_arm()

    def stand_at(self, iterate: Iterate, method: str, positions: np.ndarray) -> None:
        """Put the arm at an iterate of a descent with these joint positions (k, n), and show what is inside it."""
        self.put(iterate.q)
        self.iterate.show(iterate, method, positions)

    @property
    def _colours(self) -> dict[str, str]:
        return COLOURS_ON_DARK if self._dark else COLOURS

    def tick(self) -> None:
        """Move the arm on."""
        left = self._goal - self._shown
        if len(left) and np.abs(left).max() > 0.0:
            self._shown = self._goal if np.abs(left).max() < 1e-3 else self._shown + EASE * left
            self._place_arm()

    def show_paths(self, paths: Mapping[str, np.ndarray]) -> None:
        """Draw the ways of the tip (k, 3), by method, and no others."""
        colours = self._colours
        ways = {method: spaced(points, STRIDE * self._size) for method, points in paths.items()}
        segments = {method: np.stack([way[:-1], way[1:]], axis=1) for method, way in ways.items() if len(way) > 1}
        self._paths.visible = bool(segments) and not self._hidden
        if segments:
            self._paths.points = np.concatenate([*segments.values()]).astype(np.float32)
            self._paths.colors = np.concatenate(
                [np.full(lines.shape, linear(rgb(colours[method]))) for method, lines in segments.items()]
            )

    def hide_paths(self, hidden: bool) -> None:
        """Hide the ways of the tip while something else is looked at, or show them again at the next comparison."""
        self._hidden = hidden
        self._paths.visible = False

    def choose_theme(self, dark: bool) -> None:
        """Set the floor for a light or dark page; tip paths change when they are drawn again."""
        self._dark = dark
        self._floor.cell_color, self._floor.section_color = DARK_FLOOR if dark else LIGHT_FLOOR

    def _place_arm(self) -> None:
        self._body.show(self._shown)
        tip = self._arm.forward(self._shown)
        self._tip.wxyz, self._tip.position = wxyz_of(tip), tip[:3, 3]

    def _add_lights(self) -> None:
        self._scene.add_light_hemisphere('/sky', sky_color=(255, 255, 255), ground_color=GROUND, intensity=SKY)
        self._scene.add_light_directional('/sun', position=SUN_FROM, intensity=SUN)

    def _add_paths(self) -> None:
        """Add one scene node for all tip paths: nodes cost more than lines."""
        none = np.zeros((1, 2, 3))
        self._paths = self._scene.add_line_segments(
            '/paths', none, none, thickness=PATH_WIDTH, thickness_units='screen', visible=False
        )

    def _add_floor(self, arm: Arm, size: float) -> None:
        height = floor_of(arm)
        self._floor = self._scene.add_grid(
            '/floor', 2.4 * size, 2.4 * size, cell_size=0.1, section_size=0.5,
            fade_from='origin', fade_distance=1.2 * size, position=(0.0, 0.0, height),
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
            '/target/point', TARGET_RADIUS * size, subdivisions=ROUND, color=rgb(TARGET), opacity=0.6
        )

        @self._gizmo.on_update
        def _(event: viser.TransformControlsEvent) -> None:
            if event.client is not None:
                rotation = pin.Quaternion(*event.target.wxyz).normalized().matrix()
                self._moved(pin.SE3(rotation, np.array(event.target.position)).homogeneous)
                if event.phase == 'end':
                    self.released()


def linear(colour: tuple[int, int, int]) -> np.ndarray:
    """Return an sRGB colour as linear RGB, 0 to 255, which viser expects for vertices."""
    share = np.array(colour) / 255.0
    return (255.0 * np.where(share > 0.04045, ((share + 0.055) / 1.055) ** 2.4, share / 12.92)).round().astype(np.uint8)


def spaced(points: np.ndarray, stride: float) -> np.ndarray:
    """Return points (k, 3) thinned to one per stride, with the first and the last."""
    way = np.cumsum(np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1))
    _, chosen = np.unique(way // stride, return_index=True)
    return points[np.union1d(chosen, np.arange(len(points))[-1:])]
