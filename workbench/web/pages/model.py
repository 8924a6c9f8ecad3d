"""A model beside the measurements: its errors, what they go with, the worst stretches, and every run."""

from __future__ import annotations

from typing import Any

from kempf.flows.fleet.state import fleet_state
from kempf.flows.jobs.chosen_set import chosen_set
from kempf.pipeline.predict.horizon import horizon_of
from kempf.schemas.errors import NotFound
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.data.predictions import HORIZONS, KeptPrediction, kept, key_of
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.draw.run import draw_run
from kempf.workbench.web.pages.evidence import evidence_in
from kempf.workbench.web.pages.page import Page

#: stretches shown
_MOST = 12
_SAMPLES = (("held_out", "held out"), ("fitted", "fitted"))


def document(desk: Desk, vessel: str, asked_set: str | None, asked_horizon: str | None) -> dict[str, Any] | None:
    """Return what `kempf compare --where --json` prints, where it is kept; else None."""
    made = _kept(desk, vessel, asked_set, asked_horizon)[2]
    return None if made is None else made.document


def gather(
    desk: Desk,
    vessel: str,
    asked_set: str | None,
    asked_horizon: str | None,
    asked_run: str | None = None,
    beside: str | None = None,
) -> Page:
    """Return the page of a vessel's model, one that is named or her current one, with one run drawn.

    Parameters
    ----------
    beside : str, optional
        Another set, whose prediction of the run is drawn too.

    Raises
    ------
    NotFound
        ``no_run``, ``no_parameter_set``.
    """
    set_id, horizon, made = _kept(desk, vessel, asked_set, asked_horizon)
    made_before: KeptPrediction | None = None
    content: dict[str, Any] = {
        "vessel": vessel,
        "set_id": set_id,
        "horizon": horizon,
        "horizons": HORIZONS,
        "made": None if made is None else made.document,
        "beside": None,
    }
    if beside:
        other, _, made_before = _kept(desk, vessel, beside, horizon)
        content |= {"beside": other, "before": None if made_before is None else made_before.document}
    if made is not None:
        runs = sorted(made.document["runs"], key=lambda run: (not run["held_out"], run["start"]))
        shown = _shown(runs, asked_run)
        content |= {
            "runs": runs,
            "shown": shown,
            "drawn": draw_run(
                made.columns[shown["segment_id"]], made_before.columns.get(shown["segment_id"]) if made_before else None
            ),
            "evidence": evidence_in(made.document["where"], _SAMPLES),
            "worst": _worst(made.document["where"]),
            "samples": [(key, words) for key, words in _SAMPLES if made.document["summary"][key]],
        }
    return Page("model.html", "Model beside measurement", content, ((vessel, of_vessel(vessel)),))


def _shown(runs: list[dict[str, Any]], asked: str | None) -> dict[str, Any]:
    """Return the run that is asked for, else the one that is predicted worst of those held out, of all if none is."""
    if asked is not None:
        found = [run for run in runs if run["segment_id"] == asked]
        if not found:
            raise NotFound(
                "no_run", f"{asked[:40]!r} is not among the manoeuvres compared.", "Choose one from the model's page."
            )
        return found[0]
    held = [run for run in runs if run["held_out"]] or runs
    return min(held, key=lambda run: min(run["fit_percent"].values(), default=0.0))


def _kept(
    desk: Desk, vessel: str, asked_set: str | None, asked_horizon: str | None
) -> tuple[str, str, KeptPrediction | None]:
    chosen, _ = chosen_set(desk.warehouse, vessel, asked_set or None)
    horizon = horizon_of(asked_horizon or "free").name
    state = fleet_state(desk.warehouse, [vessel])[vessel]
    return chosen.parameter_set_id, horizon, kept(desk.state, key_of(state, chosen.parameter_set_id, horizon))


def _worst(where: dict[str, Any]) -> list[dict[str, Any]]:
    return [
        {**one, "sample": words} for key, words in _SAMPLES if where[key] is not None for one in where[key]["worst"]
    ][:_MOST]
