"""Memory that was freed, given back to the machine between the stages of a long job.

Allocators keep what is freed for the next request. A stage that works on millions of values leaves holes in which the
arrays of the next one find no room, so that the process would grow to the sum of its stages and not to the largest.
"""

from __future__ import annotations

import ctypes
from functools import cache

#: Records of a log of some parts.
_LONG = 1 << 17


def give_back(records: int) -> None:
    """Give back what the allocators of C and of Arrow keep and do not use; nothing where they cannot.

    Parameters
    ----------
    records : int
        Of the log that is worked on; what a short one leaves is not worth the asking, which takes some 10 ms.
    """
    if records < _LONG:
        return
    import pyarrow as pa

    pa.default_memory_pool().release_unused()
    trim = _trim()
    if trim is not None:
        trim(0)


@cache
def _trim() -> ctypes._NamedFuncPointer | None:
    """Return `malloc_trim` of the GNU C library, None on other systems."""
    try:
        return ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):  # another C library; on Windows None names none
        return None
