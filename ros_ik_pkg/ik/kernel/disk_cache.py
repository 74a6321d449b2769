"""Numba's cache of compiled functions, in one folder that is named after the code's digest."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core import caching


def cache_in(folder: Path, not_saved: list[str]) -> Callable[[Callable[..., Any]], Any]:
    """Return a function that makes the cache of a compiled function; `not_saved` receives errors of saving."""

    class Locator(caching._CacheLocator):
        """Numba's own locators look at the path and the time of the one file that holds a function."""

        def __init__(self, function: Callable[..., Any]) -> None:
            self._module = function.__module__

        def get_cache_path(self) -> str:
            return str(folder)

        def get_source_stamp(self) -> str:
            return ''

        def get_disambiguator(self) -> str:
            return self._module

        @classmethod
        def from_function(cls, function: Callable[..., Any], _file: str) -> Locator:
            return cls(function)

    class Parts(caching.CompileResultCacheImpl):
        _locator_classes = [Locator]  # noqa: RUF012

    class Cache(caching.FunctionCache):
        _impl_class = Parts

        def holds(self, types: Any, codegen: Any) -> bool:
            """Return whether code for these types is there, without reading it: it is megabytes."""
            file = self._cache_file
            name = file._load_index().get(self._index_key(types, codegen))
            return name is not None and os.path.exists(file._data_path(name))

        def save_overload(self, *arguments: Any) -> None:
            """Keep code in memory if it cannot be saved; Numba would raise an error after compiling it."""
            try:
                super().save_overload(*arguments)
            except OSError as error:
                not_saved.append(str(error))

    return Cache
