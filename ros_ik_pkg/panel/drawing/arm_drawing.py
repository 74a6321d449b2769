"""An arm in the scene: links and joints drawn from the chain, moved by its joint transforms."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import viser

from ros_ik_pkg.compare.skeleton import joint_transforms, placements
from ros_ik_pkg.ik import Arm
from ros_ik_pkg.panel.drawing.drawing import Drawing

LINK_RADIUS = 0.028  # of the arm's size
TAPER = 0.6  # how much thinner the last link is
JOINT_RADIUS, JOINT_LENGTH = 1.5, 3.2  # of the link's radius
SHORT = 0.02  # of the arm's size; shorter links are hidden in the joint
ROUND = 2  # times that a sphere is subdivided; viser's 3 cost a frame more than they show
COLUMN = 0.5  # of the arm's size: height of the base if the model starts at the shoulder


class ArmDrawing(Drawing):
    """Draws the chain of an arm under one name; `opacity` below 1 makes a ghost."""

    def __init__(
        self, scene: viser.SceneApi, name: str, arm: Arm, link_colour: tuple[int, int, int],
        joint_colour: tuple[int, int, int], opacity: float | None = None,
    ) -> None:  # fmt: skip
        super().__init__(scene.add_frame(name, show_axes=False))
        self._scene, self._arm = scene, arm
        self._link_colour, self._joint_colour, self._opacity = link_colour, joint_colour, opacity
        self._size = size_of(arm)
        self._frames = self._add_joints(name)

    def show(self, q: np.ndarray) -> None:
        """Move to q (n,) [rad, m]."""
        for frame, transform in zip(self._frames, joint_transforms(self._arm, q)):
            frame.wxyz, frame.position = wxyz_of(transform), transform[:3, 3]

    def _add_joints(self, name: str) -> list[viser.FrameHandle]:
        """Add a nested frame for each joint, with its shapes."""
        frames = []
        arm, count = self._arm, len(self._arm.prismatic)
        steps = placements(arm)
        self._add_links(name, steps[0], self._radius(0))
        for k in range(count):
            name = f'{name}/{k}'
            frames.append(self._scene.add_frame(name, show_axes=False))
            radius = self._radius(k)
            length = JOINT_LENGTH * radius * (2.0 if arm.prismatic[k] else 1.0)
            self._cylinder(f'{name}/joint', JOINT_RADIUS * radius, length, np.zeros(3), [0, 0, 1], self._joint_colour)
            self._add_links(name, steps[k + 1], radius)
        return frames

    def _add_links(self, name: str, step: np.ndarray, radius: float) -> None:
        """Draw the link to the next frame: first perpendicular to its axis, then along it."""
        end, axis = step[:3, 3], step[:3, 2]
        corner = end - axis * (axis @ end)
        for k, (a, b) in enumerate(((np.zeros(3), corner), (corner, end))):
            length = np.linalg.norm(b - a)
            if length > SHORT * self._size:
                self._cylinder(f'{name}/link{k}', radius, length, (a + b) / 2, (b - a) / length, self._link_colour)
                self._scene.add_icosphere(
                    f'{name}/end{k}', radius, subdivisions=ROUND, color=self._link_colour, position=b,
                    opacity=self._opacity,
                )  # fmt: skip

    def _cylinder(self, name, radius, length, position, axis, colour) -> None:
        rotation = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), np.asarray(axis, dtype=float))
        self._scene.add_cylinder(
            name, radius, length, color=colour, opacity=self._opacity, position=position,
            wxyz=np.roll(rotation.coeffs(), 1),
        )  # fmt: skip

    def _radius(self, joint: int) -> float:
        return self._size * LINK_RADIUS * (1.0 - TAPER * joint / len(self._arm.prismatic))


def size_of(arm: Arm) -> float:
    """Return the length [m] of the chain, which sets the size of the drawing."""
    return max(float(np.linalg.norm(arm.placements[:, 9:], axis=1).sum()), 0.1)


def floor_of(arm: Arm) -> float:
    """Return the height [m] of the floor: below the base if the model starts at the shoulder."""
    first_two = arm.placements[:2, 9:]
    return -COLUMN * size_of(arm) * float(np.linalg.norm(first_two) < SHORT)


def wxyz_of(transform: np.ndarray) -> np.ndarray:
    """Return the quaternion w x y z of a pose (4, 4)."""
    return np.roll(pin.SE3ToXYZQUAT(pin.SE3(transform))[3:], 1)  # pinocchio.Quaternion(matrix) loses 80 bytes a call
