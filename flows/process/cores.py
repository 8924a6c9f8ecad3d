"""How many cores this process may use, which on a shared machine are fewer than the machine has."""

from __future__ import annotations

import os


def usable() -> int:
    """Return the number of cores that this process may run on, at least one.

    Examples
    --------
    >>> 1 <= usable() <= (os.cpu_count() or 1)
    True
    """
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0)) or 1
    return os.cpu_count() or 1
