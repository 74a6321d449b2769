"""DH tables in YAML, standard or Craig-modified -> a checked tree of links and joints."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np
import yaml

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.shapes import LARGEST, Shape
from ros_ik_pkg.ik.model.transforms import rotation_about, rotation_from_rpy, rotation_from_z, transform
from ros_ik_pkg.ik.model.tree import MOVABLE, ROTARY, Joint, Tree, fault_of_name, grow
from ros_ik_pkg.ik.text import list_names, suggest, to_number

MAX_BYTES = 2**20
CONVENTIONS = ('standard', 'modified')
ANGLE_UNITS = {'radians': 1.0, 'degrees': math.pi / 180.0}
ROBOT_KEYS = ('name', 'source', 'convention', 'angles', 'base_frame', 'tip_frame', 'joints')
ROBOT_OPTIONS = ('base', 'tool', 'home', 'shapes')
JOINT_KEYS = ('name', 'type', 'a', 'alpha', 'd', 'theta')
JOINT_OPTIONS = ('lower', 'upper', 'velocity', 'link', 'radius')
NAMES = ('name', 'base_frame', 'tip_frame', 'link')
Fields = dict[str, yaml.Node]


def parse_dh(text: str | bytes) -> Tree:
    """Read a DH table.

    Parameters
    ----------
    text : str or bytes
        YAML with the keys of ROBOT_KEYS and ROBOT_OPTIONS; lengths in metres, angles in the unit that
        `angles` names. One row of `joints` gives a, alpha, d, theta of one link; the variable adds to
        theta (revolute, continuous) or to d (prismatic). `standard` is Rz(theta) Tz(d) Tx(a) Rx(alpha),
        `modified` (Craig) is Rx(alpha) Tx(a) Rz(theta) Tz(d) with alpha and a of the previous link.
        `base` (xyz, rpy) leads from base_frame to where the first row begins, `tool` from the last row to tip_frame.
        A row with a `radius` [m] gives its links capsules for contact along a and d. `shapes` names a file of other
        shapes, see `shape_file`; it is not read here.

    Returns
    -------
    Tree
        Frames: base_frame, one per row (key `link`, else link1, link2, ...), tip_frame.

    Raises
    ------
    ModelError
        With the line, the key, what was got and what was expected.

    """
    robot = _mapping(_compose(text), 'the file', ROBOT_KEYS, ROBOT_OPTIONS)
    unit = ANGLE_UNITS[_choice(robot, 'angles', ANGLE_UNITS)]
    standard = _choice(robot, 'convention', CONVENTIONS) == 'standard'
    rows = _sequence(robot['joints'], 'joints')
    if not rows:
        _refuse(robot['joints'], 'joints is empty; expected at least one row')
    joints: list[Joint] = []
    for row in rows:
        parent = joints[-1].child if joints else _text(robot, 'base_frame')
        joints.append(_read_joint(row, parent, f'link{len(joints) + 1}', unit, standard))
    joints[0] = replace(joints[0], origin=_read_placement(robot, 'base', unit) @ joints[0].origin)
    shapes: dict[str, tuple[Shape, ...]] = {}
    for row, joint in zip(rows, joints):
        _add_capsules(row, joint, standard, shapes)
    tip = Joint('tool', 'fixed', joints[-1].child, _text(robot, 'tip_frame'), _read_placement(robot, 'tool', unit))
    home = _read_home(robot, joints, unit)
    _text(robot, 'source')
    links = [joints[0].parent, *(joint.child for joint in [*joints, tip])]
    name, file = _text(robot, 'name'), Path(_text(robot, 'shapes')) if 'shapes' in robot else None
    try:
        return replace(grow(name, links, [*joints, tip], tip.child, home), shapes=shapes, shape_file=file)
    except ModelError as error:
        raise ModelError(f'joints: {error}') from error


def _compose(text: str | bytes) -> yaml.Node:
    """Parse the YAML into nodes, which keep their line numbers."""
    if len(text) > MAX_BYTES:
        raise ModelError(f'the file has {len(text)} bytes; a DH table has at most {MAX_BYTES}')
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f'line {mark.line + 1}, column {mark.column + 1}: ' if mark else ''
        raise ModelError(f'{where}not well-formed YAML ({error.problem})') from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ModelError(f'not well-formed YAML ({" ".join(str(error).split())})') from error
    if node is None:
        raise ModelError(f'the file is empty; expected the keys {list_names(ROBOT_KEYS)}')
    return node


def _read_joint(node: yaml.Node, parent: str, link: str, unit: float, standard: bool) -> Joint:
    """Read one row of the table."""
    row = _mapping(node, 'a joint', JOINT_KEYS, JOINT_OPTIONS)
    kind = _choice(row, 'type', MOVABLE)
    link = _text(row, 'link') if 'link' in row else link
    twist = rotation_about('x', unit * _number(row, 'alpha'))
    turn = rotation_about('z', unit * _number(row, 'theta'))
    across = transform(twist, np.array([_number(row, 'a'), 0.0, 0.0]))
    along = transform(turn, np.array([0.0, 0.0, _number(row, 'd')]))
    unit = unit if kind in ROTARY else 1.0
    lower, upper = _read_limits(row, node, kind, unit)
    velocity = _number(row, 'velocity') if 'velocity' in row else math.inf
    if velocity <= 0.0:
        _refuse(row['velocity'], f'velocity is {velocity:g}; expected a positive number, or leave it out')
    # The motion, about or along z, commutes with the constant part of theta and d.
    origin, tail = (along, across) if standard else (across @ along, np.eye(4))
    return Joint(_text(row, 'name'), kind, parent, link, origin, tail=tail,
                 lower=lower, upper=upper, velocity=unit * velocity)


def _add_capsules(row: yaml.Node, joint: Joint, standard: bool, shapes: dict[str, tuple[Shape, ...]]) -> None:
    """Add the capsules of a row with a radius to the shapes of the two links that its joint connects.

    One lies along d, one along a. The parent holds what comes before the motion, d of a standard row and both of a
    modified one; the child holds a of a standard row. The travel of a prismatic joint has no shape.
    """
    fields = _mapping(row, 'a joint', JOINT_KEYS, JOINT_OPTIONS)
    if 'radius' not in fields:
        return
    radius, d = _number(fields, 'radius'), _number(fields, 'd')
    if not 0.0 < radius <= LARGEST:
        _refuse(fields['radius'], f'radius is {radius:g}; expected above 0, at most {LARGEST:g} m, or leave it out')
    before = joint.origin[:3, 3] - d * joint.origin[:3, 2]  # the foot of d in the parent's frame
    segments = [(joint.parent, before, joint.origin[:3, 3])]
    if standard:
        segments.append((joint.child, np.linalg.inv(joint.tail)[:3, 3], np.zeros(3)))
    else:
        segments.append((joint.parent, np.zeros(3), before))
    for link, start, end in segments:
        length = float(np.linalg.norm(end - start))
        if length > 0.0:
            frame = transform(rotation_from_z((end - start) / length), 0.5 * (start + end))
            shapes[link] = (*shapes.get(link, ()), Shape('capsule', np.array([radius, length]), frame))


def _read_limits(row: Fields, node: yaml.Node, kind: str, unit: float) -> tuple[float, float]:
    """Read lower and upper [rad, m]: required and in order, absent for a continuous joint."""
    given = [key for key in ('lower', 'upper') if key in row]
    if kind == 'continuous':
        if given:
            _refuse(row[given[0]], f'a continuous joint has no {given[0]}; leave it out or use type revolute')
        return -math.inf, math.inf
    if len(given) < 2:
        missing = 'upper' if given == ['lower'] else 'lower'
        _refuse(node, f'key {missing!r} is missing; a {kind} joint needs lower < upper')
    lower, upper = _number(row, 'lower'), _number(row, 'upper')
    if not lower < upper:
        problem = 'equal' if lower == upper else 'reversed'
        _refuse(row['lower'], f'lower = {lower:g}, upper = {upper:g} are {problem}; expected lower < upper')
    return unit * lower, unit * upper


def _read_placement(robot: Fields, key: str, unit: float) -> np.ndarray:
    """Read the transform before the first row (`base`) or after the last (`tool`); identity if missing."""
    if key not in robot:
        return np.eye(4)
    placement = _mapping(robot[key], key, ('xyz', 'rpy'), ())
    xyz, rpy = (np.array(_numbers(placement[name], name, 3)) for name in ('xyz', 'rpy'))
    return transform(rotation_from_rpy(unit * rpy), xyz)


def _read_home(robot: Fields, joints: list[Joint], unit: float) -> dict[str, float]:
    """Read the home configuration, one number per joint and within its limits."""
    if 'home' not in robot:
        return {}
    values = _numbers(robot['home'], 'home', len(joints))
    home = {joint.name: value * (unit if joint.kind in ROTARY else 1.0)
            for joint, value in zip(joints, values)}
    for joint, value in zip(joints, values):
        if not joint.lower <= home[joint.name] <= joint.upper:
            _refuse(robot['home'], f'home of joint {joint.name!r} is {value:g}, outside its limits')
    return home


def _refuse(node: yaml.Node, message: str) -> NoReturn:
    """Raise ModelError with the line of a node."""
    raise ModelError(f'line {node.start_mark.line + 1}: {message}')


def _mapping(node: yaml.Node, what: str, required: Collection[str], optional: Collection[str]) -> Fields:
    """Read a mapping whose keys are known, complete and given once."""
    if not isinstance(node, yaml.MappingNode):
        _refuse(node, f'{what} is not a mapping; expected the keys {list_names(required)}')
    fields: Fields = {}
    for key_node, value in node.value:
        key = str(key_node.value)
        if key not in (*required, *optional):
            _refuse(key_node, f'unknown key {key!r}; {suggest(key, (*required, *optional))}')
        if key in fields:
            _refuse(key_node, f'key {key!r} is given twice')
        fields[key] = value
    missing = [key for key in required if key not in fields]
    if missing:
        _refuse(node, f'{what}: missing key {list_names(map(repr, missing))}')
    return fields


def _sequence(node: yaml.Node, what: str) -> list[yaml.Node]:
    """Read a list."""
    if not isinstance(node, yaml.SequenceNode):
        _refuse(node, f'{what} is not a list')
    return node.value


def _text(fields: Fields, key: str) -> str:
    """Read a text that is not empty."""
    node = fields[key]
    if not isinstance(node, yaml.ScalarNode) or not node.value.strip():
        _refuse(node, f'{key} is empty or no text; expected a text')
    if key in NAMES and (fault := fault_of_name(str(node.value).strip())):
        _refuse(node, f'{key}: {fault}')
    return str(node.value).strip()


def _choice(fields: Fields, key: str, allowed: Collection[str]) -> str:
    """Read a text that must be one of a few."""
    value = _text(fields, key)
    if value not in allowed:
        _refuse(fields[key], f'{key} is {value!r}; expected one of {list_names(allowed)}')
    return value


def _number(fields: Fields, key: str) -> float:
    """Read a finite number."""
    return _to_float(fields[key], key)


def _numbers(node: yaml.Node, key: str, count: int) -> list[float]:
    """Read a list of finite numbers of known length."""
    values = [_to_float(item, key) for item in _sequence(node, key)]
    if len(values) != count:
        _refuse(node, f'{key} has {len(values)} numbers; expected {count}')
    return values


def _to_float(node: yaml.Node, key: str) -> float:
    """Read one finite number; 1e-3, which is text in YAML 1.1, is a number here."""
    if not isinstance(node, yaml.ScalarNode):
        _refuse(node, f'{key} is no number; expected a finite number')
    value = to_number(node.value)
    if math.isnan(value):
        _refuse(node, f'{key} is {node.value!r}; expected a finite number')
    return value
