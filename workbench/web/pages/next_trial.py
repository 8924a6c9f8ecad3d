"""The zigzag to sail next, as a sailing order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kempf.flows.jobs.identify.chosen_set import chosen_set
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.pages.answer import answer
from kempf.workbench.web.pages.page import Page


def document(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf next-trial --vessel NAME --json` prints, where it was made; else None."""
    return answer(app_state, "next_trial", vessel, fields).document


def gather(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> Page:
    """Return the page of the next trial.

    Parameters
    ----------
    fields : mapping of str to str
        ``set``, by default the current one; ``parameter``, whose interval is to be halved.
    """
    parameter_set = chosen_set(app_state.warehouse, vessel, fields.get("set") or None)[0]
    reply = answer(app_state, "next_trial", vessel, {**fields, "set": parameter_set.parameter_set_id})
    content = {
        "vessel": vessel,
        "asked": {name: reply.arguments[name] for name in ("set", "parameter")},
        "parameters": [p.name for p in parameter_set.parameters if p.std],
        "made": reply.document,
        "job": reply.waiting,
    }
    return Page("next_trial.html", "Next trial", content, ((vessel, of_vessel(vessel)),))
