"""An arm drawn with the meshes of its URDF."""

from __future__ import annotations

import os
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import viser
import yourdfpy
from viser.extras import ViserUrdf

from ros_ik_pkg.ik import ArgumentError, Arm
from ros_ik_pkg.panel.drawing.arm_drawing import wxyz_of
from ros_ik_pkg.panel.drawing.drawing import Drawing

PACKAGE, FILE = 'package://', 'file://'


class MeshDrawing(Drawing):
    """Draws the whole robot of a URDF file under one name; joints outside the arm's chain stay at zero."""

    def __init__(self, server: viser.ViserServer, name: str, arm: Arm, path: Path) -> None:
        base_from_root = arm.base_from_frame(arm.tree.root, dict.fromkeys(arm.joint_names, 0.0))
        robot = yourdfpy.URDF.load(
            path, build_scene_graph=True, load_meshes=True, filename_handler=lambda fname: str(find(fname, path.parent))
        )
        super().__init__(
            server.scene.add_frame(
                name, show_axes=False, wxyz=wxyz_of(base_from_root), position=base_from_root[:3, 3]
            )
        )
        self._robot = ViserUrdf(server, robot, root_node_name=name)
        self._joints = self._robot.get_actuated_joint_names()
        self._arm = arm

    def show(self, q: np.ndarray) -> None:
        """Move to q (n,) [rad, m]."""
        positions = dict(zip(self._arm.joint_names, q.tolist()))
        self._robot.update_cfg(np.array([positions.get(name, 0.0) for name in self._joints]))


def mesh_drawing(server: viser.ViserServer, name: str, arm: Arm, source: str) -> MeshDrawing | None:
    """Return the drawing if `source` is the path or URI of a URDF whose meshes are all readable, else None."""
    try:
        path = find(source, Path())
        if path.suffix != '.urdf' or not has_meshes(path):
            return None
        return MeshDrawing(server, name, arm, path)
    except (OSError, ValueError, ArgumentError, ElementTree.ParseError):
        return None


def has_meshes(path: Path) -> bool:
    """Whether every visual mesh that a URDF names is a file, and there is one."""
    names = [mesh.get('filename', '') for mesh in ElementTree.parse(path).iterfind('.//visual/geometry/mesh')]
    return bool(names) and all(find(name, path.parent).is_file() for name in names)


def find(name: str, folder: Path) -> Path:
    """Find the file that a name, path or URI in a URDF of this folder means.

    package:// is looked up in the share folders of AMENT_PREFIX_PATH, as a sourced workspace sets it; the URI of a
    package that is not there is no file.
    """
    if not name.startswith(PACKAGE):
        return folder / name.removeprefix(FILE)
    inside = name.removeprefix(PACKAGE)
    prefixes = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
    found = (Path(prefix, 'share', inside) for prefix in prefixes if prefix)
    return next((path for path in found if path.is_file()), Path(name))
