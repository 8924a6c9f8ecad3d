"""The decorator of the compiled kernels, which are compiled anew whenever anything that went into them has changed.

numba keeps compiled functions on disk and compares the date of their own source file. What they call from other files
is compiled into them: changed there only, the old code would go on running under the new version's name.
"""

from __future__ import annotations

import hashlib
import inspect
import sys
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numba
import numpy as np
from numba.core import caching, config
from numba.core.dispatcher import Dispatcher
from numba.core.extending import _Intrinsic

__all__ = ["FILLING", "STEP", "njit"]

#: for a function that fills arrays and makes none: counting references to them would take longer than its arithmetic
FILLING: dict[str, Any] = {
    **{"cache": True, "nogil": True, "error_model": "numpy", "_nrt": False},
    "fastmath": {"contract"},
}
#: for what runs at every instant: put into its caller, too
STEP: dict[str, Any] = {**FILLING, "forceinline": True}
_OPTIONS = inspect.getsource(sys.modules[__name__]).encode()


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return numba's decorator with every option of the arithmetic decided here.

    Left open, a function takes them from whichever caller is compiled first: its last bits would go with what a
    process happened to do before.
    """
    decided = {"fastmath": False, "error_model": "python"}
    decorator: Callable[[Callable[..., Any]], Any] = numba.njit(**{**decided, **options})
    return decorator


def _went_in(function: Any) -> str:
    """Return a digest of the functions that a function calls, of the constants that it and they use, and of this file.

    Options named here do not stand in the source of a function that takes them.
    """
    digest = hashlib.sha256(_OPTIONS)
    for part in _parts(function, {function}):
        digest.update(part)
    return digest.hexdigest()


def _parts(function: Any, seen: set[Any]) -> Iterator[bytes]:
    for name in sorted(set(function.__code__.co_names)):
        value = function.__globals__.get(name)
        called = value.py_func if isinstance(value, Dispatcher) else None
        if called is not None and called not in seen:
            seen.add(called)
            yield _source(called)
            yield from _parts(called, seen)
        elif isinstance(value, _Intrinsic):
            if value not in seen:
                seen.add(value)
                # what it emits is made by other functions and constants there, too
                there = sys.modules[value._defn.__module__]
                yield _source(there)
                numbers = {
                    name: constant
                    for name, constant in vars(there).items()
                    if isinstance(constant, int | float | tuple)
                }
                yield repr(sorted(numbers.items())).encode()
        elif isinstance(value, np.ndarray):
            yield name.encode() + value.tobytes()
        elif isinstance(value, bool | int | float | str | tuple):
            yield f"{name}={value!r}".encode()


@cache
def _source(definition: Any) -> bytes:
    """Return the source of a function or module, found once: it goes into each of its callers."""
    return inspect.getsource(definition).encode()


class _Whole:
    """The stamp of a compiled function: that of its source file, and what went in from elsewhere."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        super().__init__(py_func, py_file)  # type: ignore[call-arg]
        self._py_func = py_func

    def get_source_stamp(self) -> Any:
        return super().get_source_stamp(), _went_in(self._py_func)  # type: ignore[misc]


class Given(_Whole, caching.UserProvidedCacheLocator):  # type: ignore[misc, unused-ignore]
    """In the folder of NUMBA_CACHE_DIR."""


class Beside(_Whole, caching.InTreeCacheLocator):  # type: ignore[misc, unused-ignore]
    """Beside the source."""


class OfTheUser(_Whole, caching.UserWideCacheLocator):  # type: ignore[misc, unused-ignore]
    """In the user's own folder, where the source's may not be written to."""


config.CACHE_LOCATOR_CLASSES = ",".join(  # type: ignore[attr-defined, unused-ignore]
    [f"{__name__}.{place.__name__}" for place in (Given, Beside, OfTheUser)]
    + ["IPythonCacheLocator", "ZipCacheLocator"]
)
