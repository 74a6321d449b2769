"""The joints of one base-to-tip chain and the variables that move them: flat arrays for the compiled code."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.tree import ROTARY, Joint, Tree

MAX_VARIABLES = 32
TURN = 2.0 * math.pi
FURTHEST_HOME = math.pi  # [rad, m] from the limit near zero


@dataclass(frozen=True, eq=False)
class Chain:
    """Joints k = 0..nj-1 from base to tip, variables i = 0..n-1 that move them.

    The value of joint k is multiplier[k] * q[variable[k]] + offset[k].

    Ordinary joints have multiplier 1 and offset 0; others mimic. `wraps` is 1 if a whole turn of the
    variable changes nothing and fits between its limits.
    """

    joints: tuple[Joint, ...]
    names: tuple[str, ...]
    prismatic: np.ndarray
    variable: np.ndarray
    multiplier: np.ndarray
    offset: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    velocity_limits: np.ndarray
    acceleration_limits: np.ndarray
    jerk_limits: np.ndarray
    wraps: np.ndarray
    home: np.ndarray
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Drive:
    """A joint and the variable (master joint) that moves it."""

    joint: Joint
    master: Joint
    multiplier: float
    offset: float


def make_chain(tree: Tree, base: str, tip: str) -> Chain:
    """Flatten the joints from base to tip; raises ModelError for joints that a chain cannot take."""
    path = tree.path(base, tip)
    joints = [joint for joint in path if joint.kind != 'fixed']
    if not joints:
        held = ''.join(f'; {note}' for joint in path for note in joint.notes)
        raise ModelError(f'no movable joint between base frame {base!r} and tip frame {tip!r}{held}')
    _refuse_faults(joints)
    drives = [_Drive(joint, *tree.drive(joint)) for joint in joints]
    _refuse_faults([drive.master for drive in drives])
    names = list(dict.fromkeys(drive.master.name for drive in drives))
    if len(names) > MAX_VARIABLES:
        raise ModelError(f'{len(names)} joints move between {base!r} and {tip!r}; at most {MAX_VARIABLES} '
                         'are solved: choose base and tip frame closer together')
    groups = [[drive for drive in drives if drive.master.name == name] for name in names]
    lower, upper = np.array([_limits(group) for group in groups]).T.copy()
    return Chain(
        joints=tuple(joints), names=tuple(names),
        prismatic=np.array([joint.kind == 'prismatic' for joint in joints], dtype=np.int64),
        variable=np.array([names.index(drive.master.name) for drive in drives], dtype=np.int64),
        multiplier=np.array([drive.multiplier for drive in drives]),
        offset=np.array([drive.offset for drive in drives]),
        lower=lower, upper=upper,
        velocity_limits=np.array([_lowest(group, 'velocity') for group in groups]),
        acceleration_limits=np.array([_lowest(group, 'acceleration') for group in groups]),
        jerk_limits=np.array([_lowest(group, 'jerk') for group in groups]),
        wraps=np.array([_wraps(group) for group in groups], dtype=np.int64),
        home=np.array([_home(tree, name, *_limits(group)) for name, group in zip(names, groups)]),
        notes=tuple(dict.fromkeys([*(note for joint in path for note in joint.notes),
                                   *(note for drive in drives for note in _notes(drive))])))


def _notes(drive: _Drive) -> list[str]:
    """Return notes on the motor of a joint and on their combined limits."""
    notes = [*drive.master.notes]
    if _repeats_motor(drive):
        notes.append(f'joint {drive.joint.name!r}: limits {_range(drive.joint)} do not fit its motion, '
                     f'{drive.multiplier:g} * {drive.master.name}; the limits of {drive.master.name!r} count alone')
    return notes


def _home(tree: Tree, name: str, lower: float, upper: float) -> float:
    """Return the home position of the file if it is within the limits, else what `rest` returns."""
    home = tree.home.get(name, math.nan)
    return home if lower <= home <= upper else rest(lower, upper)


def rest(lower: float, upper: float) -> float:
    """Zero where it lies inside the limits and on neither, else the middle, or FURTHEST_HOME inside a wider range."""
    if lower < 0.0 < upper:
        return 0.0
    inside = min(0.5 * (upper - lower), FURTHEST_HOME)
    return lower + inside if lower >= 0.0 else upper - inside


def _refuse_faults(joints: Sequence[Joint]) -> None:
    """Raise ModelError with everything that is wrong with the joints."""
    faults = list(dict.fromkeys(joint.fault + _way_round(joint) for joint in joints if joint.fault))
    if faults:
        raise ModelError('; '.join(faults))


def _way_round(joint: Joint) -> str:
    """Return how to avoid a joint that no chain takes, such as the floating joint of a walking robot."""
    return '' if joint.movable else f': choose a base frame below it, such as {joint.child!r}'


def _limits(group: Sequence[_Drive]) -> tuple[float, float]:
    """Intersect the limits of a variable with those of the joints that mimic it."""
    lower, upper = group[0].master.lower, group[0].master.upper
    for drive in group:
        joint = drive.joint
        if _repeats_motor(drive):
            continue
        if drive.multiplier == 0.0:
            _refuse_outside(joint, drive.offset)
        else:
            ends = [(limit - drive.offset) / drive.multiplier for limit in (joint.lower, joint.upper)]
            lower, upper = max(lower, min(ends)), min(upper, max(ends))
    if not lower < upper:
        master = group[0].master
        mimics = [drive for drive in group if drive.joint is not master]
        ranges = ', '.join(f'{drive.joint.name} {_range(drive.joint)} = {drive.multiplier:g} * {master.name} + '
                           f'{drive.offset:g}' for drive in mimics)
        raise ModelError(f'joint {master.name!r} {_range(master)} and those that mimic it ({ranges}) have no common '
                         'range; correct the limits of the mimic joints')
    return lower, upper


def _range(joint: Joint) -> str:
    """Return the limits of a joint as text."""
    return f'[{joint.lower:g}, {joint.upper:g}]'


def _repeats_motor(drive: _Drive) -> bool:
    """Return whether a mimic joint has the limits of its motor, or wider ones, although its multiplier is negative.

    Many gripper files have this. Read literally the joint has no range, so the motor's range must be meant.
    """
    joint, master = drive.joint, drive.master
    if joint is master or drive.offset != 0.0 or drive.multiplier >= 0.0:
        return False
    one_sided = joint.lower >= 0.0 or joint.upper <= 0.0
    return one_sided and joint.lower <= master.lower and master.upper <= joint.upper


def _refuse_outside(joint: Joint, value: float) -> None:
    """Raise ModelError if a mimic joint that never moves is outside its limits."""
    if not joint.lower <= value <= joint.upper:
        raise ModelError(f'joint {joint.name!r} mimics with multiplier 0, so it stays at {value:g}, outside its '
                         f'limits lower = {joint.lower:g} and upper = {joint.upper:g}')


def _lowest(group: Sequence[_Drive], limit: str) -> float:
    """Lowest velocity, acceleration or jerk limit of a variable and of the joints that mimic it."""
    mapped = [getattr(drive.joint, limit) / abs(drive.multiplier) for drive in group if drive.multiplier != 0.0]
    return min([getattr(group[0].master, limit), *mapped])


def _wraps(group: Sequence[_Drive]) -> bool:
    """Return whether a whole turn of the variable changes nothing and fits between the limits."""
    rotary = all(drive.joint.kind in ROTARY and drive.multiplier.is_integer() for drive in group)
    lower, upper = _limits(group)
    return rotary and group[0].master.kind in ROTARY and upper - lower > TURN
