"""Vessels that count no longer: renamed, or removed by a person."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass

from kempf.schemas.errors import NotFound
from kempf.warehouse import vessels
from kempf.warehouse.store import Warehouse

_NAME = r"""('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"): """
_RENAMED = re.compile(f"renamed to {_NAME}")
_MOVED = re.compile(f"moved to {_NAME}")


@dataclass(frozen=True)
class FormerVessel:
    """A vessel that counts no longer."""

    vessel: str
    #: Why, as it was given.
    reason: str
    #: What she is called now; None where she was removed.
    now: str | None

    @property
    def words(self) -> str:
        """What became of her, as it follows her name in a sentence; without a full stop."""
        reason = self.reason.rstrip(".")
        return (
            f"was removed: {reason}" if self.now is None else f"was renamed to {self.now!r}: {_RENAMED.sub('', reason)}"
        )

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
    return {vessel: FormerVessel(vessel, reason, _now(removed, vessel)) for vessel, reason in removed.items()}


def _now(removed: dict[str, str], vessel: str) -> str | None:
    """Return the name that a vessel has after all her renamings; None where in the end she was removed."""
    seen: set[str] = set()
    while vessel in removed and vessel not in seen:
        seen.add(vessel)
        renamed = _RENAMED.match(removed[vessel])
        if renamed is None:
            return None
        vessel = ast.literal_eval(renamed[1])
    return None if vessel in seen else vessel
