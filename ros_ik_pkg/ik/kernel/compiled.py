"""The decorators for compiled functions, so that all share the same arithmetic and the same cache.

Numba checks only the file of a function to decide whether its cached code is valid, but code of this package is
inlined across files. So the cache is a folder named after everything that the compiled code depends on: any change
makes a new folder, and code of a read-only installation is cached too.
"""

from __future__ import annotations

import ast
import hashlib
import os
import re
import tempfile
import threading
from collections.abc import Callable, Iterable
from functools import update_wrapper
from pathlib import Path
from typing import Any, TypeVar

import llvmlite
import numba

from ros_ik_pkg.ik.kernel.garbage import collect_less
from ros_ik_pkg.ik.kernel.numba_insides import WHY_PLAIN

PACKAGE = 'ros_ik_pkg'
DECORATED = re.compile(r'^@(compiled|kernel|inlined|entry_point|variant_of)\b', re.MULTILINE)
Function = TypeVar('Function', bound=Callable[..., Any])


def cache_folder() -> Path | None:
    """Return the folder for compiled code; None if there is none, and code is kept in memory only.

    It is below $NUMBA_CACHE_DIR, else $XDG_CACHE_HOME, else ~/.cache, and is named after what the code depends on, so
    that a clone, a workspace and an installed package share it. A folder that is not writable is still read.
    """
    root = os.environ.get('NUMBA_CACHE_DIR') or os.environ.get('XDG_CACHE_HOME') or '~/.cache'
    try:
        folder = Path(root).expanduser() / 'ros_ik_pkg' / digest_of_sources(sources_of_compiled_code())
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


def digest_of_sources(paths: Iterable[Path]) -> str:
    """Return a name for what these files compile to: releases of the compiler count; comments, docstrings, places and
    the looks of methods do not."""
    digest = hashlib.sha256(f'{numba.__version__} {llvmlite.__version__} {bool(WHY_PLAIN)}'.encode())
    for path in paths:
        tree = ast.parse(path.read_bytes())
        for node in ast.walk(tree):
            if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node) is not None:
                del node.body[0]
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == 'Look':
                node.args, node.keywords = [], []
        digest.update(f'{path.name} {ast.dump(tree)}'.encode())
    return digest.hexdigest()[:16]


CACHE_FOLDER = cache_folder()
NOT_SAVED: list[str] = []  # why compiled code could not be saved
translated: list[str] = []  # names of the parts that were compiled so far
collect_less()


def _njit(function: Callable[..., Any], **options: Any) -> Any:
    """Return njit with the options that all compiled functions share."""
    return numba.njit(
        error_model='numpy',  # x / 0 is inf or NaN, which the loop detects, not a branch and a raise
        nogil=True,  # batches run on threads
        fastmath={'contract'},  # a * b + c may become one instruction; nothing is reordered
        **options,
    )(function)


def compiled(function: Function, **options: Any) -> Function:
    """Decorate a function that Python calls; it may allocate."""
    dispatcher: Any = _njit(function, **{'forceinline': False, **options})  # else callers decide
    if CACHE_FOLDER is not None:
        _enable_cache(dispatcher, CACHE_FOLDER)
    return dispatcher


def _enable_cache(dispatcher: Any, folder: Path) -> None:
    """Cache a function in a folder, if this Numba has the usual cache interface."""
    try:
        from ros_ik_pkg.ik.kernel.disk_cache import cache_in

        dispatcher._cache = cache_in(folder, NOT_SAVED)(dispatcher.py_func)
    except (ImportError, AttributeError, TypeError) as error:
        NOT_SAVED.append(f'Numba {numba.__version__} keeps it in another way ({error})')


def _part(function: Function, forceinline: bool) -> Function:
    """Decorate a function that compiled functions call. If Python calls it, it is compiled separately for that.

    It does not count references (atomic instructions, which cost more than the arithmetic), so it cannot allocate;
    Numba refuses to compile it if it does.
    """
    if WHY_PLAIN:
        return compiled(function, forceinline=forceinline)
    from ros_ik_pkg.ik.kernel.parts import PartCompiler, make_part

    options = {'forceinline': forceinline, '_nrt': False}
    dispatcher: Any = _njit(function, pipeline_class=PartCompiler, **options)
    make_part(dispatcher, compiled(function, **options), translated)
    return dispatcher


def kernel(function: Function) -> Function:
    """Decorate a function that is called inside the loop."""
    return _part(function, forceinline=False)


def inlined(function: Function) -> Function:
    """Decorate a small kernel that returns tuples: inlined, so that the numbers stay in registers."""
    return _part(function, forceinline=True)


def variant_of(part: Any, record: type) -> Callable[[Function], Function]:
    """Return a decorator: the function is compiled in place of `part` where an argument of it is such a named tuple.

    The choice is made by the types while a caller compiles, so callers with other records do not notice.
    """

    def decorate(function: Function) -> Function:
        variant: Any = _part(function, part.targetoptions['forceinline'])
        usual = part.compile

        def choose(types: Any) -> Any:
            if not any(getattr(kind, 'instance_class', None) is record for kind in types):
                return usual(types)
            entry = variant.compile(types)
            part.overloads[types] = variant.overloads[types]
            return entry

        part.compile = choose  # Numba asks it for the code that it has not looked up yet
        return variant

    return decorate


class EntryPoint:
    """A compiled function that Python calls, for one list of argument types; others raise TypeError.

    It is compiled, or loaded from the cache, at its first call and not at import. Callers need not check types,
    because Numba does so anyway. `compiled` is what it calls: after `prepare` it may be called directly, which saves
    a tenth of a microsecond.
    """

    def __init__(self, function: Callable[..., Any], signature: Any) -> None:
        update_wrapper(self, function)
        self.compiled: Any = compiled(function)
        self._signature = signature
        self._once = threading.Lock()
        self._ready = False

    def __call__(self, *arguments: Any) -> Any:
        if not self._ready:
            self.prepare()
        return self.compiled(*arguments)

    def prepare(self) -> None:
        """Compile it, or load it from the cache, unless that is done."""
        with self._once:
            if not self._ready:
                self.compiled.compile(self._signature)
                self.compiled.disable_compile()
                self._ready = True

    def is_cached(self) -> bool:
        """Return whether the cache has its code for this machine."""
        cache, target = self.compiled._cache, self.compiled.targetctx
        return CACHE_FOLDER is not None and cache.load_overload(self._signature, target) is not None


def entry_point(result: Any, arguments: list[Any]) -> Callable[[Callable[..., Any]], EntryPoint]:
    """Return a decorator that makes a function an EntryPoint for these Numba types."""
    return lambda function: EntryPoint(function, result(*arguments))
