"""URDF text -> a checked tree of links and joints. Meshes, masses and materials are never looked at."""

from __future__ import annotations

import math
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.transforms import rotation_from_rpy, transform
from ros_ik_pkg.ik.model.tree import MOVABLE, Joint, Mimic, Tree, grow
from ros_ik_pkg.ik.text import list_names, to_number

MAX_BYTES = 32 * 2**20
MAX_LINKS = 5000
ENDLESS = 1e4  # [rad] revolute limits beyond this on both sides are how some files write "none"
KINDS = (*MOVABLE, 'fixed', 'floating', 'planar')


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
        Where the text is no XML, no URDF, or no single tree of links.

    """
    robot = _parse_xml(text)
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
    joints = [_read_joint(element) for element in robot.findall('joint')]
    return grow(name, links, joints)


def _parse_xml(text: str | bytes) -> ElementTree.Element:
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


def _read_joint(element: ElementTree.Element) -> Joint:
    """Read one <joint>."""
    name = _name(element, 'joint')
    kind = element.get('type', '').strip()
    if kind not in KINDS:
        raise ModelError(f'joint {name!r} has type {kind!r}; expected one of {list_names(KINDS)}')
    where = f'joint {name!r}'
    lower, upper, velocity, fault = _read_limits(element, kind, where)
    return Joint(
        name, kind, _read_link(element, 'parent', where), _read_link(element, 'child', where),
        origin=_read_origin(element, where),
        axis=_read_axis(element, where) if kind in MOVABLE else np.array([0.0, 0.0, 1.0]),
        lower=lower, upper=upper, velocity=velocity, mimic=_read_mimic(element, where), fault=fault)


def _read_link(element: ElementTree.Element, role: str, where: str) -> str:
    """Read the link name of <parent> or <child>."""
    found = element.find(role)
    link = '' if found is None else found.get('link', '').strip()
    if not link:
        raise ModelError(f'{where}: no <{role} link="..."/>')
    return link


def _read_origin(element: ElementTree.Element, where: str) -> np.ndarray:
    """Read <origin xyz rpy> as the transform from the parent link to the joint; identity where missing."""
    origin = element.find('origin')
    if origin is None:
        return np.eye(4)
    xyz, rpy = (_vector(origin.get(key, '0 0 0'), f'{where}: <origin {key}>') for key in ('xyz', 'rpy'))
    return transform(rotation_from_rpy(rpy), xyz)


def _read_axis(element: ElementTree.Element, where: str) -> np.ndarray:
    """Read <axis xyz> as a unit vector of the joint frame; x where missing, as URDF has it."""
    axis = element.find('axis')
    if axis is None:
        return np.array([1.0, 0.0, 0.0])
    vector = _vector(axis.get('xyz', '1 0 0'), f'{where}: <axis xyz>')
    largest = np.abs(vector).max()
    if largest == 0.0:
        raise ModelError(f'{where}: <axis xyz> is zero; expected a direction')
    vector /= largest  # so that the squares neither overflow nor vanish
    return vector / np.linalg.norm(vector)


def _read_limits(element: ElementTree.Element, kind: str, where: str) -> tuple[float, float, float, str]:
    """Read <limit>: lower, upper, velocity, and what is wrong with them."""
    if kind not in MOVABLE:
        fault = '' if kind == 'fixed' else f'{where} is of type {kind}; a chain takes {list_names(KINDS[:4])}'
        return -math.inf, math.inf, math.inf, fault
    limit = element.find('limit')
    if limit is None:
        fault = '' if kind == 'continuous' else f'{where}: no <limit>; a {kind} joint needs lower < upper'
        return -math.inf, math.inf, math.inf, fault
    try:
        velocity = _read_velocity(limit, where)
        if kind == 'continuous':
            return -math.inf, math.inf, velocity, ''
        lower, upper = (_number(limit.get(key, '0'), f'{where}: <limit {key}>') for key in ('lower', 'upper'))
    except ModelError as error:
        return -math.inf, math.inf, math.inf, str(error)
    if kind == 'revolute' and min(-lower, upper) > ENDLESS:
        return -math.inf, math.inf, velocity, ''
    return lower, upper, velocity, _judge_limits(limit, lower, upper, where)


def _judge_limits(limit: ElementTree.Element, lower: float, upper: float, where: str) -> str:
    """Say what is wrong with two finite limits, or nothing."""
    if lower < upper:
        return ''
    if 'lower' not in limit.attrib and 'upper' not in limit.attrib:
        return f'{where}: <limit> has neither lower nor upper; expected lower < upper, or type continuous'
    for missing, key, given in (('upper', 'lower', lower), ('lower', 'upper', upper)):
        if missing not in limit.attrib:
            return f'{where}: <limit> has {key} = {given:g}, but {missing} is missing and counts as 0; ' \
                   'expected lower < upper'
    problem = 'equal; make the joint fixed or widen them' if lower == upper else 'reversed'
    return f'{where}: limits lower = {lower:g} and upper = {upper:g} are {problem}; expected lower < upper'


def _read_velocity(limit: ElementTree.Element, where: str) -> float:
    """Read the velocity limit [rad/s, m/s]; missing or 0, as many files have it, means unknown."""
    velocity = _number(limit.get('velocity', '0'), f'{where}: <limit velocity>')
    if velocity < 0.0:
        raise ModelError(f'{where}: <limit velocity> is {velocity:g}; expected a positive number')
    return velocity or math.inf


def _read_mimic(element: ElementTree.Element, where: str) -> Mimic | None:
    """Read <mimic joint multiplier offset>."""
    mimic = element.find('mimic')
    if mimic is None:
        return None
    return Mimic(mimic.get('joint', '').strip(),
                 _number(mimic.get('multiplier', '1'), f'{where}: <mimic multiplier>'),
                 _number(mimic.get('offset', '0'), f'{where}: <mimic offset>'))


def _vector(text: str, what: str) -> np.ndarray:
    """Read three finite numbers."""
    words = text.split()
    if len(words) != 3:
        raise ModelError(f'{what} is {text!r}; expected three numbers')
    return np.array([_number(word, what) for word in words])


def _number(text: str, what: str) -> float:
    """Read one finite number."""
    value = to_number(text)
    if math.isnan(value):
        raise ModelError(f'{what} is {text!r}; expected a finite number')
    return value
