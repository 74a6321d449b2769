"""Arm: one base-to-tip chain of a robot, as a Pinocchio model and flat arrays."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ros_ik_pkg.ik.contacts.contacts import Contacts
from ros_ik_pkg.ik.exceptions import ArgumentError, ModelError
from ros_ik_pkg.ik.kernel.data_layout import Geometry, Reach, pack_model
from ros_ik_pkg.ik.kinematics.forward import forward_kinematics, geometric_jacobian
from ros_ik_pkg.ik.model.pinocchio_model import carrier_of, frame_id, joint_id
from ros_ik_pkg.ik.model.tool import read_tool
from ros_ik_pkg.ik.model.tree import Joint, Tree
from ros_ik_pkg.ik.search.moved_tip import moved_reach, moved_starts
from ros_ik_pkg.ik.search.ordered_starts import make_ordered_starts
from ros_ik_pkg.ik.search.reach import make_reach
from ros_ik_pkg.ik.search.starts import COUNT, make_starts
from ros_ik_pkg.ik.text import list_names, suggest

if TYPE_CHECKING:
    from ros_ik_pkg.ik.reachability.reach_map import ReachMap

DATA_LOCK = Lock()  # guards Arm._data


@dataclass(frozen=True, eq=False)
class Arm:
    """A chain of 1 to 32 variables between two frames of a robot. Made by `load_arm`.

    Attributes
    ----------
    name, base_frame, tip_frame : str
    joint_names : tuple of str
        Names of the n variables, from base to tip.
    lower, upper : (n,) arrays
        Limits [rad, m]; -inf and inf for unlimited joints.
    velocity_limits : (n,) array
        [rad/s, m/s]; inf if unknown.
    acceleration_limits, jerk_limits : (n,) arrays
        [rad/s^2, m/s^2] and [rad/s^3, m/s^3] of `joint_limits`; inf if unknown.
    wraps : (n,) int64 array
        1 if a whole turn of the variable changes nothing and fits between the limits.
    home : (n,) array
        Configuration of the file, else zero, or the middle of the limits if they exclude zero.
    placements : (nj + 1, 12) array
        Row k: rotation (row-major) and translation from the frame after joint k-1 (k = 0: base frame) to
        joint k before it moves, its axis along z; the last row leads to the tip frame.
    prismatic, variable : (nj,) int64 arrays
    multiplier, offset : (nj,) arrays
        Value of joint k: multiplier[k] * q[variable[k]] + offset[k].
    model : pinocchio.Model
        The whole robot: links as BODY frames; every joint's axis is its local z, one q each, fixed joints
        folded, mimic joints free, floating and planar joints locked.
    warnings : tuple of str
        What is odd about the robot's description, how it was read, and which default was chosen.
    srdf, meshes
        As given to `load_arm`.
    tip_from_tool : (4, 4) array
        Pose of the tool in the tip frame [m]; the identity without one. See `with_tool`.
    tool_frame : str
        Name of the tool's frame; empty without a tool.

    """

    name: str
    base_frame: str
    tip_frame: str
    frame_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    velocity_limits: np.ndarray
    acceleration_limits: np.ndarray
    jerk_limits: np.ndarray
    wraps: np.ndarray
    home: np.ndarray
    placements: np.ndarray
    prismatic: np.ndarray
    variable: np.ndarray
    multiplier: np.ndarray
    offset: np.ndarray
    model: pin.Model
    tree: Tree
    warnings: tuple[str, ...]
    srdf: str | os.PathLike[str] | None = None
    meshes: tuple[str | os.PathLike[str], ...] = ()
    tip_from_tool: np.ndarray = field(default_factory=lambda: np.eye(4))
    tool_frame: str = ''
    _origin: Arm | None = field(default=None, init=False, repr=False)  # the arm whose tool was changed

    def with_tool(self, tool: ArrayLike | pin.SE3 | None, frame: str = '') -> Arm:
        """Return this arm with another tool: its targets, poses, errors and Jacobians are those of the tool.

        It shares the model and the shapes, and takes a fraction of a millisecond.

        Parameters
        ----------
        tool : (6,), (7,) or (4, 4) array, pinocchio.SE3 or None
            Pose of the tool in the tip frame, whatever tool this arm has: x y z roll pitch yaw about fixed axes
            [m, rad], x y z and a quaternion x y z w, or a matrix. None: no tool.
        frame : str, optional
            Name of the tool's frame, not that of a link; default: `tool`, or `<tip frame>_tool` if that is a link.

        """
        pose = read_tool(tool)
        if not frame and not np.array_equal(pose, np.eye(4)):
            frame = 'tool' if 'tool' not in self.frame_names else f'{self.tip_frame}_tool'
        if frame in self.frame_names:
            raise ArgumentError(f'tool frame {frame!r} is a link of the robot; expected a name of its own')
        arm = replace(self, tip_from_tool=pose, tool_frame=frame)
        object.__setattr__(arm, '_origin', self if self._origin is None else self._origin)
        return arm

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: all but the loaded shapes, which are loaded again where they are needed."""
        return {name: value for name, value in self.__dict__.items() if name != 'contacts'}

    @cached_property
    def contacts(self) -> Contacts:
        """The shapes of the robot for contact, loaded at first use."""
        if self._origin is not None:
            return self._origin.contacts
        return Contacts(self.tree, self.model, self.base_frame, self.joint_names, self.home, self.lower, self.upper,
                        self.srdf, self.meshes)

    @cached_property
    def shaped(self) -> bool:
        """Whether any link has a shape for contact."""
        return not self.bare and self.contacts.known

    @cached_property
    def bare(self) -> bool:
        """Whether no link names a shape; unlike `shaped` it reads no meshes."""
        return not self.tree.shapes

    @cached_property
    def n(self) -> int:
        """Number of variables."""
        return len(self.joint_names)

    @cached_property
    def geometry(self) -> Geometry:
        """The chain for compiled code; the last placement leads to the tool."""
        placements = self.placements.copy()
        rotation, translation = placements[-1, :9].reshape(3, 3), placements[-1, 9:]
        turned = rotation @ self.tip_from_tool[:3, :3]
        placements[-1] = [*turned.ravel(), *(translation + rotation @ self.tip_from_tool[:3, 3])]
        return Geometry(*(getattr(self, name) for name in Geometry._fields))._replace(placements=placements)

    @cached_property
    def reach_bound(self) -> Reach:
        """A sphere that the arm cannot leave."""
        return make_reach(self.geometry)

    @cached_property
    def packed(self) -> np.ndarray:
        """The chain, its reach and the starts of searches in one flat array (see `data_layout.pack_model`)."""
        origin = self._origin
        if origin is not None:
            moved = np.linalg.solve(origin.tip_from_tool, self.tip_from_tool)
            return pack_model(self.geometry, moved_reach(origin.reach_bound, moved), moved_starts(origin.starts, moved))
        alone = pack_model(self.geometry, self.reach_bound, np.empty((self.n + 7, 0), np.float32))
        return pack_model(self.geometry, self.reach_bound, make_starts(self.geometry, alone))

    @property
    def starts(self) -> np.ndarray:
        """The starts of searches (see `starts.make_starts`)."""
        return self.packed.view(np.float32)[-(self.n + 7) * COUNT :].reshape(-1, COUNT)

    @cached_property
    def ordered_starts(self) -> tuple[np.ndarray, np.ndarray]:
        """Where descents begin if rows are wished for only (see `ordered_starts.make_ordered_starts`)."""
        return make_ordered_starts(self.geometry, self.packed, float(self.reach_bound.lengths[1]))

    def forward(self, q: ArrayLike) -> np.ndarray:
        """Pose (4, 4) of the tool, or of the tip frame without a tool, in the base frame at q (n,) [rad, m]."""
        base_from_tip = np.eye(4)
        forward_kinematics(self.packed, self._check(q), base_from_tip)
        return base_from_tip

    def jacobian(self, q: ArrayLike) -> np.ndarray:
        """Geometric Jacobian (6, n) in base axes, rows [v; w], at q (n,) [rad, m]."""
        return geometric_jacobian(self.packed, self._check(q))

    def reach(self, **settings: Any) -> ReachMap:
        """Map what the arm can reach, with the settings, defaults and errors of `reach_map`."""
        from ros_ik_pkg.ik.reachability.reach_map import reach_map  # it is above: see docs/architecture.md

        return reach_map(self, **settings)

    def base_from_frame(self, frame: str, positions: Mapping[str, float]) -> np.ndarray:
        """Pose of any frame of the robot in the base frame.

        Parameters
        ----------
        frame : str
            Name of a link, or of the tool's frame.
        positions : mapping of str to float
            Joint positions by name [rad, m]; those between the base frame and `frame` are needed (for a mimic joint:
            its master), others are ignored.

        Returns
        -------
        (4, 4) array

        Raises
        ------
        ArgumentError
            If the frame is unknown, or positions are missing or not finite.

        """
        if self.tool_frame and frame == self.tool_frame:
            return self.base_from_frame(self.tip_frame, positions) @ self.tip_from_tool
        q = np.zeros(self.model.nq)
        for index, value in self._joint_values(frame, positions).items():
            q[index] = value
        with DATA_LOCK:
            pin.framesForwardKinematics(self.model, self._data, q)
            base, other = (self._data.oMf[frame_id(self.tree, name)] for name in (self.base_frame, frame))
            return base.actInv(other).homogeneous

    def joints_to(self, frame: str) -> tuple[str, ...]:
        """Names of the joints whose positions place a frame in the base frame; raises as `base_from_frame`."""
        frame = self.tip_frame if frame == self.moving_frame else frame
        return tuple(dict.fromkeys(master.name for master, _, _ in self._drives_to(frame).values()))

    @property
    def moving_frame(self) -> str:
        """Name of the frame that reaches targets: the tool's, or the tip frame."""
        return self.tool_frame or self.tip_frame

    def same_robot(self, other: object) -> bool:
        """Return whether another arm is this one, apart from its tool: loaded once, with the same frames."""
        return isinstance(other, Arm) and self.model is other.model

    def frame_from_tool(self, frame: str) -> np.ndarray | None:
        """Return the pose (4, 4) of the tool in the frame of a link (ArgumentError without one); None if they move."""
        if frame == self.moving_frame:
            return np.eye(4)
        if frame not in self.frame_names:
            raise ArgumentError(f'frame {frame!r} does not exist; {suggest(frame, self.frame_names)}')
        link, tip = (self.model.frames[frame_id(self.tree, name)] for name in (frame, self.tip_frame))
        if carrier_of(link) != carrier_of(tip):
            return None
        return link.placement.actInv(tip.placement).homogeneous @ self.tip_from_tool

    @cached_property
    def _data(self) -> pin.Data:
        """Workspace of Pinocchio, kept because creating it takes milliseconds for a humanoid."""
        return self.model.createData() if self._origin is None else self._origin._data

    def _joint_values(self, frame: str, positions: Mapping[str, float]) -> dict[int, float]:
        """Return the values, by index into the model's q, of the joints between base frame and `frame`."""
        drives = self._drives_to(frame)
        needed = dict.fromkeys(master.name for master, _, _ in drives.values())
        missing = [name for name in needed if not np.isfinite(positions.get(name, np.nan))]
        if missing:
            raise ArgumentError(f'no finite position of joint {list_names(missing)}, needed for frame {frame!r}')
        return {joint_id(self.tree, joint) - 1: multiplier * positions[master.name] + offset
                for joint, (master, multiplier, offset) in drives.items()}

    def _drives_to(self, frame: str) -> dict[Joint, tuple[Joint, float, float]]:
        """Return the joints between base frame and `frame`, each with its master, multiplier and offset."""
        try:
            self.tree.check_link(frame, 'frame')
            between = self.tree.joints_between(self.base_frame, frame)
            joints = [joint for joint in between if joint.kind != 'fixed']
            stuck = [f'{joint.name} ({joint.kind})' for joint in joints if not joint.movable]
            if stuck:
                raise ArgumentError(f'frame {frame!r} hangs on joint {list_names(stuck)}, which has no single '
                                    'position; choose another frame')
            return {joint: self.tree.drive(joint) for joint in joints}
        except ModelError as error:
            raise ArgumentError(str(error)) from error

    def _check(self, q: ArrayLike) -> np.ndarray:
        """Return q as a float64 array of the right shape, or raise ArgumentError."""
        try:
            values = np.ascontiguousarray(q, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise ArgumentError(f'q is {q!r}; expected {self.n} numbers [rad, m]') from error
        if values.shape != (self.n,):
            raise ArgumentError(f'q has shape {values.shape}; expected {self.n}: {list_names(self.joint_names)}')
        return values if values.flags.writeable else values.copy()  # compiled for one kind of array
