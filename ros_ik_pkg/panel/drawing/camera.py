"""The camera of the page: moves only when the arm or the target is out of view."""

from __future__ import annotations

import contextlib

import numpy as np
import viser

FROM = np.array([1.9, -1.7, 0.8])  # direction and distance, relative to the size of the scene: front right, above
FIELD = np.radians(40.0)
NARROW = 0.65  # width over height of the view in the narrowest page
AROUND = 0.22  # of the arm's length: the gizmo around the target is to be seen too
CLOSER = 0.75  # the camera comes closer only if this fraction of the distance suffices

FORWARD = -FROM / np.linalg.norm(FROM)
RIGHT = np.cross(FORWARD, [0.0, 0.0, 1.0]) / np.linalg.norm(FORWARD[:2])
UP = np.cross(RIGHT, FORWARD)


class Camera:
    """Aims the cameras of all pages that are open, and of those that come."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._middle, self._size, self._distance = np.zeros(3), 1.0, 0.0

    def begin(self, size: float, floor: float) -> None:
        """Look at an arm of this length on a floor at this height [m]; the next `follow` moves the cameras."""
        self._middle, self._size = np.array([0.28 * size, 0.0, 0.2 * size + 0.3 * floor]), size
        self._distance = 0.0

    def follow(self, point: np.ndarray) -> None:
        """Move the camera so that a point (3,) is visible together with the arm; do nothing if it is."""
        needed = max(self._size, self._needed(point - self._middle))
        if CLOSER * self._distance < needed <= self._distance:
            return
        self._distance = needed
        pose = self._middle, self._middle + needed * FROM
        self._aim(self._server.initial_camera, *pose)
        self._server.initial_camera.fov = FIELD
        for client in self._server.get_clients().values():
            with contextlib.suppress(AssertionError):  # for a client that has not reported its camera yet
                self._aim(client.camera, *pose)

    def _needed(self, offset: np.ndarray) -> float:
        """Return the camera distance, in lengths of FROM, from which an offset (3,) from the centre is visible."""
        beside = np.abs([offset @ RIGHT / NARROW, offset @ UP]) + AROUND * self._size
        return float((beside.max() / np.tan(FIELD / 2) - offset @ FORWARD) / np.linalg.norm(FROM))

    @staticmethod
    def _aim(camera: viser.InitialCameraConfig | viser.CameraHandle, middle: np.ndarray, place: np.ndarray) -> None:
        camera.position = place
        camera.look_at = middle
