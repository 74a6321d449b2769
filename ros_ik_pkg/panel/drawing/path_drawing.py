"""A path in the scene: its way points, the line that was solved, where the joints leave it, and where it breaks."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pinocchio as pin
import viser
from visualization_msgs.msg import Marker, MarkerArray

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.panel.drawing.arm_drawing import ROUND, size_of, wxyz_of
from ros_ik_pkg.panel.drawing.scene import linear

POINT, CHOSEN, WAITING = (70, 120, 190), (240, 160, 30), (130, 140, 155)
RECONFIGURED, BROKEN = (190, 60, 190), (214, 40, 40)
POINT_RADIUS, MARK_RADIUS, AXES, GIZMO = 0.016, 0.02, 0.06, 0.16  # of the arm's size
WIDTH, HALO_WIDTH = 4.0, 9.0  # pixels
Moved = Callable[[int, np.ndarray], object]


class PathDrawing:
    """Nodes of the scene, made anew for each change, since a page gives the pose of a removed node to the next of its
    name.

    picked(k): called when way point k is clicked; moved(k, pose): when it is dragged; both on a thread of viser.
    """

    def __init__(self, scene: viser.SceneApi, arm: Arm, picked: Callable[[int], object], moved: Moved) -> None:
        self._scene, self._size = scene, size_of(arm)
        self._picked, self._moved = picked, moved
        self._count = 0
        self._points: list[viser.FrameHandle] = []
        self._gizmo: viser.TransformControlsHandle | None = None
        self._lines: list[viser.SceneNodeHandle] = []
        self._waiting: viser.LineSegmentsHandle | None = None

    @property
    def places(self) -> np.ndarray:
        """Positions (k, 3) of the way points as they are drawn [m]."""
        return np.array([frame.position for frame in self._points]).reshape(-1, 3)

    def show_points(self, poses: Sequence[np.ndarray], chosen: int) -> None:
        """Draw the way points (4, 4), with a gizmo at the chosen one."""
        for handle in (*self._points, *([self._gizmo] if self._gizmo else ())):
            handle.remove()
        self._points, self._gizmo = [], None
        self._count += 1
        root = f'/way{self._count}'
        for k, pose in enumerate(poses):
            name = f'{root}/{k}'
            self._points.append(self._scene.add_frame(
                name, axes_length=AXES * self._size, axes_radius=0.004 * self._size, origin_radius=0.0,
                wxyz=wxyz_of(pose), position=pose[:3, 3],
            ))  # fmt: skip
            ball = self._scene.add_icosphere(
                f'{name}/ball', POINT_RADIUS * self._size, subdivisions=ROUND, color=CHOSEN if k == chosen else POINT
            )
            ball.on_click(lambda _, k=k: self._picked(k))
            self._scene.add_label(f'{name}/number', f'{k}', anchor='bottom-left', font_screen_scale=0.8)
        if 0 <= chosen < len(poses):
            self._add_gizmo(f'{root}/gizmo', chosen, poses[chosen])
        self._draw_waiting(poses)

    def _add_gizmo(self, name: str, chosen: int, pose: np.ndarray) -> None:
        self._gizmo = self._scene.add_transform_controls(
            name, scale=GIZMO * self._size, line_width=3.0, depth_test=False, wxyz=wxyz_of(pose), position=pose[:3, 3]
        )

        @self._gizmo.on_update
        def _(event: viser.TransformControlsEvent) -> None:
            if event.client is not None:
                rotation = pin.Quaternion(*event.target.wxyz).normalized().matrix()
                self._moved(chosen, pin.SE3(rotation, np.array(event.target.position)).homogeneous)

    def move(self, k: int, poses: Sequence[np.ndarray]) -> None:
        """Move way point k to where it is in `poses`."""
        self._points[k].wxyz, self._points[k].position = wxyz_of(poses[k]), poses[k][:3, 3]
        self._draw_waiting(poses)

    def _draw_waiting(self, poses: Sequence[np.ndarray]) -> None:
        """Draw straight lines between the way points."""
        if self._waiting is not None:
            self._waiting.remove()
            self._waiting = None
        if len(poses) > 1:
            places = np.array([pose[:3, 3] for pose in poses])
            self._waiting = self._scene.add_line_segments(
                f'/way{self._count}/line', np.stack([places[:-1], places[1:]], axis=1), WAITING, thickness=1.5,
                thickness_units='screen',
            )  # fmt: skip

    def clear_result(self) -> None:
        """Remove what was drawn of a result."""
        for handle in self._lines:
            handle.remove()
        self._lines = []

    def show_result(self, markers: MarkerArray, reconfigured: Sequence[np.ndarray]) -> None:
        """Draw the markers of a path's result, and balls at positions (3,) where the joints leave the path."""
        self.clear_result()
        self._count += 1
        for marker in markers.markers:
            if marker.type == Marker.LINE_STRIP:
                self._strip(marker)
            elif marker.type == Marker.CUBE:
                place = marker.pose.position
                self._mark('break', np.array([place.x, place.y, place.z]), BROKEN, cube=True)
        for k, place in enumerate(reconfigured):
            self._mark(f'reconfigured{k}', place, RECONFIGURED)

    def _strip(self, marker: Marker) -> None:
        """Draw the segments of a line that are not transparent."""
        points = np.array([[p.x, p.y, p.z] for p in marker.points], np.float32)
        colours = np.array([[255 * c.r, 255 * c.g, 255 * c.b] for c in marker.colors])
        solid = np.array([c.a > 0.0 for c in marker.colors])
        chosen = np.flatnonzero(solid[:-1] & solid[1:])
        if len(chosen):
            ends = np.stack([chosen, chosen + 1], axis=1)
            self._lines.append(self._scene.add_line_segments(
                f'/path{self._count}/{marker.ns}', points[ends], linear(colours[ends]),
                thickness=WIDTH if marker.ns == 'path' else HALO_WIDTH, thickness_units='screen',
            ))  # fmt: skip

    def _mark(self, name: str, place: np.ndarray, colour: tuple[int, int, int], cube: bool = False) -> None:
        radius, name = MARK_RADIUS * self._size, f'/path{self._count}/{name}'
        if cube:
            self._lines.append(self._scene.add_box(name, dimensions=(2 * radius,) * 3, color=colour, position=place))
        else:
            self._lines.append(
                self._scene.add_icosphere(name, radius, subdivisions=ROUND, color=colour, position=place)
            )
