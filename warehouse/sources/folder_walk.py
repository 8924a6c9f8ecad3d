"""What lies in a folder of this machine and below it. Every folder is entered once, whatever links lead to it."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Walk:
    """What was found; paths are below the folder, with slashes."""

    #: Of every file that is not hidden, and of those that links lead to.
    files: dict[str, os.stat_result] = field(default_factory=dict)
    #: Links that lead nowhere.
    dangling: list[str] = field(default_factory=list)
    #: Where a folder was not entered, as it had been under another path.
    not_entered: list[str] = field(default_factory=list)
    #: Files and folders whose names are no text of UTF-8, with escapes for what is none.
    misnamed: list[str] = field(default_factory=list)


def walk(root: Path) -> Walk:
    """Walk through a folder; a folder that lies in it goes before a link to it.

    Raises
    ------
    OSError
        A folder cannot be read.
    """
    found = Walk()
    entered: set[str] = set()
    links = [""]
    while links:
        here = [links.pop(0)]
        while here:
            below = here.pop()
            real = os.path.realpath(root / below)
            if real in entered:
                found.not_entered.append(below)
                continue
            entered.add(real)
            for name in sorted(entry.name for entry in Path(real).iterdir()):
                if name.startswith("."):
                    continue
                path = f"{below}/{name}" if below else name
                readable = name.encode("utf-8", "backslashreplace")
                if readable != os.fsencode(name):
                    found.misnamed.append(f"{below}/{readable.decode()}" if below else readable.decode())
                    continue
                is_link = (root / path).is_symlink()
                try:
                    status = (root / path).stat()
                except OSError as error:
                    if is_link:
                        found.dangling.append(path)
                    elif not isinstance(error, FileNotFoundError):  # else it was taken away a moment ago
                        raise
                    continue
                if stat.S_ISDIR(status.st_mode):
                    (links if is_link else here).append(path)
                elif stat.S_ISREG(status.st_mode):
                    found.files[path] = status
    return found
