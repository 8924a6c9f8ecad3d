"""One parameter of a set moved by a slider: the free run it gives, and what it costs in likelihood."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kempf.flows.jobs.chosen_set import chosen_set
from kempf.warehouse.parameter_set import ParameterSet
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.draw.what_if import draw_what_if
from kempf.workbench.web.pages.answer import Answer, answer
from kempf.workbench.web.pages.page import Page


def document(desk: Desk, vessel: str, asked: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf what-if PARAMETER --vessel NAME --json` prints, where it was made; else None."""
    return _asked_for(desk, vessel, asked)[1].document


def gather(desk: Desk, vessel: str, asked: Mapping[str, str]) -> Page:
    """Return the page of a parameter that is moved.

    Parameters
    ----------
    asked : mapping of str to str
        ``parameter``, ``set``, ``segment``, any of them.
    """
    one, found = _asked_for(desk, vessel, asked)
    content: dict[str, Any] = {
        "vessel": vessel,
        "asked": found.arguments,
        "parameters": [p.name for p in one.parameters],
        "segments": list(one.segment_ids),
        "made": found.document,
        "job": found.waiting,
    }
    if found.made is not None:
        made = found.made["document"]
        content |= {
            "drawn": draw_what_if(found.made["series"]),
            "middle": min(range(len(made["tried"])), key=lambda k: abs(made["tried"][k]["value"] - made["value"])),
        }
    return Page("what_if.html", "What if", content, ((vessel, of_vessel(vessel)),))


def _asked_for(desk: Desk, vessel: str, asked: Mapping[str, str]) -> tuple[ParameterSet, Answer]:
    """Return the set that is asked for, and the answer; where no parameter is, of the set's first one."""
    one = chosen_set(desk.warehouse, vessel, asked.get("set") or None)[0]
    named = {**asked, "set": one.parameter_set_id, "parameter": asked.get("parameter") or one.parameters[0].name}
    return one, answer(desk, "what_if", vessel, named)
