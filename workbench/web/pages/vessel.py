"""A vessel: her logs, manoeuvres, parameter sets, diagnoses and notes, and how her parameters went over time."""

from __future__ import annotations

from typing import Any

from kempf.flows.jobs.corrections.notes_of_hers import notes_of_hers
from kempf.flows.jobs.identify.standing_model import POOLED, WITH_EFFECTS
from kempf.flows.jobs.state.out_of_date import said_of_vessel
from kempf.warehouse.queries.standing import standing_ids
from kempf.warehouse.tables import aliases, diagnoses
from kempf.workbench.documents.logs import listed_logs
from kempf.workbench.documents.manoeuvres import listed_manoeuvres, logs_begin_alike
from kempf.workbench.documents.parameter_sets import listed_sets
from kempf.workbench.documents.vessel import vessel_document
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.pages import changes, jobs
from kempf.workbench.web.pages.page import Page

#: entries of a list that the page shows
MOST = 60


def document(app_state: AppState, vessel: str) -> dict[str, Any]:
    """Return what `kempf vessels show NAME --json` prints."""
    return vessel_document(app_state.warehouse, vessel)


def gather(app_state: AppState, vessel: str) -> Page:
    """Return the page of a vessel."""
    warehouse = app_state.warehouse
    sets = listed_sets(warehouse, vessel)
    standing = set(standing_ids(warehouse, vessel))
    manoeuvres = listed_manoeuvres(warehouse, vessel).documents
    over_time = changes.content(app_state, vessel, {}) if sets else {}
    content = {
        "vessel": vessel,
        "profile": document(app_state, vessel)["profile"],
        "lists": _newest(
            logs=listed_logs(warehouse, vessel).documents,
            manoeuvres=manoeuvres,
            sets=[{**row, "standing": row["parameter_set_id"] in standing} for row in sets],
        ),
        "diagnoses": [diagnosis.as_json() for diagnosis in diagnoses.of_vessel(warehouse, vessel)],
        "notes": [note.as_json() for note in notes_of_hers(warehouse, vessel)],
        "current": any(aliases.CURRENT in row["aliases"] for row in sets),
        "ladder": any(aliases.CURRENT in row["aliases"] and row["estimator"] in (POOLED, WITH_EFFECTS) for row in sets),
        "jobs": jobs.rows([job for job in app_state.queue.active() if job.arguments["vessel"] == vessel]),
        "stale": said_of_vessel(warehouse, vessel),
        "history": over_time.get("drawn"),
        "history_words": over_time.get("drawn_words"),
        "other_current": next(
            (
                row["parameter_set_id"]
                for row in sets
                if "current" in row["aliases"] and row["model_name"] != over_time.get("drawn_model")
            ),
            None,
        ),
        "alike": logs_begin_alike((str(one["start"]), str(one["log"])) for one in manoeuvres),
        "tested": over_time.get("tested"),
    }
    return Page("vessel.html", vessel, content)


def _newest(**lists: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return of each list the entries that are shown, the newest ones, and how many there are."""
    return {
        name: {"shown": sorted(every, key=lambda entry: str(entry["start"]))[-MOST:], "count": len(every)}
        for name, every in lists.items()
    }


def manoeuvres_document(app_state: AppState, vessel: str) -> list[dict[str, Any]]:
    """Return what `kempf segments --vessel NAME --json` prints."""
    return listed_manoeuvres(app_state.warehouse, vessel).documents


def logs_document(app_state: AppState, vessel: str) -> list[dict[str, Any]]:
    """Return what `kempf logs list --vessel NAME --json` prints."""
    return listed_logs(app_state.warehouse, vessel).documents


def sets_document(app_state: AppState, vessel: str) -> list[dict[str, Any]]:
    """Return what `kempf params list --vessel NAME --json` prints."""
    return listed_sets(app_state.warehouse, vessel)
