"""Where the links of a robot are: the joints of its whole tree, and which variables move them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ros_ik_pkg.ik.collision.scene import JOINT, POSE
from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.chain import rest
from ros_ik_pkg.ik.model.transforms import rotation_about, rotation_from_z, transform
from ros_ik_pkg.ik.model.tree import Joint, Tree

HELD = -2.0  # in place of a variable: no variable moves the body


@dataclass(frozen=True, eq=False)
class Bodies:
    """The joints of a tree as `collision.scene` has them, and the links on them.

    Attributes
    ----------
    joints : (m, JOINT) array
        Its row k moves body k + 1; those that no variable moves have the variable HELD, and offset 0.
    drives : tuple of (str, float, float)
        Name of the joint that each of them follows, multiplier and offset.
    ranges : mapping of str to (float, float)
        Limits of those joints [rad, m].
    moved : tuple of frozenset of int
        Of each body, the variables that move it in the root frame.
    links : mapping of str to (int, (4, 4) array)
        Body of each link and the link's pose in the body's frame.

    """

    joints: np.ndarray
    drives: tuple[tuple[str, float, float], ...]
    ranges: Mapping[str, tuple[float, float]]
    moved: tuple[frozenset[int], ...]
    links: Mapping[str, tuple[int, np.ndarray]]

    def values(self, positions: Mapping[str, float]) -> list[float]:
        """Return the value of each joint [rad, m]; joints without a position stay at rest."""
        return [multiplier * positions.get(name, rest(*self.ranges[name])) + offset
                for name, multiplier, offset in self.drives]

    def above(self, body: int) -> list[int]:
        """Return a body and its ancestors, up to that of the root frame."""
        found = [body]
        while found[-1]:
            found.append(int(self.joints[found[-1] - 1, 0]))
        return found

    def poses(self, values: Sequence[float]) -> np.ndarray:
        """Return (m + 1, POSE), the poses of the bodies in the root frame at these values of the joints."""
        frames = [np.eye(4)]
        for row, value in zip(self.joints, values):
            turn, slide = (0.0, value) if row[1] else (value, 0.0)
            motion = transform(rotation_about('z', turn), np.array([0.0, 0.0, slide]))
            frames.append(frames[int(row[0])] @ frame_of(row[JOINT - POSE :]) @ motion)
        return np.array([row_of(frame) for frame in frames])


def row_of(frame: np.ndarray) -> np.ndarray:
    """Return a transform (4, 4) as POSE numbers."""
    return np.concatenate([frame[:3, :3].ravel(), frame[:3, 3]])


def frame_of(row: np.ndarray) -> np.ndarray:
    """Return POSE numbers as a transform (4, 4)."""
    return transform(row[:9].reshape(3, 3), row[9:])


def make_bodies(tree: Tree, variables: Sequence[str]) -> Bodies:
    """Return the bodies of a robot; `variables` are those of the chain. Floating and planar joints do not move."""
    rows: list[np.ndarray] = []
    drives: list[tuple[str, float, float]] = []
    ranges: dict[str, tuple[float, float]] = {}
    moved: list[frozenset[int]] = [frozenset()]
    links: dict[str, tuple[int, np.ndarray]] = {tree.root: (0, np.eye(4))}
    for joint in tree.joints:
        body, placement = links[joint.parent]
        placement = placement @ joint.origin
        if joint.movable:
            master, multiplier, offset = _drive(tree, joint)
            known = master.name in variables
            turn = transform(rotation_from_z(joint.axis), np.zeros(3))
            own = {variables.index(master.name)} if known and multiplier != 0.0 else set()
            moved.append(moved[body] | own)
            variable = float(variables.index(master.name)) if known else -1.0
            rows.append(np.array([
                body, joint.kind == 'prismatic', variable if moved[-1] else HELD, multiplier, offset,
                *row_of(placement @ turn),
            ]))  # fmt: skip
            drives.append((master.name, multiplier, offset))
            ranges[master.name] = (master.lower, master.upper) if master.lower < master.upper else (-np.inf, np.inf)
            body, placement = len(rows), turn.T
        links[joint.child] = body, placement @ joint.tail
    joints = np.array(rows).reshape(-1, JOINT)
    return Bodies(joints, tuple(drives), ranges, tuple(moved), links)


def _drive(tree: Tree, joint: Joint) -> tuple[Joint, float, float]:
    """Return master, multiplier and offset of a joint; a joint that mimics an unknown one is its own master."""
    try:
        return tree.drive(joint)
    except ModelError:
        return joint, 1.0, 0.0
