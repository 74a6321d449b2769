"""SRDF: which pairs of links may touch, as MoveIt's setup assistant writes it."""

from __future__ import annotations

import os
from pathlib import Path
from xml.etree import ElementTree

from ros_ik_pkg.ik.contacts.judge import FLOOR
from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.sources import BLANK, path_of
from ros_ik_pkg.ik.model.tree import Tree
from ros_ik_pkg.ik.model.urdf import MAX_BYTES, parse_xml

Allowed = dict[frozenset[str], str]


def read_allowed(srdf: str | os.PathLike[str] | None, tree: Tree) -> Allowed:
    """Return the pairs that an SRDF allows to touch, or if it names none, those of the robot's file of shapes.

    A link that may touch the floor by the file of shapes may do so with any SRDF. Raises ModelError as `read_srdf`.
    """
    allowed = {} if srdf is None else read_srdf(srdf, tree)
    if tree.shape_file is None:
        return allowed
    of_shapes = read_srdf(tree.shape_file, tree, 'file of shapes')
    on_floor = {pair: reason for pair, reason in of_shapes.items() if FLOOR in pair}
    return {**on_floor, **allowed} if allowed else of_shapes


def read_srdf(source: str | os.PathLike[str], tree: Tree, kind: str = 'SRDF') -> Allowed:
    """Return the pairs of links, or of a link and the floor, that an SRDF allows to touch, each with its reason.

    Parameters
    ----------
    source : str or path
        Path or URI (package://, file://) of an SRDF, or its text.
    tree : Tree
        The robot; an SRDF for another one is refused.
    kind : str
        What the source is called in reasons and errors.

    Raises
    ------
    ModelError
        If it cannot be read, or is for another robot.

    """
    robot = parse_xml(_text_of(source))
    if robot.tag != 'robot':
        raise ModelError(f'{kind}: the root element is <{robot.tag}>; expected <robot>')
    pairs: Allowed = {}
    for element in robot.findall('disable_collisions'):
        one, other = (element.get(key, '').strip() for key in ('link1', 'link2'))
        if not one or not other:
            raise ModelError(f'{kind}: <disable_collisions> needs link1 and link2')
        pairs[frozenset((one, other))] = element.get('reason', '').strip() or 'no reason given'
    _refuse_other_robot(robot, pairs, tree)
    return {pair: f'{kind}: {reason}' for pair, reason in pairs.items() if pair <= {*tree.links, FLOOR}}


def _text_of(source: str | os.PathLike[str]) -> str | bytes:
    """Return the document."""
    if isinstance(source, str) and source.lstrip(BLANK).startswith('<'):
        return source.lstrip(BLANK)
    try:
        path: Path = path_of(source)
        if path.exists() and not path.is_file():
            raise ModelError(f'SRDF {str(source)!r} is no regular file')
        with path.open('rb') as file:
            return file.read(MAX_BYTES + 1)
    except (OSError, TypeError, ValueError, RuntimeError) as error:
        if isinstance(error, ModelError):
            raise
        raise ModelError(f'cannot read the SRDF {str(source)!r}: {error}') from error


def _refuse_other_robot(robot: ElementTree.Element, pairs: Allowed, tree: Tree) -> None:
    """Raise ModelError if an SRDF with pairs has another name than the robot, or mostly links that it lacks."""
    name, links = robot.get('name', ''), {link for pair in pairs for link in pair}
    unknown = sorted(links - {*tree.links, FLOOR})
    if pairs and name != tree.name:
        raise ModelError(f'the SRDF is for robot {name!r}; expected one for {tree.name!r}')
    if 2 * len(unknown) > len(links):
        raise ModelError(f'the SRDF names {len(unknown)} of {len(links)} links that robot {tree.name!r} does not '
                         f'have, such as {unknown[0]!r}; is it for another robot?')
