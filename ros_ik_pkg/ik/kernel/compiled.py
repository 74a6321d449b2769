"""The decorators for compiled functions, so that all share the same arithmetic and the same cache."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import update_wrapper
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.types import WrapperAddressProtocol, none

from ros_ik_pkg.ik.kernel.cache_folder import CACHE_FOLDER
from ros_ik_pkg.ik.kernel.garbage import collect_less
from ros_ik_pkg.ik.kernel.numba_insides import WHY_PLAIN

Function = TypeVar('Function', bound=Callable[..., Any])


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
    dispatcher: Any = _njit(function, **{'forceinline': False, **options})  # else the callers' setting applies
    if CACHE_FOLDER is not None:
        _enable_cache(dispatcher, CACHE_FOLDER)
    return dispatcher


def _enable_cache(dispatcher: Any, folder: Path) -> None:
    """Cache the code of a function in a folder, if this Numba has the usual cache interface."""
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


def variant_of(part: Any, record: type | None) -> Callable[[Function], Function]:
    """Return a decorator: its function replaces `part` in calls that pass a `record` (a named tuple), or None.

    The choice is made from the types when the caller is compiled, so other calls of `part` are not affected.
    """

    def decorate(function: Function) -> Function:
        variant: Any = _part(function, part.targetoptions['forceinline'])
        usual = part.compile

        def counts(kind: Any) -> bool:
            return kind == none if record is None else getattr(kind, 'instance_class', None) is record

        def choose(types: Any) -> Any:
            if not any(map(counts, types)):
                return usual(types)
            entry = variant.compile(types)
            part.overloads[types] = variant.overloads[types]
            return entry

        part.compile = choose  # Numba calls it for types that it has not compiled yet
        return variant

    return decorate


class FunctionAddress(WrapperAddressProtocol):
    """A compiled function as an argument of other compiled functions: Numba's first-class function."""

    def __init__(self, dispatcher: Any, signature: Any) -> None:
        result = dispatcher.get_compile_result(signature)
        self._address = result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name)
        self._signature = signature
        self._dispatcher = dispatcher  # the code lives as long as its dispatcher

    def __wrapper_address__(self) -> int:
        return self._address

    def signature(self) -> Any:
        return self._signature


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

    def as_argument(self) -> FunctionAddress:
        """Return it as an argument of other compiled functions, which call it by its address. They compile sooner than
        with a copy of all that it calls."""
        self.prepare()
        return FunctionAddress(self.compiled, self._signature)

    def is_cached(self) -> bool:
        """Return whether the cache has its code for this machine."""
        holds = getattr(self.compiled._cache, 'holds', None)  # Numba's own caches, if ours cannot be used, lack it
        return holds is not None and holds(self._signature, self.compiled.targetctx.codegen())


def entry_point(result: Any, arguments: list[Any]) -> Callable[[Callable[..., Any]], EntryPoint]:
    """Return a decorator that makes a function an EntryPoint for these Numba types."""
    return lambda function: EntryPoint(function, result(*arguments))
