"""Files that are there whole or not at all, whenever their writer is killed, and how many of them are kept."""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Lend a file beside a path to write to, which takes its place at the end; its folder is made.

    Where writing fails, what was at the path stays, and nothing is left beside it. Several writers do not meet: the
    last one to end has written what is there.

    Raises
    ------
    OSError
        It cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "new" / "note.txt"
    ...     with whole_file(path) as passing:
    ...         written = passing.write_text("docked")
    ...     path.read_text()
    'docked'
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    passing = path.with_name(f".{secrets.token_hex(16)}.part")  # however long the name is
    try:
        yield passing
        passing.replace(path)
    finally:
        passing.unlink(missing_ok=True)


def keep_newest(folder: Path, pattern: str, most: int) -> None:
    """Delete all but the newest entries of a folder that match a pattern, files or folders.

    Parameters
    ----------
    pattern : str
        Such as ``*.html``.
    most : int
        How many stay, by the time they were written, then by name.
    """
    entries = sorted(folder.glob(pattern), key=lambda path: (path.stat().st_mtime_ns, path.name))
    for path in entries[:-most]:
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()
