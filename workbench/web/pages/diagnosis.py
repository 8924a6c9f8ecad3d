"""A diagnosis: its verdict in sentences, the effects ranked, and how the error fell."""

from __future__ import annotations

from typing import Any

from kempf.flows.jobs.identify.standing_model import current_effects
from kempf.schemas.errors import NotFound
from kempf.warehouse.tables import aliases, diagnoses
from kempf.workbench.rungs import first_model
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.draw.ladder import draw_ladder
from kempf.workbench.web.pages.page import Page


def document(app_state: AppState, diagnosis_id: str) -> dict[str, Any]:
    """Return what `kempf diagnose --json` printed when it made the diagnosis.

    Raises
    ------
    NotFound
        ``no_diagnosis``.
    """
    diagnosis = diagnoses.find(app_state.warehouse, diagnosis_id)
    if diagnosis is None:
        raise NotFound(
            "no_diagnosis",
            f"No diagnosis has the id {diagnosis_id[:40]!r}.",
            "A vessel's page lists her diagnoses, and makes one.",
        )
    return diagnosis.as_json()


def gather(app_state: AppState, diagnosis_id: str) -> Page:
    """Return the page of a diagnosis."""
    diagnosis = document(app_state, diagnosis_id)
    vessel = diagnosis["vessel"]
    has = current_effects(app_state.warehouse, vessel).get(vessel, ())
    ranked = sorted(diagnosis["candidates"], key=lambda c: (c["score"] is None, -(c["score"] or 0.0)))
    content = {
        "one": diagnosis,
        "ranked": [c for c in ranked if c["score"] is not None],
        "untestable": [c for c in ranked if c["score"] is None],
        "first_model": first_model(diagnosis["ladder"][0]),
        "ladder": draw_ladder(diagnosis["ladder"]),
        "standing": aliases.of_vessel(app_state.warehouse, vessel).get(aliases.CURRENT, ""),
        # what her current model has of each set by now
        "sets": [(found, [effect for effect in found["effects"] if effect in has]) for found in diagnosis["sets"]],
    }
    return Page("diagnosis.html", "Diagnosis", content, ((vessel, of_vessel(vessel)),))
