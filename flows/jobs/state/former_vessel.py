"""Vessels that count no longer: renamed, or removed by a person."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass

from kempf.schemas.errors import NotFound
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels

_NAME = r"""('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"): """
_RENAMED = re.compile(f"renamed to {_NAME}")
_MOVED = re.compile(f"moved to {_NAME}")


@dataclass(frozen=True)
class FormerVessel:
    """A vessel that counts no longer."""

    vessel: str
    #: Why, as it was given; where she was removed after renamings, why she was removed.
    reason: str
    #: What she is called now; None where she was removed.
    now: str | None

    @property
    def words(self) -> str:
        """What became of her, as it follows her name in a sentence; without a full stop."""
        reason = self.reason.rstrip(".")
        became = "was removed" if self.now is None else f"was renamed to {self.now!r}"
        return f"{became}: {_RENAMED.sub('', reason)}"

    def refused(self, message: str, next_step: str) -> NotFound:
        """Return the error of something that is for her: ``vessel_renamed`` or ``vessel_removed``."""
        code = "vessel_removed" if self.now is None else "vessel_renamed"
        return NotFound(code, message, next_step, {"vessel": self.vessel, "reason": self.reason, "now": self.now})


def reason_of_rename(name: str, reason: str) -> str:
    """Return the reason that is stored of a vessel which has another name now."""
    return f"renamed to {name!r}: {reason}"


def reason_of_move(name: str, reason: str) -> str:
    """Return the reason that is stored of a log which another vessel has now."""
    return f"moved to {name!r}: {reason}"


def moved_to(reason: str) -> tuple[str, str] | None:
    """Return to which vessel a log went, and why, by the reason that is stored of it; None where it did not."""
    moved = _MOVED.match(reason)
    return None if moved is None else (ast.literal_eval(moved[1]), reason[moved.end() :])


def former_vessels(warehouse: Warehouse) -> dict[str, FormerVessel]:
    """Return the vessels that count no longer, by name; none where there is no warehouse."""
    removed = vessels.removed(warehouse)
    return {vessel: _former(removed, vessel) for vessel in removed}


def _former(removed: dict[str, str], vessel: str) -> FormerVessel:
    """Return what became of a vessel after all her renamings."""
    seen: set[str] = set()
    name = last = vessel
    while name in removed and name not in seen:
        seen.add(name)
        last = name
        renamed = _RENAMED.match(removed[name])
        if renamed is None:
            break
        name = ast.literal_eval(renamed[1])
    if name in removed:
        return FormerVessel(vessel, removed[last], None)
    return FormerVessel(vessel, removed[vessel], name)
