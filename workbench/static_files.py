"""Scripts and styles, which the pages serve and a report holds in itself: read once, by name."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable

_TYPES = {"js": "text/javascript", "css": "text/css", "svg": "image/svg+xml"}


@cache
def contents() -> dict[str, tuple[bytes, str]]:
    """Return bytes and media type by name, which has the folder in it: ``vendor/uPlot.js``."""
    return dict(sorted(_below(files("kempf.workbench") / "static", "")))


def _below(folder: Traversable, begin: str) -> list[tuple[str, tuple[bytes, str]]]:
    entries = []
    for entry in folder.iterdir():
        if entry.is_dir():
            entries += _below(entry, f"{begin}{entry.name}/")
        elif (kind := entry.name.rpartition(".")[2]) in _TYPES:
            entries.append((begin + entry.name, (entry.read_bytes(), _TYPES[kind])))
    return entries
