"""What the file that marks a warehouse says: how it is laid out, and whether it is being brought forward."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import Any

#: Name of the file.
MARKER = "kempf-warehouse.json"
#: How this version lays a warehouse out.
LAYOUT = 4
#: Markers of this layout and later ones have a check.
_CHECKED = 3


@dataclass(frozen=True)
class Marker:
    """What the file says."""

    layout: int
    #: Layout that it is being brought forward from, as long as that is not finished; None where it is.
    migrating: int | None = None

    def written(self) -> bytes:
        """Return the content of the file.

        Versions that know of no migrations read ``layout`` and its ``check`` alone: they find a layout that is newer
        than theirs, and say so.
        """
        content: dict[str, Any] = {"layout": self.layout, "check": _check(f"layout {self.layout}")}
        if self.migrating is not None:
            text = f"layout {self.layout} from {self.migrating}"
            content["migrating"] = {"from": self.migrating, "check": _check(text)}
        return json.dumps(content).encode() + b"\n"


def read(data: bytes) -> Marker | None:
    """Return what a marker says; None where it is damaged. One of layout 2 may have no check."""
    try:
        content = json.loads(data)
        layout = int(content["layout"])
        if content.keys() == {"layout"}:  # as it once was; a bit makes a 3 of a 2
            return Marker(layout) if layout < _CHECKED or layout > LAYOUT else None
        started = content["migrating"]["from"] if "migrating" in content else None
        marker = Marker(layout, None if started is None else int(started))
        return marker if json.loads(marker.written()) == content else None
    except (ValueError, KeyError, TypeError, AttributeError):
        return None


def _check(text: str) -> str:
    """Return what shows that a number is the one that was written."""
    return hashlib.sha256(f"kempf {text}".encode()).hexdigest()[:12]
