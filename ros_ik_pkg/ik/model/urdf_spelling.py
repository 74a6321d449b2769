"""Elements and attributes of a URDF joint that are misspelt or misplaced: refused if they place a frame, else noted."""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Iterator
from xml.etree import ElementTree

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.text import suggest

# Elements that place or move a frame, and limits, with their attributes.
PLACING = {'origin': ('xyz', 'rpy', 'quat_xyzw'), 'axis': ('xyz',), 'mimic': ('joint', 'multiplier', 'offset')}
LIMITING = {'limit': ('lower', 'upper', 'velocity', 'effort'),
            'safety_controller': ('soft_lower_limit', 'soft_upper_limit', 'k_position', 'k_velocity')}  # fmt: skip
ELEMENTS = (*PLACING, *LIMITING, 'parent', 'child', 'dynamics', 'calibration')
SIMILAR = 0.65  # ratio of difflib from which an unknown element is taken for a misspelt one


def check_spelling(joint: ElementTree.Element, where: str) -> tuple[str, ...]:
    """Return notes on the elements and attributes of a <joint> that are not read.

    Elements and attributes with a prefix belong to other programs.

    Raises
    ------
    ModelError
        If one of them is likely meant to place or move a frame: an attribute of <origin>, <axis> or <mimic>, an element
        with almost such a name, or such an element inside another one.

    """
    for tag, known in PLACING.items():
        for key in _unknown_attributes(joint, tag, known):
            raise ModelError(f'{where}: <{tag}> has the unknown attribute {key[:60]!r}; {suggest(key, known)}')
    return (*_notes_on_elements(joint, where), *_notes_on_limits(joint, where))


def _unknown_attributes(joint: ElementTree.Element, tag: str, known: tuple[str, ...]) -> list[str]:
    found = joint.find(tag)
    return [] if found is None else [key for key in found.attrib if key not in known and ':' not in key]


def _notes_on_elements(joint: ElementTree.Element, where: str) -> Iterator[str]:
    """Yield what is odd about the elements of a joint; raise ModelError if one that places a frame would be lost."""
    for tag, count in Counter(child.tag for child in joint).items():
        if ':' in tag:
            continue
        if tag not in ELEMENTS:
            hint = suggest(tag, ELEMENTS)
            if difflib.get_close_matches(tag.lower(), PLACING, cutoff=SIMILAR):
                raise ModelError(f'{where}: unknown element <{tag[:60]}>; {hint}')
            yield f'{where}: the unknown element <{tag[:60]}> is ignored; {hint}'
        elif count > 1:
            yield f'{where}: <{tag}> appears {count} times; the first one counts'
    for child in joint:
        for inner in child if child.tag in ELEMENTS else ():
            if inner.tag in PLACING:
                raise ModelError(f'{where}: <{inner.tag}> is inside <{child.tag}>; expected it directly inside <joint>')


def _notes_on_limits(joint: ElementTree.Element, where: str) -> Iterator[str]:
    """Yield the attributes of limits that are not read."""
    for tag, known in LIMITING.items():
        for key in _unknown_attributes(joint, tag, known):
            yield f'{where}: the unknown attribute {key[:60]!r} of <{tag}> is ignored; {suggest(key, known)}'
