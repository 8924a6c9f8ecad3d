"""The ladder of a vessel: the models that lead to her current one, and how the error fell."""

from __future__ import annotations

from typing import Any

from kempf.flows.jobs.out_of_date import said_of_vessel
from kempf.workbench.documents.ladder import ladder_document
from kempf.workbench.rungs import compared, remarks
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.draw.ladder import draw_ladder
from kempf.workbench.web.pages.page import Page


def document(desk: Desk, vessel: str) -> list[dict[str, Any]]:
    """Return what `kempf ladder --vessel NAME --json` prints."""
    return ladder_document(desk.warehouse, vessel)


def gather(desk: Desk, vessel: str) -> Page:
    """Return the page of a vessel's ladder."""
    rungs = document(desk, vessel)
    beside = compared(rungs)
    content = {
        "vessel": vessel,
        "stale": said_of_vessel(desk.warehouse, vessel),
        "rungs": list(zip(rungs, beside, strict=True)),
        "drawn": draw_ladder(rungs),
        "remarks": remarks(beside),
    }
    return Page("ladder.html", "Ladder", content, ((vessel, of_vessel(vessel)),))
