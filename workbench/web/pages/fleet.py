"""The fleet: a row a vessel."""

from __future__ import annotations

from typing import Any

from kempf.warehouse import diagnoses, inbox, runs
from kempf.warehouse.vessel_counts import vessel_counts
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.pages.page import Page

FLOW = "reprocess"
#: vessels that a page shows
MOST = 200


def document(desk: Desk) -> list[dict[str, Any]]:
    """Return what `kempf vessels list --json` prints."""
    return vessel_counts(desk.warehouse)


def gather(desk: Desk) -> Page:
    """Return the page of the fleet, vessels that need somebody first."""
    newest = diagnoses.newest(desk.warehouse)
    findings: dict[str, int] = {}
    failures: dict[str, int] = {}
    for run in runs.all_runs(desk.warehouse, FLOW):
        if run.vessel is not None:
            findings[run.vessel] = len(run.message.get("findings", ()))
            failures[run.vessel] = len(run.message.get("failures", ()))
    rows = [
        {
            **row,
            "diagnosis": newest.get(row["vessel"]),
            "findings": findings.get(row["vessel"], 0),
            "failures": failures.get(row["vessel"], 0),
        }
        for row in document(desk)
    ]
    rows.sort(key=lambda row: (-row["failures"], -row["findings"], row["vessel"]))
    lacking = sorted({effect for one in newest.values() for effect in one.effects})
    content = {
        "rows": rows[:MOST],
        "count": len(rows),
        "effects": lacking,
        "quarantined": len(inbox.quarantined(desk.warehouse)),
    }
    return Page("fleet.html", "Fleet", content)
