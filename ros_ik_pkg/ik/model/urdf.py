"""URDF text -> a checked tree of links and joints. Masses and materials are ignored."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.collision_elements import read_collisions
from ros_ik_pkg.ik.model.tree import MOVABLE, Joint, Mimic, Tree, grow
from ros_ik_pkg.ik.model.urdf_spelling import check_spelling
from ros_ik_pkg.ik.model.xml_values import read_number, read_origin, read_vector
from ros_ik_pkg.ik.text import list_names, to_number

MAX_BYTES = 32 * 2**20
MAX_LINKS = 5000
ENDLESS = 1e4  # [rad, m] limits beyond this on both sides are how some files write "none"
DEGREES = 30.0, 1000.0  # [rad] a revolute limit in this range was probably written in degrees
KINDS = (*MOVABLE, 'fixed', 'floating', 'planar')
INFINITE = ('inf', '+inf', '-inf', 'infinity', '+infinity', '-infinity')
REMEDY = '; or give limits in joint_limits, or a position in held_joints'
VERSION = re.compile(r'\s*1\.(\d+)\s*')


def parse_urdf(text: str | bytes) -> Tree:
    """Read a URDF document.

    Parameters
    ----------
    text : str or bytes
        The XML document, xacro macros already expanded.

    Returns
    -------
    Tree
        Links and joints; limits that are wrong are noted in `Joint.fault`, for the chain to refuse.

    Raises
    ------
    ModelError
        If the text is not XML, not URDF, or not a single tree of links.

    """
    robot = parse_xml(text)
    if robot.tag != 'robot':
        raise ModelError(f'the root element is <{robot.tag}>; expected <robot>, is this a URDF?')
    if any(element.tag.startswith('xacro:') for element in robot):
        raise ModelError('the text holds xacro macros; expand it to URDF first: xacro FILE > robot.urdf')
    name = robot.get('name') or 'robot'
    try:
        return _read_tree(robot, name)
    except ModelError as error:
        raise ModelError(f'robot {name[:60]!r}: {error}') from error


def _read_tree(robot: ElementTree.Element, name: str) -> Tree:
    """Read all links and joints."""
    links = [_name(element, 'link') for element in robot.findall('link')]
    if len(links) > MAX_LINKS:
        raise ModelError(f'the robot has {len(links)} links; at most {MAX_LINKS} are read')
    quaternions = _read_minor_version(robot) >= 1
    joints = [_read_joint(element, quaternions) for element in robot.findall('joint')]
    shapes, faults = read_collisions(robot, quaternions)
    return replace(grow(name, links, joints), shapes=shapes, shape_faults=faults)


def _read_minor_version(robot: ElementTree.Element) -> int:
    """Read the n of <robot version="1.n">; 0 if the version is missing, as in urdfdom."""
    version = robot.get('version', '1.0')
    match = VERSION.fullmatch(version)
    if not match:
        raise ModelError(f'<robot version> is {version[:20]!r}; expected 1.0 or 1.1')
    return int(match[1])


def parse_xml(text: str | bytes) -> ElementTree.Element:
    """Parse the document; errors give line and column. Prefixes need no declaration, as in ROS itself."""
    if len(text) > MAX_BYTES:
        raise ModelError(f'the URDF has {len(text)} bytes; at most {MAX_BYTES} are read')
    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = _refuse_doctype
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        where = f'line {error.lineno}, column {error.offset + 1}'
        raise ModelError(f'{where}: not well-formed XML ({expat.ErrorString(error.code)})') from error
    except (UnicodeError, LookupError) as error:
        raise ModelError(f'the XML cannot be decoded: {error}') from error
    return builder.close()


def _refuse_doctype(name: str, *_: object) -> None:
    """Refuse a DOCTYPE, and with it every entity declaration."""
    raise ModelError(f'the XML declares a DOCTYPE ({name}); URDF needs none, remove it')


def _name(element: ElementTree.Element, what: str) -> str:
    """Read the name of a link or joint."""
    name = element.get('name', '').strip()
    if not name:
        raise ModelError(f'a <{what}> has no name; expected <{what} name="...">')
    return name


def _read_joint(element: ElementTree.Element, quaternions: bool) -> Joint:
    """Read one <joint>; `quaternions` is true if the version of the document allows them."""
    name = _name(element, 'joint')
    kind = element.get('type', '').strip()
    if kind not in KINDS:
        raise ModelError(f'joint {name!r} has type {kind!r}; expected one of {list_names(KINDS)}')
    where = f'joint {name!r}'
    spelling = check_spelling(element, where)
    lower, upper, velocity, fault, notes = _read_limits(element, kind, where)
    soft, soft_notes = _read_soft_limits(element, kind, where)
    return Joint(
        name, kind, _read_link(element, 'parent', where), _read_link(element, 'child', where),
        origin=read_origin(element, where, quaternions),
        axis=_read_axis(element, where) if kind in MOVABLE else np.array([0.0, 0.0, 1.0]),
        lower=lower, upper=upper, velocity=velocity, mimic=_read_mimic(element, where), fault=fault,
        soft=soft, notes=(*spelling, *notes, *soft_notes))


def _read_link(element: ElementTree.Element, role: str, where: str) -> str:
    """Read the link name of <parent> or <child>."""
    found = element.find(role)
    link = '' if found is None else found.get('link', '').strip()
    if not link:
        raise ModelError(f'{where}: no <{role} link="..."/>')
    return link


def _read_axis(element: ElementTree.Element, where: str) -> np.ndarray:
    """Read <axis xyz> as a unit vector of the joint frame; x if missing, the default of URDF."""
    axis = element.find('axis')
    if axis is None:
        return np.array([1.0, 0.0, 0.0])
    vector = read_vector(axis.get('xyz', '1 0 0'), f'{where}: <axis xyz>')
    largest = np.abs(vector).max()
    if largest == 0.0:
        raise ModelError(f'{where}: <axis xyz> is zero; expected a direction')
    vector /= largest  # so that the squares neither overflow nor vanish
    return vector / np.linalg.norm(vector)


def _read_limits(element: ElementTree.Element, kind: str, where: str) -> tuple[float, float, float, str, list[str]]:
    """Read <limit>: lower, upper, velocity, the fault in them, and notes."""
    none = -math.inf, math.inf
    if kind not in MOVABLE:
        fault = '' if kind == 'fixed' else f'{where} is of type {kind}; a chain takes {list_names(KINDS[:4])}'
        return *none, math.inf, fault, []
    limit = element.find('limit')
    if limit is None:
        fault = '' if kind == 'continuous' else f'{where}: no <limit>; a {kind} joint needs lower < upper{REMEDY}'
        return *none, math.inf, fault, []
    try:
        velocity, notes = _read_velocity(limit, where)
        if kind == 'continuous':
            return *none, velocity, '', notes
        lower, upper = (read_number(limit.get(key, '0'), f'{where}: <limit {key}>') for key in ('lower', 'upper'))
    except ModelError as error:
        return *none, math.inf, str(error), []
    given = f'{where}: limits lower = {lower:g} and upper = {upper:g}'
    if min(-lower, upper) > ENDLESS:
        return *none, velocity, '', [*notes, f'{given} are read as no limits']
    if kind == 'revolute' and DEGREES[0] < max(-lower, upper) < DEGREES[1]:
        notes.append(f'{given} are probably degrees; URDF has radians, and they are read as such')
    return lower, upper, velocity, _judge_limits(limit, lower, upper, where), notes


def _judge_limits(limit: ElementTree.Element, lower: float, upper: float, where: str) -> str:
    """Return what is wrong with two finite limits; empty if nothing."""
    if lower < upper or (lower == upper and {'lower', 'upper'} <= set(limit.attrib)):
        return ''
    if 'lower' not in limit.attrib and 'upper' not in limit.attrib:
        return f'{where}: <limit> has neither lower nor upper; expected lower < upper, or type continuous{REMEDY}'
    for missing, key, given in (('upper', 'lower', lower), ('lower', 'upper', upper)):
        if missing not in limit.attrib:
            return f'{where}: <limit> has {key} = {given:g}, but {missing} is missing and counts as 0; ' \
                   f'expected lower < upper{REMEDY}'
    return f'{where}: limits lower = {lower:g} and upper = {upper:g} are reversed; expected lower < upper{REMEDY}'


def _read_soft_limits(element: ElementTree.Element, kind: str, where: str) -> tuple[tuple[float, float], list[str]]:
    """Read <safety_controller>: the soft limits, infinite if there are none, and notes.

    A missing one counts as 0, as in urdfdom; a continuous joint has none.
    """
    none = -math.inf, math.inf
    safety = element.find('safety_controller')
    keys = 'soft_lower_limit', 'soft_upper_limit'
    if safety is None or kind not in ('revolute', 'prismatic') or not set(keys) & set(safety.attrib):
        return none, []
    lower, upper = (to_number(safety.get(key, '0')) for key in keys)
    if lower < upper:
        return (lower, upper), []
    if lower == upper == 0.0:  # how generated files write "none"
        return none, []
    given = ' and '.join(repr(safety.get(key, '0')[:30]) for key in keys)
    return none, [f'{where}: soft limits {given} are no range; they are ignored']


def _read_velocity(limit: ElementTree.Element, where: str) -> tuple[float, list[str]]:
    """Read the velocity limit [rad/s, m/s]; missing, 0, negative or infinite, as in many files, means unknown."""
    text = limit.get('velocity')
    if text is None:
        return math.inf, []
    velocity = math.inf if text.strip().lower() in INFINITE else read_number(text, f'{where}: <limit velocity>')
    if 0.0 < velocity < math.inf:
        return velocity, []
    return math.inf, [f'{where}: <limit velocity> is {text.strip()}; it is read as no limit']


def _read_mimic(element: ElementTree.Element, where: str) -> Mimic | None:
    """Read <mimic joint multiplier offset>."""
    mimic = element.find('mimic')
    if mimic is None:
        return None
    return Mimic(mimic.get('joint', '').strip(),
                 read_number(mimic.get('multiplier', '1'), f'{where}: <mimic multiplier>'),
                 read_number(mimic.get('offset', '0'), f'{where}: <mimic offset>'))
