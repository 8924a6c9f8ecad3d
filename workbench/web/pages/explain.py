"""A stretch of a manoeuvre, and what every effect would explain of it."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Any

from kempf.schemas.effects import catalogue
from kempf.warehouse.tables import vessels
from kempf.workbench.rungs import sized
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.pages.answer import answer
from kempf.workbench.web.pages.page import Page


def document(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf explain --vessel NAME --from T --to T --json` prints, where it was made; else None."""
    return answer(app_state, "explain", vessel, fields).document


def gather(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> Page:
    """Return the page of a stretch.

    Parameters
    ----------
    fields : mapping of str to str
        ``from`` and ``to``, UTC; ``set``, by default the current one; ``segment``, the manoeuvre, where logs share
        their instants.

    Raises
    ------
    UsageError
        ``instant_unreadable``, ``window_empty``.
    """
    reply = answer(app_state, "explain", vessel, fields)
    effects = reply.document["effects"] if reply.document is not None else []
    length_m = vessels.profiles(app_state.warehouse)[vessel].length_m
    content = {
        "vessel": vessel,
        "asked": {
            **{name: fields.get(name, "") for name in ("from", "to", "segment")},
            "set": reply.arguments["set"],
        },
        "made": reply.document,
        "scored": [effect for effect in effects if effect["score"] is not None],
        "sizes": {effect["effect"]: sizes_of(effect, length_m) for effect in effects},
        "untestable": [effect for effect in effects if effect["score"] is None],
        "job": reply.waiting,
    }
    return Page("explain.html", "Explain a stretch", content, ((vessel, of_vessel(vessel)),))


def sizes_of(effect: Mapping[str, Any], length_m: float | None) -> str:
    """Return the sizes that a stretch gives an effect, those marked that no ship has; what was held has no error.

    Parameters
    ----------
    length_m : float or None
        Of the ship, beyond which nothing on board of her is; None where it is not known.
    """
    known = catalogue().get(effect["effect"])
    bounds = {p.name: (p.low, p.high) for p in known.parameters} if known is not None else {}
    sizes = []
    for name, size in effect["size"].items():
        if size["unit"] == "m" and length_m is not None:
            bounds[name] = (-length_m, length_m)
        words = sized(name, size["value"], size["std"], size["unit"])
        if size["std"] is None:
            words = words.replace(" ± -", "") + " (held)"
        low, high = bounds.get(name, (-inf, inf))
        sizes.append(words if low <= size["value"] <= high else f"{words} (beyond what is physical)")
    return ", ".join(sizes)
