"""ArmTree: two tips of one robot, such as those of two arms on a torso, as two chains over one set of joints."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ik.contacts.contacts import Contacts
from ros_ik_pkg.ik.contacts.frames import frame_of, row_of
from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.kernel.data_layout import Geometry, pack_model
from ros_ik_pkg.ik.loading import faults_of, make_arm
from ros_ik_pkg.ik.model.chain import MAX_VARIABLES, TURN
from ros_ik_pkg.ik.model.joint_limits import limit_joints
from ros_ik_pkg.ik.model.sources import read_tree
from ros_ik_pkg.ik.search.pair_starts import FEW_STARTS, GROUP, MANY_STARTS, make_pair_starts
from ros_ik_pkg.ik.search.reach import make_reach
from ros_ik_pkg.ik.text import list_names

SHARED, FIRST, SECOND = 0.0, 1.0, 2.0  # which tips a joint moves
# How the values of a joint that both arms have become one
MERGED: dict[str, Callable[[list[Any]], Any]] = {
    'lower': max, 'upper': min, 'velocity_limits': min, 'acceleration_limits': min, 'jerk_limits': min, 'wraps': min,
    'home': lambda values: values[0],
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class ArmTree:
    """Two tips of one robot and the n joints that move them, 1 to 32. Made by `load_tree`.

    Attributes
    ----------
    arms : tuple of Arm
        The chain from the base frame to each tip.
    joint_names : tuple of str
        The joints of the first arm from base to tip, then those of the second that the first does not have.
    lower, upper, velocity_limits, acceleration_limits, jerk_limits, wraps, home : (n,) arrays
        As those of an Arm; the narrower limits count for a joint of both arms.
    srdf, meshes
        As `load_tree` was given them.

    """

    arms: tuple[Arm, Arm]
    joint_names: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    velocity_limits: np.ndarray
    acceleration_limits: np.ndarray
    jerk_limits: np.ndarray
    wraps: np.ndarray
    home: np.ndarray
    srdf: str | os.PathLike[str] | None = None
    meshes: tuple[str | os.PathLike[str], ...] = ()

    @property
    def name(self) -> str:
        """Name of the robot."""
        return self.arms[0].name

    @property
    def base_frame(self) -> str:
        """Link from which both chains lead."""
        return self.arms[0].base_frame

    @property
    def tip_frames(self) -> tuple[str, str]:
        """Names of both tips."""
        return self.arms[0].tip_frame, self.arms[1].tip_frame

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is odd about the robot's description and how it was read."""
        return tuple(dict.fromkeys(warning for arm in self.arms for warning in arm.warnings))

    @property
    def tool_frame(self) -> str:
        """Name of the tool's frame: empty, because two tips have no tool."""
        return ''

    def same_robot(self, other: object) -> bool:
        """Return whether other arms are these, loaded once."""
        return self is other

    @cached_property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @cached_property
    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """Index of each arm's joints among the joints of both."""
        first, second = ([self.joint_names.index(name) for name in arm.joint_names] for arm in self.arms)
        return np.array(first), np.array(second)

    @cached_property
    def contacts(self) -> Contacts:
        """The shapes of the robot for contact, with both arms moving; loaded at first use."""
        arm = self.arms[0]
        return Contacts(arm.tree, arm.model, self.base_frame, self.joint_names, self.home, self.lower, self.upper,
                        self.srdf, self.meshes)

    @cached_property
    def shaped(self) -> bool:
        """Whether any link has a shape for contact."""
        return self.arms[0].shaped

    def forward(self, q: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Poses of both tip frames in the base frame, (4, 4) each, at q (n,) [rad, m]."""
        values = np.asarray(q, dtype=np.float64)
        first, second = (arm.forward(values[places]) for arm, places in zip(self.arms, self.places))
        return first, second

    @cached_property
    def side(self) -> np.ndarray:
        """Which tips a joint moves (n,): SHARED, FIRST or SECOND."""
        first, second = (np.isin(np.arange(self.n), places) for places in self.places)
        return np.where(first & second, SHARED, np.where(first, FIRST, SECOND))

    @cached_property
    def packed(self) -> tuple[np.ndarray, np.ndarray]:
        """Both packed chains, for compiled code."""
        first, second = (_pack(self._chain(k)) for k in range(2))
        return first, second

    @cached_property
    def packed_relative(self) -> np.ndarray:
        """The packed chain from the second tip to the first, for compiled code."""
        return _pack(self._relative_chain())

    @cached_property
    def starts(self) -> tuple[np.ndarray, np.ndarray]:
        """The starts of searches for two targets, and their layout: see `pair_entry.solve_pair`."""
        shared = (self.side == SHARED).any()
        count, group = (MANY_STARTS, GROUP) if shared else (FEW_STARTS, FEW_STARTS)
        chains = self._chain(0), self._chain(1)
        starts = make_pair_starts(chains, *self.packed, self.side == SHARED, count, group)
        return starts, np.array([group, *self.side])

    @cached_property
    def relative_starts(self) -> tuple[np.ndarray, np.ndarray]:
        """The starts of searches for only a relative target: a pose of the first tip in the second tip's frame."""
        chains = self._relative_chain(), self._chain(1)
        starts = make_pair_starts(chains, self.packed_relative, self.packed[1], self.side == SHARED, FEW_STARTS, 1)
        return starts, np.array([1, *self.side])

    def _chain(self, k: int) -> Geometry:
        """Return the chain to one tip, over the joints of both."""
        arm = self.arms[k]
        return Geometry(arm.placements, arm.prismatic, self.places[k][arm.variable], arm.multiplier, arm.offset,
                        self.lower, self.upper, self.wraps)

    def _relative_chain(self) -> Geometry:
        """Return the chain from the second tip backwards to where the arms separate, and on to the first tip.

        A joint that is passed backwards has the opposite value: Rz(q)^-1 = Rz(-q).
        """
        on, back = self._chain(0), self._chain(1)
        shared = _count_shared(on, back)
        backwards = [np.linalg.inv(frame_of(row)) for row in back.placements[shared:][::-1]]
        backwards[-1] = backwards[-1] @ frame_of(on.placements[shared])
        rows = [*(row_of(pose) for pose in backwards), *on.placements[shared + 1 :]]
        prismatic, variable, multiplier, offset = (
            np.concatenate([sign * getattr(back, name)[shared:][::-1], getattr(on, name)[shared:]])
            for name, sign in (('prismatic', 1), ('variable', 1), ('multiplier', -1.0), ('offset', -1.0))
        )
        return Geometry(np.array(rows), prismatic, variable, multiplier, offset, self.lower, self.upper, self.wraps)


def load_tree(
    source: str | os.PathLike[str], tips: Iterable[str], base: str | None = None, *, limits: str = 'soft',
    joint_limits: str | os.PathLike[str] = '', held: Mapping[str, float | None] | None = None,
    xacro_args: Mapping[str, str] | None = None, srdf: str | os.PathLike[str] | None = None,
    meshes: Iterable[str | os.PathLike[str]] = (),
) -> ArmTree:
    """Load two arms of one robot, to be solved together by `solve_tips`.

    Parameters
    ----------
    tips : two str
        Links that the chains lead to, such as (left, right); targets come in the same order.
    base : str, optional
        Link that both chains lead from; default: the root link.
    source, limits, joint_limits, held, xacro_args, srdf, meshes
        As in `load_arm`.

    Returns
    -------
    ArmTree

    Raises
    ------
    ModelError
        If the source cannot be found, read or used; the text says what is wrong and where.

    """
    names = tuple(tips)
    if len(names) != 2 or names[0] == names[1] or not all(names):
        raise ModelError(f'tips is {list_names(names)}; expected two different links')
    tree = read_tree(source, xacro_args)
    with faults_of(tree):
        limited = limit_joints(tree, limits, joint_limits, held)
        first, second = (make_arm(limited, base, tip) for tip in names)
        joint_names = tuple(dict.fromkeys((*first.joint_names, *second.joint_names)))
        if len(joint_names) > MAX_VARIABLES:
            raise ModelError(f'{len(joint_names)} joints move {list_names(names)}; at most {MAX_VARIABLES} are solved: '
                             'choose a base frame closer to the tips')
        if set(first.joint_names) == set(second.joint_names):
            raise ModelError(f'the same joints move {list_names(names)}; expected tips of two arms')
        arms = ArmTree((first, second), joint_names, srdf=srdf, meshes=tuple(meshes),
                       **_merge(first, second, joint_names))
        if srdf is not None:
            _ = arms.contacts  # so that an SRDF of another robot is refused here
        return arms


def _merge(first: Arm, second: Arm, names: tuple[str, ...]) -> dict[str, Any]:
    """Return the merged values of MERGED for all joints; raises ModelError if a joint is left without a range."""
    values = {
        attribute: np.array([
            choose([getattr(arm, attribute)[arm.joint_names.index(name)]
                    for arm in (first, second) if name in arm.joint_names])
            for name in names
        ])
        for attribute, choose in MERGED.items()
    }  # fmt: skip
    lower, upper = values['lower'], values['upper']
    if empty := [name for name, low, high in zip(names, lower, upper) if not low < high]:
        raise ModelError(f'joint {list_names(empty)} has no range that fits the joints of both arms that mimic it')
    values['wraps'] *= upper - lower > TURN
    values['home'] = np.clip(values['home'], lower, upper)
    return values


def _count_shared(one: Geometry, other: Geometry) -> int:
    """Count the joints, from the base on, that both chains have in the same place."""
    rows = [np.column_stack([chain.placements[:-1], chain.prismatic, chain.variable, chain.multiplier, chain.offset])
            for chain in (one, other)]
    length = min(map(len, rows))
    return int(np.cumprod((rows[0][:length] == rows[1][:length]).all(axis=1)).sum())


def _pack(chain: Geometry) -> np.ndarray:
    """Return a packed chain with its reach, without starts."""
    return pack_model(chain, make_reach(chain), np.empty((len(chain.lower) + 7, 0), np.float32))
