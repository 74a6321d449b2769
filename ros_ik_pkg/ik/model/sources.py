"""Where robots come from: shipped by name, a DH table, URDF or xacro by path or URI, or URDF text."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from urllib.parse import unquote

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.dh import parse_dh
from ros_ik_pkg.ik.model.shape_file import with_shapes
from ros_ik_pkg.ik.model.tree import Tree
from ros_ik_pkg.ik.model.urdf import MAX_BYTES, parse_urdf
from ros_ik_pkg.ik.text import did_you_mean, list_names
from ros_ik_pkg.share import share_path

READERS: dict[str, Callable[[str | bytes], Tree]] = {
    '.yaml': parse_dh, '.yml': parse_dh, '.urdf': parse_urdf, '.xacro': parse_urdf}
PACKAGE_SCHEME, FILE_SCHEME = 'package://', 'file://'
BLANK = '\ufeff \t\r\n'


def robot_names() -> tuple[str, ...]:
    """Names of the robots that come with the package."""
    return tuple(sorted(path.stem for path in (share_path() / 'config' / 'robots').glob('*.yaml')))


def parse_xacro_args(entries: Iterable[str]) -> dict[str, str]:
    """Return the arguments of entries 'name:=value', as the xacro program takes them; raises ModelError."""
    args = {}
    for entry in entries:
        name, given, value = entry.partition(':=')
        if not given or not name.strip():
            raise ModelError(f'xacro_args: {entry[:60]!r} is not allowed; expected NAME:=VALUE')
        args[name.strip()] = value
    return args


def read_text(source: str | os.PathLike[str]) -> str:
    """Return the text of a YAML file by path or URI, or the text itself if a colon ends a word of it."""
    if isinstance(source, str) and re.search(r':\s', source):
        return source
    try:
        path = path_of(source)
        if path.exists() and not path.is_file():
            raise ModelError(f'cannot read {str(source)!r}: it is no regular file')
        with path.open('rb') as file:
            return file.read(MAX_BYTES + 1).decode('utf-8')
    except (OSError, TypeError, ValueError, RuntimeError) as error:
        raise ModelError(f'cannot read {source!r}: {error}') from error


def read_tree(source: str | os.PathLike[str], xacro_args: Mapping[str, str] | None = None) -> Tree:
    """Read the links and joints of a robot from any source that `load_arm` takes."""
    if isinstance(source, str) and source.lstrip(BLANK).startswith('<'):
        return parse_urdf(source.lstrip(BLANK))
    try:
        path = _find_file(source)
        if path.exists() and not path.is_file():  # opening a pipe would block until something writes to it
            raise ModelError(f'cannot read the robot {str(source)!r}: it is no regular file')
        with path.open('rb') as file:
            content = file.read(MAX_BYTES + 1)  # the reader refuses longer files
    except ModelError:
        raise
    except (OSError, TypeError, ValueError, RuntimeError) as error:  # the last if ~ has no home directory
        raise ModelError(f'cannot read the robot {source!r}: {error}') from error
    suffix = path.suffix.lower()
    try:
        tree = READERS[suffix](_expand(path, xacro_args or {}) if suffix == '.xacro' else content)
        return with_shapes(replace(tree, folder=path.parent))
    except ModelError as error:
        raise ModelError(f'{path}: {error}') from error


def _find_file(source: str | os.PathLike[str]) -> Path:
    """Return the path of the file for a name, path or URI."""
    path = path_of(source)
    if path.suffix.lower() in READERS:
        return path
    if str(source) in robot_names():
        return share_path() / 'config' / 'robots' / f'{source}.yaml'
    meant = did_you_mean(str(source), robot_names())
    raise ModelError(f'robot {str(source)!r} is not known: expected one of {list_names(robot_names())}, a path that '
                     f'ends in {list_names(READERS)}, or URDF text{"; " if meant else ""}{meant}')


def path_of(source: str | os.PathLike[str]) -> Path:
    """Return the path for a path or URI; ~ is expanded as in a shell."""
    if isinstance(source, str) and source.startswith(PACKAGE_SCHEME):
        return _path_in_package(source)
    if isinstance(source, str) and source.startswith(FILE_SCHEME):
        return _path_of_file_uri(source)
    return Path(source).expanduser()


def _path_of_file_uri(uri: str) -> Path:
    """Return the path of file:///PATH, with %20 and the like decoded."""
    host, slash, path = uri.removeprefix(FILE_SCHEME).partition('/')
    if host not in ('', 'localhost') or not path:
        raise ModelError(f'robot {uri!r}: expected file:///PATH, the whole path of a file of this machine')
    return Path(slash + unquote(path))


def _path_in_package(uri: str) -> Path:
    """Resolve package://PACKAGE/PATH by the ament index, as a sourced ROS workspace has it."""
    package, _, path = uri.removeprefix(PACKAGE_SCHEME).partition('/')
    if not package or not path:
        raise ModelError(f'robot {uri!r}: expected package://PACKAGE/PATH')
    try:
        from ament_index_python import get_package_share_directory
    except ImportError as error:
        raise ModelError(f'robot {uri!r}: {error}; package:// needs a sourced ROS, else give a path') from error
    try:
        return Path(get_package_share_directory(package), path)
    except (LookupError, OSError, ValueError) as error:  # not found, no workspace, no name of a package
        raise ModelError(f'robot {uri!r}: {error}; source the workspace that has package {package!r}') from error


def _expand(path: Path, args: Mapping[str, str]) -> str:
    """Expand a xacro file to URDF; it evaluates Python, so it is done to files that were named, never to text."""
    try:
        import xacro
    except ImportError as error:
        raise ModelError(f'{error}; install the package xacro (ros-jazzy-xacro, or pip install xacro), '
                         'or expand the file first: xacro FILE > robot.urdf') from error
    try:
        return str(xacro.process_file(str(path), mappings=dict(args)).toxml())
    except Exception as error:  # expressions in the file may raise anything
        hint = '; give arguments with xacro_args, such as NAME:=VALUE' if 'arg' in str(error).lower() else ''
        raise ModelError(f'xacro cannot expand it: {type(error).__name__}: {error}{hint}') from error
