"""Where the page looks from: so that arm and target are in view, and left alone while they are."""

from __future__ import annotations

import contextlib

import numpy as np
import viser

FROM = np.array([1.9, -1.7, 0.8])  # direction and distance, in what is to be seen: the front right, from above
FIELD = np.radians(40.0)
MARGIN = 2.0  # a point so many times nearer to the middle than the arm is long is well in view, in a narrow page too
SLACK = 1.25  # the view changes only where it would show so much more or less


class Camera:
    """Aims the cameras of all pages that are open, and of those that come."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._middle, self._size, self._reach = np.zeros(3), 1.0, 0.0

    def begin(self, size: float, floor: float) -> None:
        """Look at an arm of this length on a floor at this height [m]; the next `follow` moves the cameras."""
        self._middle, self._size = np.array([0.28 * size, 0.0, 0.2 * size + 0.3 * floor]), size
        self._reach = 0.0

    def follow(self, point: np.ndarray) -> None:
        """Show as much as it takes to see a point (3,) beside the arm; where that is in view, nothing moves."""
        reach = max(self._size, MARGIN * float(np.linalg.norm(point - self._middle)))
        if self._reach and 1.0 / SLACK < reach / self._reach < SLACK:
            return
        self._reach = reach
        pose = self._middle, self._middle + reach * FROM
        self._aim(self._server.initial_camera, *pose)
        self._server.initial_camera.fov = FIELD
        for client in self._server.get_clients().values():
            with contextlib.suppress(AssertionError):  # of one that has not said yet where it is: it begins there
                self._aim(client.camera, *pose)

    @staticmethod
    def _aim(camera: viser.InitialCameraConfig | viser.CameraHandle, middle: np.ndarray, place: np.ndarray) -> None:
        camera.position = place
        camera.look_at = middle
