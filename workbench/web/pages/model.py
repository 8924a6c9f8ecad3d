"""A model beside the measurements: its errors, what they go with, the worst stretches, and every run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from kempf.flows.jobs.state.out_of_date import said_of_vessel
from kempf.pipeline.compare.evidence import SAMPLES, Evidence, evidence_in
from kempf.schemas.enumeration import as_words
from kempf.schemas.errors import NotFound
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.data.predictions import HORIZONS, KeptPrediction, kept_of
from kempf.workbench.web.draw.run import draw_run
from kempf.workbench.web.draw.strip import Strips, draw_strips
from kempf.workbench.web.pages.manoeuvre_names import names_of
from kempf.workbench.web.pages.page import Page

#: stretches shown, and manoeuvres with a strip of what is left
_MOST, _MOST_STRIPS = 12, 16
#: of the strips where no evidence is chosen
_CHANNEL = "yaw_rate"


def document(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf compare --where --json` prints, where it is kept; else None."""
    prediction = kept_of(app_state.warehouse, app_state.folder, vessel, fields.get("set"), fields.get("h")).prediction
    return None if prediction is None else prediction.document


def gather(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> Page:
    """Return the page of a vessel's model, one that is named or her current one, with one run drawn.

    Parameters
    ----------
    fields : mapping
        ``set``; ``h``, the horizon; ``run``, the manoeuvre drawn; ``beside``, another set whose prediction of it is
        drawn too; ``mark``, evidence whose instants are shaded, see `kempf.pipeline.compare.evidence.Evidence.key`.

    Raises
    ------
    NotFound
        ``no_run``, ``no_parameter_set``, ``no_evidence``.
    """
    set_id, horizon, prediction, by_legs = kept_of(
        app_state.warehouse, app_state.folder, vessel, fields.get("set"), fields.get("h")
    )
    prediction_before: KeptPrediction | None = None
    content: dict[str, Any] = {
        "vessel": vessel,
        "stale": said_of_vessel(app_state.warehouse, vessel),
        "set_id": set_id,
        "horizon": horizon,
        "horizons": [pair for pair in HORIZONS if pair[0] != "legs" or by_legs],
        "made": None if prediction is None else prediction.document,
        "beside": None,
    }
    if beside := fields.get("beside"):
        other_id, _, prediction_before, _ = kept_of(app_state.warehouse, app_state.folder, vessel, beside, horizon)
        content |= {"beside": other_id, "before": None if prediction_before is None else prediction_before.document}
    if prediction is not None:
        runs = sorted(prediction.document["runs"], key=lambda run: (not run["held_out"], run["start"]))
        evidence = evidence_in(prediction.document["where"])
        mark = _marked(evidence, fields.get("mark"))
        shown = _shown(runs, prediction, mark, fields.get("run"))
        before = prediction_before.columns.get(shown["segment_id"]) if prediction_before else None
        summaries = [prediction.document["summary"][key] for key, _ in SAMPLES if prediction.document["summary"][key]]
        units = {channel: one["unit"] for summary in summaries for channel, one in summary["rms_display"].items()}
        content |= {
            "names": names_of(app_state.warehouse, vessel),
            "short": names_of(app_state.warehouse, vessel, when=False),
            "rms_channels": list(units),
            "rms_units": [(as_words(channel), unit) for channel, unit in units.items()],
            "runs": runs,
            "shown": shown,
            "drawn": draw_run(
                prediction.columns[shown["segment_id"]],
                before,
                prediction.marked(shown["segment_id"], mark.key if mark else None),
            ),
            "strips": _strips(prediction, runs, mark),
            "channel": mark.channel if mark else _CHANNEL,
            "evidence": evidence,
            "showing": {piece.key for piece in evidence if prediction.shows(piece.key)},
            "mark": mark,
            "worst": [
                {**stretch, "address": stretch_address(stretch, set_id, horizon, k + 1)}
                for k, stretch in enumerate(worst_stretches(prediction.document["where"]))
            ],
            "samples": [(key, words) for key, words in SAMPLES if prediction.document["summary"][key]],
        }
    return Page("model.html", "Model beside measurement", content, ((vessel, of_vessel(vessel)),))


def _marked(evidence: list[Evidence], key: str | None) -> Evidence | None:
    mark = next((piece for piece in evidence if piece.key == key), None)
    if key and mark is None:
        raise NotFound(
            "no_evidence",
            f"{key[:80]!r} is nothing that speaks against this model.",
            "Choose one from the model's page: with another set or horizon it may be gone.",
        )
    return mark


def _strips(prediction: KeptPrediction, runs: list[dict[str, Any]], mark: Evidence | None) -> Strips | None:
    names = [run["segment_id"] for run in runs[:_MOST_STRIPS]]
    marked = {name: prediction.marked(name, mark.key) for name in names} if mark else {}
    return draw_strips({name: prediction.columns[name] for name in names}, mark.channel if mark else _CHANNEL, marked)


def _shown(
    runs: list[dict[str, Any]], prediction: KeptPrediction, mark: Evidence | None, segment_id: str | None
) -> dict[str, Any]:
    """Return the run that is asked for, else the one that shows most of the evidence.

    Without evidence it is the one that is predicted worst of those held out, of all if none is.
    """
    if segment_id is not None:
        matches = [run for run in runs if run["segment_id"] == segment_id]
        if not matches:
            raise NotFound(
                "no_run",
                f"{segment_id[:40]!r} is not among the manoeuvres compared.",
                "Choose one from the model's page.",
            )
        return matches[0]
    if mark is not None:
        marked = {run["segment_id"]: prediction.marked(run["segment_id"], mark.key) for run in runs}
        return max(runs, key=lambda run: 0 if (at := marked[run["segment_id"]]) is None else np.count_nonzero(at))
    held = [run for run in runs if run["held_out"]] or runs
    return min(held, key=lambda run: min(run["fit_percent"].values(), default=0.0))


def worst_stretches(where: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the stretches that a model predicts worst, those held out first."""
    return [
        {**stretch, "sample": words}
        for key, words in SAMPLES
        if where[key] is not None
        for stretch in where[key]["worst"]
    ][:_MOST]


def stretch_address(stretch: Mapping[str, Any], set_id: str, horizon: str, number: int) -> str:
    """Return the address of one of the worst stretches, counted from 1."""
    window = f"from={stretch['start']}&to={stretch['end']}"
    return f"/segments/{stretch['run']}?{window}&set={set_id}&h={horizon}&worst={number}"
