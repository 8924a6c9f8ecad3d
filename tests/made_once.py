"""Folders that several processes of a test run need and that cost too much to be made in each."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable
from pathlib import Path

import pytest


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], None]) -> Path:
    """Return a folder that the first process to ask for it makes, while the others wait.

    Parameters
    ----------
    make : callable
        Fills the folder that it is given, which is not there yet. Whoever is handed the folder only reads it.
    """
    root = factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        root = root.parent  # each process has a folder of its own in that of the run
    place = root / name
    with (root / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # let go when the file is closed, also by a process that dies
        if not place.exists():
            part = root / f"{name}.part"
            make(part)
            part.rename(place)
    return place
