"""A stretch of a manoeuvre, and what every effect would explain of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.pages.answer import answer
from kempf.workbench.web.pages.page import Page


def document(desk: Desk, vessel: str, asked: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf explain --vessel NAME --from T --to T --json` prints, where it was made; else None."""
    return answer(desk, "explain", vessel, asked).document


def gather(desk: Desk, vessel: str, asked: Mapping[str, str]) -> Page:
    """Return the page of a stretch.

    Parameters
    ----------
    asked : mapping of str to str
        ``from`` and ``to``, UTC; ``set``, by default the current one.

    Raises
    ------
    UsageError
        ``instant_unreadable``, ``window_empty``.
    """
    found = answer(desk, "explain", vessel, asked)
    effects = found.document["effects"] if found.document is not None else []
    content = {
        "vessel": vessel,
        "asked": {"from": asked.get("from", ""), "to": asked.get("to", ""), "set": found.arguments["set"]},
        "made": found.document,
        "scored": [one for one in effects if one["score"] is not None],
        "untestable": [one for one in effects if one["score"] is None],
        "job": found.waiting,
    }
    return Page("explain.html", "Explain a stretch", content, ((vessel, of_vessel(vessel)),))
