"""The decorators for compiled functions, so that all share the same arithmetic and the same cache.

Numba looks only at the file of a function to tell whether its cached code is still right, but code of this package
is inlined across files. So the cache lives in a folder named after all sources of `ros_ik_pkg.ik` together: any
change makes a new one, and an installation that cannot be written to is cached too.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

Function = TypeVar('Function', bound=Callable[..., Any])


def cache_folder() -> Path | None:
    """Return the folder for compiled code, None where nothing can be written: then it lives in memory only.

    It is below $NUMBA_CACHE_DIR, else $XDG_CACHE_HOME, else ~/.cache.
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.glob('*.py')):
        digest.update(path.read_bytes())
    root = os.environ.get('NUMBA_CACHE_DIR') or os.environ.get('XDG_CACHE_HOME') or '~/.cache'
    try:
        folder = Path(root).expanduser() / 'ros_ik_pkg' / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(bytes(4096))
    except (OSError, RuntimeError):
        return None
    return folder


CACHE_FOLDER = cache_folder()
NOT_SAVED: list[str] = []  # why compiled code could not be saved


def _decorator(forceinline: bool = False, **options: Any) -> Callable[[Function], Function]:
    """Return njit with the options that all compiled functions share."""

    def decorate(function: Function) -> Function:
        # Numba reads the setting at this moment; others' functions keep theirs.
        others, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(CACHE_FOLDER or '')
        try:
            dispatcher = numba.njit(
                cache=CACHE_FOLDER is not None,
                error_model='numpy',  # x / 0 is inf or NaN, which the loop detects, not a branch and a raise
                nogil=True,  # batches run on threads
                fastmath={'contract'},  # a * b + c may become one instruction; nothing is reordered
                forceinline=forceinline,  # said in any case: else Numba takes it from the caller
                **options,
            )(function)
            _forgive_full_disk(dispatcher)
            return dispatcher
        finally:
            numba.config.CACHE_DIR = others

    return decorate


def _forgive_full_disk(dispatcher: Any) -> None:
    """Let code that cannot be saved live in memory; Numba itself would end the program, after all the work."""
    save = dispatcher._cache.save_overload

    def save_if_possible(*arguments: Any) -> None:
        try:
            save(*arguments)
        except OSError as error:
            NOT_SAVED.append(str(error))

    dispatcher._cache.save_overload = save_if_possible


# What callers enter by: may allocate.
compiled = _decorator()

# Inside the loop: no reference counts (atomic instructions, dearer than the arithmetic) and so no allocation
# either, which Numba then refuses to compile.
kernel = _decorator(_nrt=False)

# Small kernels that return tuples: inlined, so that the numbers stay in registers.
inlined = _decorator(forceinline=True, _nrt=False)


def door(result: Any, arguments: list[Any]) -> Callable[[Function], Function]:
    """Return a decorator as `compiled`, for these types alone: it compiles for no others, but raises TypeError.

    The types are compiled at the first call, not at import. Whoever calls need not look at what Numba looks at anyway.
    """

    def decorate(function: Function) -> Function:
        dispatcher: Any = compiled(function)
        once = threading.Lock()

        def compile_once(*_: Any) -> Any:
            with once:
                if not dispatcher.signatures:
                    dispatcher.compile(result(*arguments))
                    dispatcher.disable_compile()
            return dispatcher

        dispatcher._compile_for_args = compile_once  # Numba asks it what to call where it has nothing for the arguments
        return dispatcher

    return decorate
