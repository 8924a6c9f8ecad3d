"""Models of a vessel brought forward by further manoeuvres, at the cost of these (decision 0061).

All manoeuvres are fitted at once while they are few, and again when half as many have come since: what is known of a
hull from few is no parabola, and what is made only where all are fitted (lasting noise, what is held out, legs) grows
old. In between each set brings the one before it forward and is stored with what it adds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kempf.flows.jobs.identify.chosen_manoeuvres import Chosen
from kempf.flows.jobs.identify.errors_of_fit import errors_of
from kempf.flows.jobs.identify.leg_fit import fitted_to_legs
from kempf.flows.jobs.identify.parameter_set_of import SetRequest
from kempf.flows.jobs.identify.standing_model import SEARCH, Own, goes_by_load, inputs_of, known_effects, stored_model
from kempf.flows.jobs.identify.vessel_model import POSTERIOR, as_set, pooling, store_model
from kempf.flows.jobs.identify.vessel_runs import Like, VesselRuns, assemble, assembled
from kempf.flows.jobs.state.out_of_date import command_for
from kempf.flows.process.cores import usable
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.diagnose.steps.ladder_step import rung, step_of
from kempf.pipeline.estimate.maximum_likelihood import settings_of
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.posterior import from_json, posterior_of
from kempf.pipeline.estimate.updated import Updated, updated
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.predict.free_run import free_run_of
from kempf.schemas.effect import Effect
from kempf.schemas.errors import DataRejected, NotFound
from kempf.schemas.instrument_noise import lasting_noise
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets, provenance, vessels
from kempf.warehouse.tables.parameter_set import UPDATES, Inputs, ParameterSet, Update, brought_forward

#: fewer manoeuvres are all fitted at once, and so are they when they have become so many times as many
FEWEST, GROWN = 16, 1.5


@dataclass(frozen=True)
class BroughtForward:
    """A model and the ones on the way to it, brought forward."""

    #: Those that are not stored yet, as they are to be stored.
    new: tuple[ParameterSet, ...]
    #: The model, whole.
    model: ParameterSet


def store_up_to_date(
    warehouse: Warehouse,
    chosen: Chosen,
    spec: ModelSpec,
    own: Own,
    progress: Progress = silent,
    flow_run: str | None = None,
    search: Mapping[str, Any] | None = None,
    keep: Callable[[Sequence[ParameterSet]], None] | None = None,
) -> tuple[ParameterSet, bool]:
    """Store a model of all manoeuvres, brought forward where that will do, else fitted to all of them at once.

    Parameters and results are those of `flows.jobs.identify.vessel_model.store_model`.
    """
    stored = stored_model(warehouse, chosen, spec, own, search)
    if stored is not None:
        return stored, False
    brought = bring_forward(warehouse, chosen, spec, own, progress, flow_run, search)
    if brought is None:
        return store_model(warehouse, chosen, spec, own, progress, flow_run, search=search, keep=keep)
    if keep is None:
        parameter_sets.insert(warehouse, brought.new)
    else:
        keep(brought.new)
    return brought.model, bool(brought.new)


def bring_forward(
    warehouse: Warehouse,
    chosen: Chosen,
    spec: ModelSpec,
    own: Own,
    progress: Progress = silent,
    flow_run: str | None = None,
    search: Mapping[str, Any] | None = None,
) -> BroughtForward | None:
    """Bring a stored model, and every one on the way to it, forward by the manoeuvres that it does not rest on yet.

    Parameters
    ----------
    chosen : Chosen
        All manoeuvres.
    search : mapping, optional
        Settings of the search of single runs that differ from the defaults.

    Returns
    -------
    BroughtForward or None
        None where all manoeuvres are to be fitted at once.
    """
    if goes_by_load(spec, own):
        # how a log is laden counts from the first of all
        return None
    new: list[ParameterSet] = []
    parent: str | None = None
    before: ParameterSet | None = None
    for k in range(len(spec.effects) + 1):
        model = spec.model_copy(update={"effects": spec.effects[:k]})
        full_inputs = inputs_of(chosen, model, own, search)
        before = _stored_before(warehouse, chosen, model, full_inputs)
        if before is None:
            return None
        if len(before.segment_ids) < len(chosen.segments):
            fewer = _further(chosen, before)
            inputs = _updating(inputs_of(fewer, model, own, search), before)
            addition = _brought(warehouse, fewer, inputs, before, parent, progress, flow_run)
            if addition is None:
                return None
            new.append(addition)
            before = brought_forward(before, addition)
        parent = before.parameter_set_id
    assert before is not None
    return BroughtForward(tuple(new), before)


def _stored_before(warehouse: Warehouse, chosen: Chosen, spec: ModelSpec, inputs: Inputs) -> ParameterSet | None:
    """Return the stored set of a model that rests on most of the chosen manoeuvres and on no other, whole."""
    names = {segment.segment_id for segment in chosen.segments}
    if len(names) <= FEWEST:
        return None
    rows = parameter_sets.pooled(warehouse, chosen.vessel, spec.sha256, inputs.estimator)
    mine = {key: value for key, value in inputs.settings.items() if key != "segments"}
    by_id = {row.parameter_set_id: row for row in rows}
    for row in sorted(rows, key=lambda row: (-row.manoeuvres, -row.fitted_at_once, row.parameter_set_id)):
        settings = {key: value for key, value in row.settings.items() if key not in ("segments", UPDATES)}
        at_once = row.fitted_at_once
        if (
            settings == mine
            and row.code_version == chosen.code_version
            and row.profile_sha256 == chosen.profile_sha256
            and at_once >= FEWEST
            and len(names) < GROWN * at_once
            and (rests_on := _segments(row, by_id)) is not None
            and rests_on <= names
        ):
            stored = parameter_sets.get(warehouse, row.parameter_set_id, chosen.vessel)
            left = stored.convergence.get(POSTERIOR)
            usable_set = stored.convergence.get("converged") and left and from_json(left).usable
            return stored if usable_set or row.manoeuvres == len(names) else None
    return None


def _segments(row: parameter_sets.PooledSet, by_id: Mapping[str, parameter_sets.PooledSet]) -> set[str] | None:
    """Return the segments that a set rests on; None where one that it brings forward is lost."""
    segment_ids = set(row.segment_ids)
    while row.updates is not None:
        if row.updates.set not in by_id:
            return None
        row = by_id[row.updates.set]
        segment_ids.update(row.segment_ids)
    return segment_ids


def _further(chosen: Chosen, before: ParameterSet) -> Chosen:
    """Return the chosen manoeuvres on which a set does not rest yet."""
    there = set(before.segment_ids)
    further = tuple(segment for segment in chosen.segments if segment.segment_id not in there)
    logs = {segment.log_id for segment in further}
    ingests = {log: ingest for log, ingest in chosen.ingests.items() if log in logs}
    return replace(chosen, segments=further, ingests=ingests, skipped={})


def _updating(inputs: Inputs, before: ParameterSet) -> Inputs:
    """Return the inputs of further manoeuvres with the set that is brought forward by them."""
    at_once = before.updates.fitted_at_once if before.updates else len(before.segment_ids)
    update = Update(before.parameter_set_id, len(before.segment_ids), at_once)
    return replace(inputs, settings={**inputs.settings, UPDATES: update.as_json()})


def _brought(
    warehouse: Warehouse,
    fewer: Chosen,
    inputs: Inputs,
    before: ParameterSet,
    parent: str | None,
    progress: Progress,
    flow_run: str | None,
) -> ParameterSet | None:
    """Compute what a set adds to the one before it; None where all manoeuvres are to be fitted at once."""
    profile = vessels.get(warehouse, fewer.profile_sha256)
    origin = provenance.collect(warehouse, inputs, list(fewer.ingests.values()), flow_run, vessel=fewer.vessel)
    ids = tuple(segment.segment_id for segment in fewer.segments)
    request = SetRequest(inputs, profile, fewer.vessel, ids, origin, parent, before)
    try:
        runs = assembled(warehouse, fewer, request.spec, progress, _like(before))
    except NotFound:
        # none of them can be laid out: all manoeuvres together say so of each
        return None
    progress(0, 1, f"bringing {before.parameter_set_id} forward by {len(ids)}")
    return _updated_set(runs, request, before)


def build_updated(instruments: Mapping[str, Instruments], request: SetRequest) -> ParameterSet:
    """Compute what a stored set adds to the one that it brings forward, again; nothing is stored.

    Parameters
    ----------
    instruments : mapping of str to Instruments
        Series by log, of the manoeuvres that it adds.
    request : SetRequest
        With the other set.

    Raises
    ------
    DataRejected
        ``not_brought_forward``: by the present code all manoeuvres are to be fitted at once.
    """
    before = request.before
    assert before is not None
    bounds = list(zip(request.segment_ids, request.inputs.bounds, strict=True))
    runs = assemble(instruments, request.profile, bounds, request.spec, _like(before))
    addition = _updated_set(runs, request, before)
    if addition is None:
        raise DataRejected(
            "not_brought_forward",
            f"With this code {before.parameter_set_id} cannot be brought forward by {len(bounds)} manoeuvres: they lie "
            "too far from it, or an earlier version stored it without what is needed. Its model is to be fitted to all "
            "of them at once.",
            f"Make it so with `{command_for([request.vessel])}`.",
        )
    return addition


def _like(before: ParameterSet) -> Like:
    slip = before.convergence[POSTERIOR]["slip_m"]
    return Like(float(before.convergence["grid_step_s"]), None if slip is None else float(slip))


def _model(before: ParameterSet, own: Own) -> EffectModel:
    """Return the model of a stored fit, lasting noise of instruments in the place that it had."""
    known = known_effects(own) | lasting_noise()
    named = [name.partition(".")[0] for name in before.convergence[POSTERIOR]["names"] if "." in name]
    effects: list[Effect] = [known[name] for name in dict.fromkeys(named)]
    return EffectModel(tuple(effects))


def _updated_set(runs: VesselRuns, request: SetRequest, before: ParameterSet) -> ParameterSet | None:
    """Fit the runs beside what the set before says, and return what they add to it."""
    settings, left = request.inputs.settings, from_json(before.convergence[POSTERIOR])
    model = _model(before, Own.from_json(settings.get("own") or {}))
    search = settings_of(settings.get(SEARCH) or {})
    with ThreadPoolExecutor(max_workers=usable()) as workers:
        update = updated(left, model, runs.runs, runs.spec, workers, search)
    if update is None:
        return None
    errors = errors_of(update.fit, update.known, update.step)
    gross_errors = sum(sum(single.gross_errors.values()) for single in update.alone)
    result = as_set(errors.fit, errors.widened(update.agreement), runs, gross_errors, request)
    then = before.convergence
    behind = posterior_of(
        update.logged, errors.fit, errors.together, update.agreement, update.log_likelihood, errors.late
    )
    skipped = {name: why for name, why in {**runs.skipped, **update.left_out}.items() if name in request.segment_ids}
    number = len(then["levels"])
    return replace(
        result,
        start_utc_ns=min(before.start_utc_ns, result.start_utc_ns),
        fit={"horizon": "free run", "rung": _rung(update, errors.fit, before, number)},
        convergence={
            **result.convergence,
            "log_likelihood": update.log_likelihood,
            "measurements": then["measurements"] + update.fit.count,
            "speed_m_s": _mean(then["speed_m_s"], number, result.convergence["speed_m_s"], len(update.fit.runs)),
            "gross_errors": then["gross_errors"] + gross_errors,
            "held_out": [],
            "left_out": skipped,
            POSTERIOR: {**behind.as_json(), "slip_m": then[POSTERIOR]["slip_m"]},
            **(
                {"widened": update.agreement.widened}
                if errors.of_effects
                else {"pooling": pooling(update.agreement, update.alone, update.fit, then["pooling"]["segments"])}
            ),
        },
        warnings=(*(f"left out: {name} ({why})" for name, why in sorted(skipped.items())), *result.warnings),
        parent=request.parent,
    )


def _rung(update: Updated, fit: PooledFit, before: ParameterSet, number: int) -> dict[str, Any]:
    """Return the rung of the ladder: of the new runs, means over all, and what was foreseen of the new ones."""
    first, count = before.fit["rung"], len(fit.runs)
    new_rung = rung(0, step_of(fit, (), None), agreement=update.agreement)
    left = from_json(before.convergence[POSTERIOR])
    foreseen = [free_run_of(filtered, left.point[:6], left.point[6:]) for filtered in fit.runs]
    intensity = {
        name: float(np.exp(_mean(np.log(first["disturbance_intensity"][name]), number, np.log(value), count)))
        for name, value in new_rung["disturbance_intensity"].items()
    }
    legs, values = fitted_to_legs(before), fit.values.copy()
    by_legs = []
    if legs is not None:
        # those of the set before: legs are fitted where all manoeuvres are
        values[fit.model.of_ship] = legs[1]
        by_legs = [free_run_of(filtered, legs[0], values) for filtered in fit.runs]
    return {
        **new_rung,
        "free_run_fitted_to_legs": {free_run.name: free_run.relative_error for free_run in by_legs},
        "in_sample_error": _mean(first["in_sample_error"], number, new_rung["in_sample_error"], count),
        "held_out_error": first["held_out_error"],
        "foreseen": {free_run.name: free_run.relative_error for free_run in foreseen},
        "disturbance_intensity": intensity,
        "log_likelihood": update.log_likelihood,
        "converged": True,
    }


def _mean(first: float | None, number: int, second: float, count: int) -> float:
    # a free run that diverges has no error, and a mean with it has none
    before = np.nan if first is None else first
    return float((number * before + count * second) / (number + count))
