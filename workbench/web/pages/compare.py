"""Two parameter sets: what differs, in standard errors, which of their inputs differ, and how both predict."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from kempf.flows.jobs.identify.chosen_set import named_set
from kempf.flows.jobs.identify.leg_fit import by_name
from kempf.flows.jobs.state.out_of_date import said_of_sets
from kempf.flows.jobs.state.vessel_state import fleet_state
from kempf.warehouse.tables import aliases, vessels
from kempf.warehouse.tables.parameter_set import ParameterSet
from kempf.workbench.documents.compared_sets import compared_sets
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.data.predictions import free_horizon, kept, key_of
from kempf.workbench.web.draw.differences import draw_differences
from kempf.workbench.web.pages.page import Page


def document(app_state: AppState, a: str, b: str) -> dict[str, Any]:
    """Return what `kempf params diff A B --json` prints."""
    return compared_sets(app_state.warehouse, *_both(app_state, a, b))


def gather(app_state: AppState, a: str, b: str) -> Page:
    """Return the page of two sets; without both, the form that asks for them."""
    if not (a and b):
        held = ((name, aliases.of_vessel(app_state.warehouse, name)) for name in vessels.names(app_state.warehouse))
        known = [(name, pointed[aliases.CURRENT]) for name, pointed in held if aliases.CURRENT in pointed]
        return Page("compare.html", "Compare", {"a": a, "b": b, "known": known, "made": None})
    first, second = _both(app_state, a, b)
    comparison = compared_sets(app_state.warehouse, first, second)
    same_vessel = first.vessel == second.vessel
    scaled = {} if same_vessel else comparison["nondimensional"] or {}
    rows = _rows(comparison["parameters"])
    content = {
        "a": first.parameter_set_id,
        "b": second.parameter_set_id,
        "known": [],
        "made": comparison,
        "sets": (first, second),
        "rows": rows,
        "scaled": _rows(scaled),
        "drawn": draw_differences(_rows(scaled) or rows),
        # which of them predictions do not take as they are shown here
        "by_likelihood": [each.parameter_set_id for each in (first, second) if by_name(each)],
        "stale": said_of_sets(app_state.warehouse, [first, second]),
        "inputs": list(_inputs(first, second)),
        "same_vessel": same_vessel,
        "runs": _runs(app_state, first, second) if same_vessel else None,
    }
    return Page("compare.html", "Compare", content)


def _rows(differences: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return a row a parameter, the most different first."""
    rows = [{"name": name, **row} for name, row in differences.items()]
    return sorted(rows, key=lambda row: -abs(row["in_std"]) if row["in_std"] is not None else 0.0)


def _both(app_state: AppState, a: str, b: str) -> tuple[ParameterSet, ParameterSet]:
    return named_set(app_state.warehouse, a or None), named_set(app_state.warehouse, b or None)


def _inputs(first: ParameterSet, second: ParameterSet) -> Iterator[tuple[str, Any, Any]]:
    """Name every input of the two that differs."""

    def listed(values: Any) -> str:
        return ", ".join(map(str, values)) or "none"

    def of(each: ParameterSet) -> dict[str, Any]:
        origin = each.provenance
        return {
            "vessel": each.vessel,
            "model": each.model_name,
            "effects": listed(each.model_spec.get("effects", ())),
            "estimator": each.estimator,
            "manoeuvres": listed(each.segment_ids),
            "logs": listed(name[:12] for name in each.log_ids),
            "profile": str(origin.get("profile_sha256"))[:12],
            "code": str(origin.get("code_version"))[:12],
        }

    here, there = of(first), of(second)
    yield from ((name, here[name], there[name]) for name in here if here[name] != there[name])


def _runs(app_state: AppState, first: ParameterSet, second: ParameterSet) -> dict[str, Any]:
    """Return how both predict the same manoeuvres freely, and which of the two predictions are not made yet."""
    state = fleet_state(app_state.warehouse, [first.vessel])[first.vessel]
    # both by the same kind of fit
    asked = next((horizon for horizon in map(free_horizon, (first, second)) if horizon == "legs"), None)
    horizons = {one.parameter_set_id: free_horizon(one, asked) for one in (first, second)}
    predictions = {name: kept(app_state.folder, key_of(state, name, horizon)) for name, horizon in horizons.items()}
    lacking = {name: horizons[name] for name, prediction in predictions.items() if prediction is None}
    if lacking:
        return {"lacking": lacking, "rows": []}
    here, there = (
        {run["segment_id"]: run for run in prediction.document["runs"]}
        for prediction in predictions.values()
        if prediction is not None
    )
    rows = [
        {"first": here[name], "second": there[name], "segment_id": name, "start": here[name]["start"]}
        for name in sorted(here.keys() & there.keys(), key=lambda name: str(here[name]["start"]))
    ]
    return {"lacking": {}, "rows": rows}
