"""Where compiled code is kept: a folder named after everything that the code depends on.

Numba checks only the file of a function to decide whether its cached code is valid, but code of this package is
inlined across files. Any change makes a new folder, and code of a read-only installation is cached too.
"""

from __future__ import annotations

import ast
import contextlib
import hashlib
import os
import re
import tempfile
from collections.abc import Iterable
from pathlib import Path

import llvmlite
import numba

from ros_ik_pkg.ik.kernel.numba_insides import WHY_PLAIN

PACKAGE = 'ros_ik_pkg'
DECORATED = re.compile(r'^@(compiled|kernel|inlined|entry_point|variant_of)\b', re.MULTILINE)
NAMES = 'names'  # of folders, by the exact text of the sources


def cache_folder() -> Path | None:
    """Return the folder for compiled code; None if there is none, and code is kept in memory only.

    It is below $NUMBA_CACHE_DIR, else $XDG_CACHE_HOME, else ~/.cache, and is named after what the code depends on, so
    that a clone, a workspace and an installed package share it. A folder that is not writable is still read.
    """
    root = os.environ.get('NUMBA_CACHE_DIR') or os.environ.get('XDG_CACHE_HOME') or '~/.cache'
    try:
        top = Path(root).expanduser() / PACKAGE
        folder = top / name_of_sources(sources_of_compiled_code(), top / NAMES)
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        return None
    return folder if is_writable(folder) or any(folder.glob('*.nbi')) else None


def is_writable(folder: Path) -> bool:
    """Return whether a file can be written to a folder; permissions alone do not show a full disk."""
    try:
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(bytes(4096))
    except OSError:
        return False
    return True


def sources_of_compiled_code() -> list[Path]:
    """Return the files of the package that hold compiled functions, and those whose constants they import."""
    top = Path(__file__).parents[2]
    imported = {path: _imported_files(path, top) for path in (*(top / 'ik').rglob('*.py'), *top.glob('*.py'))}
    found = {path for path in imported if DECORATED.search(path.read_text())}
    while more := {file for path in found for file in imported[path]} - found:
        found |= more
    return sorted(found)


def count_functions() -> int:
    """Return about how many functions the solver has to compile: the decorated ones."""
    return sum(len(DECORATED.findall(path.read_text())) for path in sources_of_compiled_code())


def _imported_files(path: Path, top: Path) -> set[Path]:
    """Return the files below `top` from which a file imports, judged by its text."""
    modules = re.findall(rf'^from {PACKAGE.replace(".", "[.]")}[.]([\w.]+) import', path.read_text(), re.MULTILINE)
    return {top / (module.replace('.', '/') + '.py') for module in modules}


def name_of_sources(paths: list[Path], known: Path) -> str:
    """Return `digest_of_sources`; look it up in the folder `known` by what the files hold, to the letter.

    To read the syntax of all files takes a fifth of a second, at every import.
    """
    note = known / _digest(path.name.encode() + path.read_bytes() for path in paths)
    with contextlib.suppress(OSError, UnicodeDecodeError):
        if re.fullmatch(r'[0-9a-f]{16}', text := note.read_text()):
            return text
    name = digest_of_sources(paths)
    with contextlib.suppress(OSError):
        known.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile('w', dir=known, delete=False) as file:
            file.write(name)
        Path(file.name).replace(note)  # whole or not at all: others start at the same time
    return name


def digest_of_sources(paths: Iterable[Path]) -> str:
    """Return a name for what these files compile to: releases of the compiler count; comments, docstrings, places and
    the looks of methods do not."""
    return _digest(_meaning(path).encode() for path in paths)


def _meaning(path: Path) -> str:
    """Return the name and the syntax of a file, without what does not change the compiled code."""
    tree = ast.parse(path.read_bytes())
    for node in ast.walk(tree):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node) is not None:
            del node.body[0]
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == 'Look':
            node.args, node.keywords = [], []
    return f'{path.name} {ast.dump(tree)}'


def _digest(parts: Iterable[bytes]) -> str:
    """Return 16 hexadecimal digits for the parts and the compiler."""
    digest = hashlib.sha256(f'{numba.__version__} {llvmlite.__version__} {bool(WHY_PLAIN)}'.encode())
    for part in parts:
        digest.update(part)
    return digest.hexdigest()[:16]


CACHE_FOLDER = cache_folder()
