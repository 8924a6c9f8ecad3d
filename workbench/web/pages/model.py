"""A model beside the measurements: its errors, what they go with, the worst stretches, and every run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from kempf.pipeline.compare.evidence import SAMPLES, Evidence, evidence_in
from kempf.schemas.errors import NotFound
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.data.predictions import HORIZONS, KeptPrediction, kept_of
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.draw.run import draw_run
from kempf.workbench.web.draw.strip import Strips, draw_strips
from kempf.workbench.web.pages.page import Page

#: stretches shown, and manoeuvres with a strip of what is left
_MOST, _MOST_STRIPS = 12, 16
#: of the strips where no evidence is chosen
_CHANNEL = "yaw_rate"


def document(desk: Desk, vessel: str, asked: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf compare --where --json` prints, where it is kept; else None."""
    made = kept_of(desk.warehouse, desk.state, vessel, asked.get("set"), asked.get("h"))[2]
    return None if made is None else made.document


def gather(desk: Desk, vessel: str, asked: Mapping[str, str]) -> Page:
    """Return the page of a vessel's model, one that is named or her current one, with one run drawn.

    Parameters
    ----------
    asked : mapping
        ``set``; ``h``, the horizon; ``run``, the manoeuvre drawn; ``beside``, another set whose prediction of it is
        drawn too; ``mark``, evidence whose instants are shaded, see `kempf.pipeline.compare.evidence.Evidence.key`.

    Raises
    ------
    NotFound
        ``no_run``, ``no_parameter_set``, ``no_evidence``.
    """
    set_id, horizon, made = kept_of(desk.warehouse, desk.state, vessel, asked.get("set"), asked.get("h"))
    made_before: KeptPrediction | None = None
    content: dict[str, Any] = {
        "vessel": vessel,
        "set_id": set_id,
        "horizon": horizon,
        "horizons": HORIZONS,
        "made": None if made is None else made.document,
        "beside": None,
    }
    if beside := asked.get("beside"):
        other, _, made_before = kept_of(desk.warehouse, desk.state, vessel, beside, horizon)
        content |= {"beside": other, "before": None if made_before is None else made_before.document}
    if made is not None:
        runs = sorted(made.document["runs"], key=lambda run: (not run["held_out"], run["start"]))
        evidence = evidence_in(made.document["where"])
        mark = _marked(evidence, asked.get("mark"))
        shown = _shown(runs, made, mark, asked.get("run"))
        before = made_before.columns.get(shown["segment_id"]) if made_before else None
        content |= {
            "runs": runs,
            "shown": shown,
            "drawn": draw_run(
                made.columns[shown["segment_id"]], before, made.marked(shown["segment_id"], mark.key if mark else None)
            ),
            "strips": _strips(made, runs, mark),
            "channel": mark.channel if mark else _CHANNEL,
            "evidence": evidence,
            "showing": {one.key for one in evidence if made.shows(one.key)},
            "mark": mark,
            "worst": [
                {**one, "address": stretch_address(one, set_id, horizon, k + 1)}
                for k, one in enumerate(worst_stretches(made.document["where"]))
            ],
            "samples": [(key, words) for key, words in SAMPLES if made.document["summary"][key]],
        }
    return Page("model.html", "Model beside measurement", content, ((vessel, of_vessel(vessel)),))


def _marked(evidence: list[Evidence], asked: str | None) -> Evidence | None:
    found = next((one for one in evidence if one.key == asked), None)
    if asked and found is None:
        raise NotFound(
            "no_evidence",
            f"{asked[:80]!r} is nothing that speaks against this model.",
            "Choose one from the model's page: with another set or horizon it may be gone.",
        )
    return found


def _strips(made: KeptPrediction, runs: list[dict[str, Any]], mark: Evidence | None) -> Strips | None:
    names = [run["segment_id"] for run in runs[:_MOST_STRIPS]]
    marked = {name: made.marked(name, mark.key) for name in names} if mark else {}
    return draw_strips({name: made.columns[name] for name in names}, mark.channel if mark else _CHANNEL, marked)


def _shown(
    runs: list[dict[str, Any]], made: KeptPrediction, mark: Evidence | None, asked: str | None
) -> dict[str, Any]:
    """Return the run that is asked for, else the one that shows most of the evidence.

    Without evidence it is the one that is predicted worst of those held out, of all if none is.
    """
    if asked is not None:
        found = [run for run in runs if run["segment_id"] == asked]
        if not found:
            raise NotFound(
                "no_run", f"{asked[:40]!r} is not among the manoeuvres compared.", "Choose one from the model's page."
            )
        return found[0]
    if mark is not None:
        marked = {run["segment_id"]: made.marked(run["segment_id"], mark.key) for run in runs}
        return max(runs, key=lambda run: 0 if (at := marked[run["segment_id"]]) is None else np.count_nonzero(at))
    held = [run for run in runs if run["held_out"]] or runs
    return min(held, key=lambda run: min(run["fit_percent"].values(), default=0.0))


def worst_stretches(where: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the stretches that a model predicts worst, those held out first."""
    return [
        {**one, "sample": words} for key, words in SAMPLES if where[key] is not None for one in where[key]["worst"]
    ][:_MOST]


def stretch_address(one: Mapping[str, Any], set_id: str, horizon: str, number: int) -> str:
    """Return the address of one of the worst stretches, counted from 1."""
    window = f"from={one['start']}&to={one['end']}"
    return f"/segments/{one['run']}?{window}&set={set_id}&h={horizon}&worst={number}"
