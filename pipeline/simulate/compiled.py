"""The decorator of the compiled kernels: numba without fast mathematics, so that results are the same bit for bit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def compiled(function: Kernel) -> Kernel:
    """Return ``function`` compiled on its first call and kept on disk; the types of its signature stay."""
    return cast(Kernel, njit(cache=True, fastmath=False, error_model="python")(function))
