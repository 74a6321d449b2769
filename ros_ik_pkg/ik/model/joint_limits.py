"""Limits that are laid over those of the robot: soft limits, MoveIt's joint_limits.yaml, and joints that are held."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import yaml

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.chain import rest
from ros_ik_pkg.ik.model.sources import read_text
from ros_ik_pkg.ik.model.transforms import rotation_about, rotation_from_z, transform
from ros_ik_pkg.ik.model.tree import Joint, Tree
from ros_ik_pkg.ik.text import list_names, suggest, to_number

LIMITS = ('soft', 'hard')
MAX_BYTES = 2**20
SWITCHES = ('has_position_limits', 'has_velocity_limits', 'has_acceleration_limits', 'has_jerk_limits')
BOUNDS = ('min_position', 'max_position', 'max_velocity', 'max_acceleration', 'max_jerk')
UNUSED = ('has_deceleration_limits', 'max_deceleration', 'min_velocity', 'has_effort_limits', 'max_effort',
          'angle_wraparound', 'has_soft_limits', 'k_position', 'k_velocity', 'soft_lower_limit', 'soft_upper_limit')
SCALING = ('default_velocity_scaling_factor', 'default_acceleration_scaling_factor')


def limit_joints(
    tree: Tree, limits: str, joint_limits: str | os.PathLike[str], held: Mapping[str, float | None] | None
) -> Tree:
    """Return the robot with the limits and the held joints that `load_arm` is given."""
    if limits not in LIMITS:
        raise ModelError(f'limits is {limits!r}; expected one of {list_names(LIMITS)}')
    if limits == 'soft':
        tree = with_soft_limits(tree)
    if joint_limits:
        tree = with_joint_limits(tree, read_text(joint_limits))
    return hold_joints(tree, held or {})


def with_soft_limits(tree: Tree) -> Tree:
    """Return the robot with the narrower of hard and soft limits; soft limits outside the hard ones are ignored.

    A mimic joint has no soft limits of its own: its motor's count.
    """
    return replace(tree, joints=tuple(
        joint if joint.mimic else _narrow(joint, *joint.soft, 'soft limits') for joint in tree.joints))


def with_joint_limits(tree: Tree, text: str) -> Tree:
    """Return the robot with limits by joint name laid over its own.

    Parameters
    ----------
    tree : Tree
    text : str
        MoveIt's joint_limits.yaml: `joint_limits`, by joint name, with has_position_limits, min_position and
        max_position, and the same for max_velocity, max_acceleration and max_jerk; positions [rad, m]. Positions
        only narrow the limits of the robot; where they are wider, the limits of the robot stay, with a note.

    Raises
    ------
    ModelError
        If the text is not such a file, names a joint that the robot does not have, or leaves a joint no range.

    """
    given = _parse(text)
    known = [joint.name for joint in tree.joints if joint.movable]
    for name in given:
        if name not in known:
            raise ModelError(f'joint_limits: joint {name[:60]!r} does not exist; {suggest(name, known)}')
    return replace(tree, joints=tuple(
        _laid_over(joint, given[joint.name]) if joint.name in given else joint for joint in tree.joints))


def hold_joints(tree: Tree, held: Mapping[str, float | None]) -> Tree:
    """Return the robot with joints fixed: those of `held` at a position [rad, m] or, for None, at their home, and
    those whose lower and upper limits are equal. Joints that mimic one of them are fixed with it.

    Raises ModelError if a joint does not exist, mimics another one, or would be held outside its limits.
    """
    known = [joint.name for joint in tree.joints if joint.movable]
    for name in held:
        if name not in known:
            raise ModelError(f'held_joints: joint {name[:60]!r} does not exist; {suggest(name, known)}')
        if (mimic := tree.joint_named[name].mimic) is not None:
            raise ModelError(f'held_joints: joint {name!r} mimics {mimic.joint!r}; hold that joint instead')
    positions = {joint.name: joint.lower for joint in tree.joints
                 if joint.movable and not joint.fault and joint.mimic is None and joint.lower == joint.upper}
    positions |= {name: _held_position(tree, tree.joint_named[name], value) for name, value in held.items()}
    return replace(tree, joints=tuple(_held(tree, joint, positions) for joint in tree.joints)) if positions else tree


def _held_position(tree: Tree, joint: Joint, value: float | None) -> float:
    """Return where a joint is held [rad, m]."""
    if value is None:
        if joint.fault and joint.name not in tree.home:
            raise ModelError(f'held_joints: joint {joint.name!r} has no home position; expected {joint.name}:=POSITION')
        return tree.home.get(joint.name, joint.lower if joint.lower == joint.upper else rest(joint.lower, joint.upper))
    if not (math.isfinite(value) and joint.lower <= value <= joint.upper):
        raise ModelError(f'held_joints: {value:g} of joint {joint.name!r} is outside its limits '
                         f'lower = {joint.lower:g} and upper = {joint.upper:g}')
    return float(value)


def _held(tree: Tree, joint: Joint, positions: Mapping[str, float]) -> Joint:
    """Return the joint, fixed if it or the joint that it mimics is held."""
    if not joint.movable:
        return joint
    try:
        master, multiplier, offset = tree.drive(joint)
    except ModelError:
        return joint  # the chain refuses it, if it is on it
    if master.name not in positions:
        return joint
    value = multiplier * positions[master.name] + offset
    turn = transform(rotation_from_z(joint.axis), np.zeros(3))
    if joint.kind == 'prismatic':
        motion = transform(np.eye(3), value * joint.axis)
    else:
        motion = turn @ transform(rotation_about('z', value), np.zeros(3)) @ turn.T
    notes = joint.notes
    if joint.lower == joint.upper and joint.mimic is None:
        notes = (*notes, f'joint {joint.name!r}: lower and upper limit are both {joint.lower:g}; it is held there')
    return replace(joint, kind='fixed', origin=joint.origin @ motion, mimic=None, fault='', notes=notes)


def _laid_over(joint: Joint, given: Mapping[str, Any]) -> Joint:
    """Return a joint with the limits given for it."""
    if given.get('has_position_limits') is True:
        lower, upper = (_number(given, joint, key) for key in ('min_position', 'max_position'))
        if not lower < upper:
            raise ModelError(f'joint_limits: joint {joint.name!r}: min_position = {lower:g} and '
                             f'max_position = {upper:g}; expected min_position < max_position')
        if joint.fault:  # its own limits are none
            joint = replace(joint, lower=lower, upper=upper, fault='')
        else:
            joint = _narrow(joint, lower, upper, 'joint_limits')
    for kind in ('velocity', 'acceleration', 'jerk'):
        if given.get(f'has_{kind}_limits') is True:
            limit = _number(given, joint, f'max_{kind}')
            if limit <= 0.0:
                raise ModelError(f'joint_limits: joint {joint.name!r}: max_{kind} is {limit:g}; '
                                 'expected a number above 0')
            joint = replace(joint, **{kind: min(limit, getattr(joint, kind))})
    return joint


def _narrow(joint: Joint, lower: float, upper: float, what: str) -> Joint:
    """Return a joint with its range cut to lower..upper; soft limits that leave nothing of it are ignored."""
    if joint.fault or not joint.movable or joint.lower == joint.upper:
        return joint
    narrow = max(joint.lower, lower), min(joint.upper, upper)
    said = f'joint {joint.name!r}: {what} [{lower:g}, {upper:g}]'
    own = f'its limits [{joint.lower:g}, {joint.upper:g}]'
    if not narrow[0] < narrow[1]:
        if what == 'joint_limits':
            raise ModelError(f'{said} and {own} have no common range')
        note = f'{said} and {own} have no common range; the soft limits are ignored'
        return replace(joint, notes=(*joint.notes, note))
    notes = joint.notes
    if what == 'joint_limits' and narrow != (lower, upper):
        notes = (*notes, f'{said} are wider than {own}; the narrower ones count')
    return replace(joint, lower=narrow[0], upper=narrow[1], notes=notes)


def _number(given: Mapping[str, Any], joint: Joint, key: str) -> float:
    """Read a finite number that must be there."""
    value = given.get(key)
    number = math.nan if isinstance(value, bool) or value is None else to_number(str(value))
    if math.isnan(number):
        raise ModelError(f'joint_limits: joint {joint.name!r}: {key} is {str(value)[:30]!r}; expected a finite number')
    return number


def _parse(text: str) -> dict[str, dict[str, Any]]:
    """Parse the YAML and check its keys: limits by joint name."""
    if len(text) > MAX_BYTES:
        raise ModelError(f'joint_limits has {len(text)} characters; at most {MAX_BYTES} are read')
    try:
        content = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ModelError(f'joint_limits: not well-formed YAML ({" ".join(str(error).split())[:200]})') from error
    joints = content.get('joint_limits') if isinstance(content, dict) else None
    if not isinstance(joints, dict):
        raise ModelError('joint_limits: expected the key joint_limits with limits by joint name')
    _check_keys(content, ('joint_limits', *SCALING), 'the file')
    for name, given in joints.items():
        if not isinstance(given, dict):
            raise ModelError(f'joint_limits: joint {str(name)[:60]!r} has no mapping of limits')
        _check_keys(given, (*SWITCHES, *BOUNDS, *UNUSED), f'joint {str(name)[:60]!r}')
        for key in SWITCHES:
            if not isinstance(given.get(key, False), bool):
                raise ModelError(f'joint_limits: joint {str(name)[:60]!r}: {key} is {str(given[key])[:30]!r}; '
                                 'expected true or false')
    return {str(name): given for name, given in joints.items()}


def _check_keys(mapping: Mapping[Any, Any], known: tuple[str, ...], where: str) -> None:
    """Raise ModelError for a key that is not known."""
    for key in mapping:
        if key not in known:
            raise ModelError(f'joint_limits: {where} has the unknown key {str(key)[:60]!r}; {suggest(str(key), known)}')


def parse_held(entries: Iterable[str]) -> dict[str, float | None]:
    """Return joints to hold by name from entries 'name' (at home) or 'name:=position' [rad, m]; raises ModelError."""
    held: dict[str, float | None] = {}
    for entry in entries:
        name, given, value = entry.partition(':=')
        number = to_number(value) if given else None
        if not name.strip() or (number is not None and np.isnan(number)):
            raise ModelError(f'held_joints: {entry[:60]!r} is not allowed; expected NAME or NAME:=POSITION')
        held[name.strip()] = number
    return held
