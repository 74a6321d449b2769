"""Links and joints of a robot as a checked tree, the common form of URDF and DH files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.shapes import Shape
from ros_ik_pkg.ik.text import list_names, suggest

MOVABLE = ('revolute', 'continuous', 'prismatic')
ROTARY = ('revolute', 'continuous')
MAX_DISTANCE = 1e6  # [m]
MAX_NAME = 1000  # characters


@dataclass(frozen=True)
class Mimic:
    """Value of a coupled joint: multiplier * value of `joint` + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class Joint:
    """One joint; its motion is about or along `axis` of the joint frame [rad, m].

    `origin` leads from the parent link to the joint frame, `tail` from the moved joint frame to the child
    link. `fault` says why no chain can take the joint; a robot with such a joint elsewhere is fine.
    `soft` are the soft limits of the file. `notes` say what is unusual about the joint and how it is read.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: np.ndarray
    axis: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    tail: np.ndarray = field(default_factory=lambda: np.eye(4))
    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf
    mimic: Mimic | None = None
    fault: str = ''
    soft: tuple[float, float] = (-np.inf, np.inf)
    acceleration: float = np.inf
    jerk: float = np.inf
    notes: tuple[str, ...] = ()

    @property
    def movable(self) -> bool:
        """Whether the joint has one degree of freedom that a chain can use."""
        return self.kind in MOVABLE


@dataclass(frozen=True, eq=False)
class Tree:
    """All links of a robot; `joints` come parents first. `tip` and `home` if the file names them.

    `shapes` are those for contact, by link, and `shape_faults` says which were left out and why; `folder` is that of
    the file, for mesh files beside it. `shape_file`: the file that a DH table names for them, see `shape_file.py`.
    """

    name: str
    root: str
    joints: tuple[Joint, ...]
    tip: str | None = None
    home: Mapping[str, float] = field(default_factory=dict)
    shapes: Mapping[str, tuple[Shape, ...]] = field(default_factory=dict)
    shape_faults: tuple[str, ...] = ()
    folder: Path | None = None
    shape_file: Path | None = None

    @cached_property
    def links(self) -> tuple[str, ...]:
        """Names of all links, the root first."""
        return (self.root, *(joint.child for joint in self.joints))

    @cached_property
    def joint_above(self) -> dict[str, Joint]:
        """The joint that leads to each link but the root."""
        return {joint.child: joint for joint in self.joints}

    @cached_property
    def joint_named(self) -> dict[str, Joint]:
        """The joints by name."""
        return {joint.name: joint for joint in self.joints}

    def path_from_root(self, link: str) -> list[Joint]:
        """Collect the joints that lead from the root to a link."""
        path = []
        while link != self.root:
            path.append(self.joint_above[link])
            link = path[-1].parent
        return path[::-1]

    def path(self, base: str, tip: str) -> list[Joint]:
        """Collect the joints from base down to tip; raises ModelError if tip is not below base.

        The base may also be a link that is fixed to one above the tip, as the `base` of a UR is.
        """
        to_base, to_tip = self.path_from_root(base), self.path_from_root(tip)
        shared = _count_shared(to_base, to_tip)
        if any(joint.kind != 'fixed' for joint in to_base[shared:]):
            hint = '; exchange base and tip' if shared == len(to_tip) else ''
            raise ModelError(f'tip frame {tip!r} does not descend from base frame {base!r}{hint}')
        return to_tip[shared:]

    def joints_between(self, one: str, other: str) -> list[Joint]:
        """Collect the joints whose motion moves two links relative to each other."""
        first, second = self.path_from_root(one), self.path_from_root(other)
        shared = _count_shared(first, second)
        return first[shared:] + second[shared:]

    def check_link(self, name: str, role: str) -> str:
        """Return the name of a link that exists, or raise ModelError with similar names."""
        if name not in self.links:
            raise ModelError(f'{role} {name!r} does not exist; {suggest(name, self.links)}')
        return name

    def drive(self, joint: Joint) -> tuple[Joint, float, float]:
        """Follow mimic joints to the master: joint value = multiplier * master value + offset."""
        multiplier, offset, seen = 1.0, 0.0, [joint.name]
        while joint.mimic is not None:
            master = self.joint_named.get(joint.mimic.joint)
            if master is None or not master.movable:
                found = 'does not exist' if master is None else f'is of type {master.kind}'
                raise ModelError(f'joint {joint.name!r} mimics {joint.mimic.joint!r}, which {found}; '
                                 'expected a movable joint')
            if master.name in seen:
                raise ModelError(f'mimic joints go round in a circle: {" -> ".join([*seen, master.name])}')
            offset += multiplier * joint.mimic.offset
            multiplier *= joint.mimic.multiplier
            seen.append(master.name)
            joint = master
        return joint, multiplier, offset


def grow(name: str, links: Iterable[str], joints: Iterable[Joint], tip: str | None = None,
         home: Mapping[str, float] | None = None) -> Tree:
    """Check that links and joints form one tree and sort them parents first; raises ModelError."""
    links, joints = list(links), list(joints)
    if not links:
        raise ModelError('the robot has no links')
    _refuse_long_names([name, *links, *(joint.name for joint in joints)])
    _refuse_far_placements(joints)
    _refuse_duplicates(links, 'link')
    _refuse_duplicates([joint.name for joint in joints], 'joint')
    root = _find_root(links, joints)
    ordered = _sort_from(root, joints)
    if len(ordered) < len(joints):
        lost = sorted({joint.name for joint in joints} - {joint.name for joint in ordered})
        raise ModelError(f'joints form a closed loop: {list_names(lost)}; expected a tree')
    return Tree(name, root, tuple(ordered), tip, dict(home or {}))


def _count_shared(first: list[Joint], second: list[Joint]) -> int:
    """Count the joints that two paths from the root have in common."""
    return sum(one is other for one, other in zip(first, second))


def _refuse_duplicates(names: list[str], what: str) -> None:
    """Raise ModelError if a name occurs twice."""
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise ModelError(f'{what} name used more than once: {list_names(twice)}')


def _refuse_long_names(names: list[str]) -> None:
    """Raise ModelError if a name is so long that it would fill logs and messages."""
    if fault := fault_of_name(max(names, key=len)):
        raise ModelError(fault)


def fault_of_name(name: str) -> str:
    """Return that a name is too long; empty if it is not."""
    if len(name) <= MAX_NAME:
        return ''
    return f'a name has {len(name)} characters, {name[:30]!r}...; at most {MAX_NAME}'


def _refuse_far_placements(joints: list[Joint]) -> None:
    """Raise ModelError if a placement is so far away that poses would lose all digits, or overflow."""
    for joint in joints:
        distance = max(np.abs(placement[:3, 3]).max() for placement in (joint.origin, joint.tail))
        if distance > MAX_DISTANCE:
            raise ModelError(f'joint {joint.name!r} is placed {distance:g} m away; at most {MAX_DISTANCE:g}')


def _find_root(links: list[str], joints: list[Joint]) -> str:
    """Find the only link without a parent."""
    known, children = set(links), dict[str, Joint]()
    for joint in joints:
        for role, link in (('parent', joint.parent), ('child', joint.child)):
            if link not in known:
                raise ModelError(f'joint {joint.name!r}: {role} link {link!r} does not exist; '
                                 f'{suggest(link, links)}')
        if joint.child in children:
            raise ModelError(f'link {joint.child!r} is the child of two joints: {children[joint.child].name!r} '
                             f'and {joint.name!r}; expected a tree')
        children[joint.child] = joint
    roots = [link for link in links if link not in children]
    if len(roots) != 1:
        wanted = 'expected exactly one link without a parent'
        if roots:
            raise ModelError(f'{len(roots)} root links: {list_names(roots)}; {wanted}')
        loop = _loop_above(links[0], children)
        raise ModelError(f'no root link, {wanted}; joints form a closed loop: {list_names(loop)}')
    return roots[0]


def _loop_above(link: str, above: dict[str, Joint]) -> list[str]:
    """Return the names of the joints of the loop above a link, parents first."""
    way: list[Joint] = []
    while above[link] not in way:
        way.append(above[link])
        link = above[link].parent
    return [joint.name for joint in reversed(way[way.index(above[link]) :])]


def _sort_from(root: str, joints: list[Joint]) -> list[Joint]:
    """Order the joints that can be reached from the root, parents before children."""
    below: dict[str, list[Joint]] = {}
    for joint in joints:
        below.setdefault(joint.parent, []).append(joint)
    ordered, waiting = [], [root]
    while waiting:
        found = below.get(waiting.pop(), [])
        ordered += found
        waiting += [joint.child for joint in reversed(found)]
    return ordered
