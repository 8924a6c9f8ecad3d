"""The fleet: a row a vessel, what the last run said of her, who lacks what since when, what is in quarantine."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from typing import Any

from kempf.flows.jobs.reprocess.vessel_report import FLOW
from kempf.schemas.instants import iso_utc
from kempf.schemas.quality import in_words
from kempf.warehouse.queries import views
from kempf.warehouse.queries.vessel_counts import counted, vessel_counts
from kempf.warehouse.tables import diagnoses, inbox, runs
from kempf.warehouse.tables.diagnoses import StoredDiagnosis
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.pages.page import Page

#: vessels, and files in quarantine, that a page shows
MOST, MOST_FILES = 200, 20
_OUTDATED = "her models rest on manoeuvres that count no longer"


def document(app_state: AppState) -> list[dict[str, Any]]:
    """Return what `kempf vessels list --json` prints."""
    return vessel_counts(app_state.warehouse)


def gather(app_state: AppState) -> Page:
    """Return the page of the fleet, vessels that need somebody first."""
    known = diagnoses.by_vessel(app_state.warehouse)
    messages = {run.vessel: run.message for run in runs.all_runs(app_state.warehouse, FLOW) if run.vessel is not None}
    last = {row["vessel"]: row for row in views.run_history(app_state.warehouse).rows(named=True)}
    rows = []
    for vessel in counted(app_state.warehouse):
        message, ran = messages.get(vessel.vessel, {}), last.get(vessel.vessel)
        every = known.get(vessel.vessel, [])
        rows.append(
            {
                **vessel.as_json(),
                "fitted": vessel.effects,
                "diagnosis": every[-1] if every else None,
                "since": {effect: _since(every, effect) for effect in every[-1].effects} if every else {},
                "failures": [
                    f"{failure['what']}: {failure['error']['message']}" for failure in message.get("failures", ())
                ],
                "findings": [*([_OUTDATED] if vessel.outdated else []), *_findings(message.get("findings", ()))],
                "ran_at": f"{ran['run_at']:%Y-%m-%d %H:%M}" if ran and ran["run_at"] else None,
                "ran": _address_of_run(ran["flow_run"]) if ran else None,
            }
        )
    rows.sort(key=lambda row: (-len(row["failures"]), -len(row["findings"]), row["vessel"]))
    quarantined = inbox.quarantined(app_state.warehouse)
    content = {
        "rows": rows[:MOST],
        "count": len(rows),
        "effects": sorted({effect for row in rows for effect in row["since"]}),
        "quarantined": quarantined[:MOST_FILES],
        "in_quarantine": len(quarantined),
    }
    return Page("fleet.html", "Fleet", content)


def _findings(findings: Sequence[dict[str, Any]]) -> list[str]:
    return [in_words(kind, count) for kind, count in sorted(Counter(finding["kind"] for finding in findings).items())]


def _since(every: Sequence[StoredDiagnosis], effect: str) -> str:
    """Return the day of the first manoeuvre from which on every diagnosis names an effect."""
    first = every[-1]
    for diagnosis in reversed(every):
        if effect not in diagnosis.effects:
            break
        first = diagnosis
    return iso_utc(first.start_utc_ns)[:10]


def _address_of_run(flow_run: str | None) -> str | None:
    """Return the page of a run on the Prefect server that the environment names; None where it names none."""
    server = os.environ.get("PREFECT_UI_URL") or os.environ.get("PREFECT_API_URL", "").removesuffix("/api")
    safe = server.startswith(("http://", "https://"))
    return f"{server.rstrip('/')}/runs/flow-run/{flow_run}" if safe and flow_run else None
