"""The zigzag to sail next, as a sailing order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kempf.flows.jobs.chosen_set import chosen_set
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.pages.answer import answer
from kempf.workbench.web.pages.page import Page


def document(desk: Desk, vessel: str, asked: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf next-trial --vessel NAME --json` prints, where it was made; else None."""
    return answer(desk, "next_trial", vessel, asked).document


def gather(desk: Desk, vessel: str, asked: Mapping[str, str]) -> Page:
    """Return the page of the next trial.

    Parameters
    ----------
    asked : mapping of str to str
        ``set``, by default the current one; ``parameter``, whose interval is to be halved.
    """
    one = chosen_set(desk.warehouse, vessel, asked.get("set") or None)[0]
    found = answer(desk, "next_trial", vessel, {**asked, "set": one.parameter_set_id})
    content = {
        "vessel": vessel,
        "asked": {name: found.arguments[name] for name in ("set", "parameter")},
        "parameters": [p.name for p in one.parameters if p.std],
        "made": found.document,
        "job": found.waiting,
    }
    return Page("next_trial.html", "Next trial", content, ((vessel, of_vessel(vessel)),))
