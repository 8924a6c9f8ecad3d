"""One parameter of a set moved by a slider: the free run it gives, and what it costs in likelihood."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kempf.flows.jobs.identify.chosen_set import chosen_set
from kempf.warehouse.tables.parameter_set import ParameterSet
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.draw.what_if import draw_what_if
from kempf.workbench.web.pages.answer import PageResult, answer
from kempf.workbench.web.pages.manoeuvre_names import names_of
from kempf.workbench.web.pages.page import Page


def document(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf what-if PARAMETER --vessel NAME --json` prints, where it was made; else None."""
    return _asked_for(app_state, vessel, fields)[1].document


def gather(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> Page:
    """Return the page of a parameter that is moved.

    Parameters
    ----------
    fields : mapping of str to str
        ``parameter``, ``set``, ``segment``, any of them.
    """
    parameter_set, reply = _asked_for(app_state, vessel, fields)
    names = names_of(app_state.warehouse, vessel)
    content: dict[str, Any] = {
        "vessel": vessel,
        "asked": reply.arguments,
        "parameters": [p.name for p in parameter_set.parameters],
        "segments": [(one, names.get(one, one)) for one in parameter_set.segment_ids],
        "made": reply.document,
        "job": reply.waiting,
    }
    if reply.made is not None:
        outcome = reply.made["document"]
        content |= {
            "name": names.get(outcome["segment_id"], outcome["segment_id"]),
            "drawn": draw_what_if(reply.made["series"]),
            "middle": min(
                range(len(outcome["tried"])), key=lambda k: abs(outcome["tried"][k]["value"] - outcome["value"])
            ),
        }
    return Page("what_if.html", "What if", content, ((vessel, of_vessel(vessel)),))


def _asked_for(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> tuple[ParameterSet, PageResult]:
    """Return the set that is asked for, and the answer; where no parameter is, of the set's first one."""
    parameter_set = chosen_set(app_state.warehouse, vessel, fields.get("set") or None)[0]
    named = {
        **fields,
        "set": parameter_set.parameter_set_id,
        "parameter": fields.get("parameter") or parameter_set.parameters[0].name,
    }
    return parameter_set, answer(app_state, "what_if", vessel, named)
