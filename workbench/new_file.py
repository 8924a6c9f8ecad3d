"""Asking for a new file before long work begins, so that the work is not done for nothing."""

from __future__ import annotations

from pathlib import Path

from kempf.schemas.errors import UsageError


def require_new(path: Path, option: str) -> None:
    """Make sure that a file can be written and is not there yet.

    Parameters
    ----------
    option : str
        Option that named the file, for the message.

    Raises
    ------
    UsageError
        ``cannot_write``.
    """
    why = ""
    if path.exists() or path.is_symlink():
        why = "it is there already"
    elif not path.parent.is_dir():
        why = f"there is no folder {path.parent}"
    if why:
        raise UsageError(
            "cannot_write",
            f"Writing {path} failed: {why}.",
            f"Give another file with {option}; nothing is overwritten.",
        )
