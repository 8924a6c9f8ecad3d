"""The ladder of a vessel: the models that lead to her current one, and how the error fell."""

from __future__ import annotations

from typing import Any

from kempf.flows.jobs.state.out_of_date import said_of_vessel
from kempf.workbench.documents.ladder import ladder_document
from kempf.workbench.rungs import compared, remarks
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.draw.ladder import draw_ladder
from kempf.workbench.web.pages.page import Page


def document(app_state: AppState, vessel: str) -> list[dict[str, Any]]:
    """Return what `kempf ladder --vessel NAME --json` prints."""
    return ladder_document(app_state.warehouse, vessel)


def gather(app_state: AppState, vessel: str) -> Page:
    """Return the page of a vessel's ladder."""
    rungs = document(app_state, vessel)
    beside = compared(rungs)
    content = {
        "vessel": vessel,
        "stale": said_of_vessel(app_state.warehouse, vessel),
        "rungs": list(zip(rungs, beside, strict=True)),
        "drawn": draw_ladder(rungs),
        "remarks": remarks(beside),
    }
    return Page("ladder.html", "Ladder", content, ((vessel, of_vessel(vessel)),))
