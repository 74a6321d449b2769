"""The reach map in the scene: a cube for each position that is reached, to be clicked."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import viser

CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)], np.float32)
FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]], np.uint32
)  # fmt: skip


class ReachDrawing:
    """Draws cubes at positions (k, 3) [m]; picked(number) is called, on a thread of viser, when one is clicked."""

    def __init__(self, scene: viser.SceneApi, picked: Callable[[int], object]) -> None:
        self._scene, self._picked = scene, picked
        self._cubes: viser.BatchedMeshHandle | None = None
        self._count = 0

    def hide(self) -> None:
        """Draw nothing."""
        if self._cubes is not None:
            self._cubes.remove()
            self._cubes = None

    def show(self, positions: np.ndarray, colours: np.ndarray, edge: float, chosen: np.ndarray) -> None:
        """Draw those of the positions whose numbers are chosen, in colours (k, 3), 0 to 255."""
        self.hide()
        if not len(chosen):
            return
        self._count += 1  # a page gives the pose of a node that was removed to the next of its name
        upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(chosen), 1))
        self._cubes = self._scene.add_batched_meshes_simple(
            f'/reach{self._count}', edge * CUBE, FACES, upright, positions[chosen], batched_colors=colours[chosen],
            flat_shading=True, lod='off', cast_shadow=False, receive_shadow=False,
        )  # fmt: skip

        @self._cubes.on_click
        def _(event: viser.SceneNodePointerEvent) -> None:
            if event.instance_index is not None:
                self._picked(int(chosen[event.instance_index]))

    @property
    def positions(self) -> np.ndarray:
        """Positions (k, 3) of the cubes that are drawn [m]."""
        return np.empty((0, 3)) if self._cubes is None else np.array(self._cubes.batched_positions)
