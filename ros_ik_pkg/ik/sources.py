"""Where robots come from: shipped by name, a DH table or URDF by path, or URDF text."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from ros_ik_pkg.ik.dh import parse_dh
from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.tree import Tree, shorten
from ros_ik_pkg.ik.urdf import MAX_BYTES, parse_urdf
from ros_ik_pkg.share import share_path

READERS: dict[str, Callable[[bytes], Tree]] = {'.yaml': parse_dh, '.yml': parse_dh, '.urdf': parse_urdf}
BLANK = '\ufeff \t\r\n'


def robot_names() -> tuple[str, ...]:
    """Names of the robots that come with the package."""
    return tuple(sorted(path.stem for path in (share_path() / 'config' / 'robots').glob('*.yaml')))


def read_tree(source: str | os.PathLike[str]) -> Tree:
    """Read the links and joints of a robot from any source that `load_arm` takes."""
    if isinstance(source, str) and source.lstrip(BLANK).startswith('<'):
        return parse_urdf(source.lstrip(BLANK))
    try:
        path = _find_file(source)
        with path.open('rb') as file:
            content = file.read(MAX_BYTES + 1)  # the reader refuses what is longer
    except ModelError:
        raise
    except (OSError, TypeError, ValueError) as error:
        raise ModelError(f'cannot read the robot {source!r}: {error}') from error
    try:
        return READERS[path.suffix.lower()](content)
    except ModelError as error:
        raise ModelError(f'{path}: {error}') from error


def _find_file(source: str | os.PathLike[str]) -> Path:
    """Find the file that a name or path means."""
    path = Path(source)
    if path.suffix.lower() in READERS:
        return path
    if str(source) in robot_names():
        return share_path() / 'config' / 'robots' / f'{source}.yaml'
    raise ModelError(f'robot {str(source)!r} is not known: expected one of {shorten(robot_names())}, '
                     f'a path that ends in {shorten(READERS)}, or URDF text')
