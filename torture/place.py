"""Check whether an error about a robot file names the place in the file."""

from __future__ import annotations

import re

POSITION = re.compile(r'\bline \d+|\bposition \d+')
ELEMENT = re.compile(r'<(\w+)')
QUOTED = re.compile(r"'((?:[^'\\]|\\.)+)'" + '|' + r'"((?:[^"\\]|\\.)+)"')
ROBOT = re.compile(r"^robot ('.*?'|\".*?\"): ", re.S)  # the name of the robot is not a place in it
# Errors about a whole file have no place in it.
WHOLE = re.compile(
    'the file is empty|the robot has no links|the robot has [0-9]+ links|has [0-9]+ bytes|cannot be decoded|'
    'it is no regular file|declares a DOCTYPE|maximum recursion depth'
)


def names_a_place(error: str, text: str) -> bool:
    """Whether an error names a line, a position, or an element, joint, link or key that the file has."""
    error, text = ROBOT.sub('', error), text.replace('\0', '')  # which UTF-16 has between its letters
    if POSITION.search(error) or WHOLE.search(error):
        return True
    quoted = [one or other for one, other in QUOTED.findall(error)]
    listed = error.rpartition(': ')[2].split(', ')
    return any(word and word in text for word in (*quoted, *listed, *(f'<{tag}' for tag in ELEMENT.findall(error))))
