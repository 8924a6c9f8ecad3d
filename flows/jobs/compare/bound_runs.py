"""A vessel's manoeuvres bound to a parameter set: what every prediction with it shares, noise levels above all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.chosen_set import chosen_set
from kempf.flows.jobs.identify.lasting_noise import with_lasting_noise
from kempf.flows.jobs.identify.leg_fit import fitted_to_legs
from kempf.flows.jobs.identify.standing_model import Own, known_effects, named
from kempf.flows.jobs.identify.vessel_runs import assembled
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.levels import first_levels, fit_levels
from kempf.pipeline.estimate.record.left_out import left_out
from kempf.pipeline.model.effect_model import EffectModel
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec
from kempf.warehouse.queries.deduplicate import same
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import segments
from kempf.warehouse.tables.parameter_set import ParameterSet
from kempf.warehouse.tables.segments import Segment


@dataclass(frozen=True, eq=False)
class BoundLevels:
    """Noise levels of one run."""

    #: foreseen, own: Shape (6,), logarithms: to predict with, and fitted to the run itself.
    foreseen: Float
    own: Float
    #: Where they come from, in words.
    source: str


@dataclass(frozen=True, eq=False)
class BoundRun:
    """A run ready to be predicted."""

    filtered: RunFilter
    segment: Segment
    #: Whether the parameters have not seen it.
    held_out: bool
    levels: BoundLevels


@dataclass(frozen=True, eq=False)
class BoundRuns:
    """A vessel's runs, bound to a parameter set."""

    vessel: str
    parameter_set: ParameterSet
    #: By which the set was chosen; None where it was named.
    alias: str | None
    #: hull, values: Shape (6,) and (p,). Of the set, its effects and its lasting noise.
    hull: Float
    values: Float
    #: Names of ``hull`` and ``values``, shape (6 + p,).
    names: tuple[str, ...]
    #: Hull and effects fitted to legs, where these predict better; None elsewhere.
    legs: tuple[Float, Float] | None
    #: In order of time.
    runs: tuple[BoundRun, ...]
    #: Why a segment is not among them, by its id.
    skipped: dict[str, str]


def bound(warehouse: Warehouse, vessel: str, set_id: str | None = None, progress: Progress = silent) -> BoundRuns:
    """Bind every usable run of a vessel to a parameter set.

    Parameters
    ----------
    set_id : str, optional
        Parameter set, by id or alias; by default the current one.

    Raises
    ------
    NotFound
        ``no_parameter_set``, ``no_runs``, ``no_segments``, ``effect_unknown``.
    UsageError
        ``set_of_another_vessel``.
    DataRejected
        ``set_without_parameters``.
    """
    chosen, alias = chosen_set(warehouse, vessel, set_id)
    hull, values, model = _parameters(chosen)
    usable = choose(warehouse, vessel)
    data = assembled(warehouse, usable, ModelSpec.model_validate(dict(chosen.model_spec)), progress)
    by_name = {segment.segment_id: segment for segment in usable.segments}
    ordered = [by_name[run.name] for run in data.runs]
    seen = _seen(warehouse, vessel, chosen)
    held = [not _is_seen(segment, seen) for segment in ordered]
    gross: Mapping[str, Any] = chosen.convergence.get("gross_error_instants_s") or {}
    filtered = [RunFilter(left_out(run, gross.get(run.name, {})), model, data.spec) for run in data.runs]
    progress(0, len(filtered), "looking for the noise of each manoeuvre")
    levels = _levels(filtered, held, hull, values, chosen)
    legs = fitted_to_legs(chosen)
    by_legs = None
    if legs is not None:
        # the likelihood's lasting noise beside them: it moves no ship
        by_legs = (legs[0], with_lasting_noise(chosen, model.ship, legs[1])[1])
    return BoundRuns(
        vessel,
        chosen,
        alias,
        hull,
        values,
        (*HULL_PARAMETERS, *model.names),
        by_legs,
        tuple(BoundRun(*parts) for parts in zip(filtered, ordered, held, levels, strict=True)),
        dict(data.skipped),
    )


def _parameters(chosen: ParameterSet) -> tuple[Float, Float, EffectModel]:
    """Return hull, parameters of effects and lasting noise, and the model that they belong to."""
    known = known_effects(Own.from_json(chosen.settings.get("own") or {}))
    model = EffectModel(named(chosen.model_spec.get("effects", ()), known))
    estimates = {p.name: p.value for p in chosen.parameters}
    names = (*HULL_PARAMETERS, *model.names)
    lacking = [name for name in names if not np.isfinite(estimates.get(name, np.nan))]
    if lacking:
        raise DataRejected(
            "set_without_parameters",
            f"{chosen.parameter_set_id} has no value for {', '.join(lacking)}, which a prediction needs.",
            "Compare a set with all six parameters; `kempf params list` names them.",
            {"lacking": lacking},
        )
    values = np.array([estimates[name] for name in names])
    model, effects = with_lasting_noise(chosen, model, values[len(HULL_PARAMETERS) :])
    return values[: len(HULL_PARAMETERS)], effects, model


@dataclass(frozen=True)
class _Seen:
    """What a set was identified from: ids, bounds by log, and those of its segments that are still found."""

    ids: frozenset[str]
    bounds: tuple[tuple[str, int, int], ...]
    found: tuple[Segment, ...]


def _seen(warehouse: Warehouse, vessel: str, chosen: ParameterSet) -> _Seen:
    inputs: Mapping[str, Any] = chosen.provenance.get("inputs") or {}
    unseen = chosen.unseen
    bounds = list(inputs.get("segments", ()))
    # a model with effects names its held-out runs among its segments, in the order of the bounds
    names = chosen.settings.get("segments") or [""] * len(bounds)
    kept = [b for name, b in zip(names, bounds, strict=True) if name not in unseen]
    ids = frozenset(chosen.segment_ids) - unseen
    own_segments = tuple(s for s in segments.current(warehouse, vessel) if s.segment_id in ids)
    return _Seen(ids, tuple((b["log_id"], b["start_utc_ns"], b["end_utc_ns"]) for b in kept), own_segments)


def _is_seen(segment: Segment, seen: _Seen) -> bool:
    """Return whether a set was made from a segment, under this id, with other bounds, or from another log of it."""
    return (
        segment.segment_id in seen.ids
        or any(
            log_id == segment.log_id and start < segment.end_utc_ns and segment.start_utc_ns < end
            for log_id, start, end in seen.bounds
        )
        or any(same(segment, other) for other in seen.found)
    )


def _levels(
    filtered: list[RunFilter], held: list[bool], hull: Float, values: Float, chosen: ParameterSet
) -> list[BoundLevels]:
    """Return the noise levels of each run; a held-out run is predicted with the mean of the fitted ones' logarithms."""
    set_levels: Mapping[str, Any] = chosen.convergence.get("levels") or {}
    own, sources = [], []
    for k, run_filter in enumerate(filtered):
        if run_filter.run.name in set_levels and not held[k]:
            own.append(np.array(set_levels[run_filter.run.name], dtype=np.float64))
            sources.append("fitted with the parameters")
        else:
            fit = fit_levels(run_filter, hull, values, first_levels(run_filter))
            own.append(fit.levels)
            sources.append("fitted to this manoeuvre, parameters held" + ("" if fit.converged else "; not converged"))
    fitted_levels = [levels for levels, out in zip(own, held, strict=True) if not out]
    mean = np.mean(fitted_levels, axis=0) if fitted_levels else None
    return [
        BoundLevels(levels, levels, words)
        if mean is None or not out
        else BoundLevels(
            mean,
            levels,
            "mean of the fitted ones' logarithms; in where: fitted to this manoeuvre, parameters held",
        )
        for levels, out, words in zip(own, held, sources, strict=True)
    ]
