"""The job that puts a vessel's runs beside what a parameter set predicts of them. Nothing is stored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kempf.flows.jobs.chosen_manoeuvres import choose
from kempf.flows.jobs.chosen_set import chosen_set
from kempf.flows.jobs.lasting_noise import with_lasting_noise
from kempf.flows.jobs.leg_fit import fitted_to_legs
from kempf.flows.jobs.standing_model import Own, known_effects, named
from kempf.flows.jobs.vessel_runs import assembled
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.series import SECOND_NS, Float
from kempf.pipeline.compare.compared_run import compare_run
from kempf.pipeline.compare.comparison import ComparedRun, judged, summary
from kempf.pipeline.compare.misfit import where
from kempf.pipeline.compare.overshoot import Turn, turns_of
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.levels import first_levels, fit_levels
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.record.left_out import left_out
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.predict.horizon import Horizon, horizon_of
from kempf.pipeline.predict.run_residuals import phases_s
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec
from kempf.warehouse import segments
from kempf.warehouse.deduplicate import once, same
from kempf.warehouse.parameter_set import ParameterSet
from kempf.warehouse.segments import Segment
from kempf.warehouse.store import Warehouse


@dataclass(frozen=True, eq=False)
class Comparison:
    """A vessel's runs beside what a parameter set predicts of them."""

    vessel: str
    parameter_set: ParameterSet
    #: By which the set was chosen; None where it was named.
    alias: str | None
    horizon: Horizon
    #: In order of time.
    runs: tuple[ComparedRun, ...]
    #: One a run.
    found: tuple[Segment, ...]
    #: Why a segment is not among them, by its id.
    skipped: dict[str, str]

    def show(self) -> dict[str, Any]:
        """Return the comparison as the command line's JSON object."""
        sample, error = judged(self.runs)
        return {
            "vessel": self.vessel,
            "parameter_set_id": self.parameter_set.parameter_set_id,
            "alias": self.alias,
            "estimator": self.parameter_set.estimator,
            "effects": list(self.parameter_set.model_spec.get("effects", ())),
            "horizon": self.horizon.name,
            "horizon_words": self.horizon.words,
            "runs": [
                {
                    **run.show(),
                    "psi0_deg": segment.psi0_deg,
                    "delta0_deg": segment.delta0_deg,
                    "start": segment.show("")["start"],
                    "end": segment.show("")["end"],
                }
                for run, segment in zip(self.runs, self.found, strict=True)
            ],
            "summary": summary(self.runs),
            "judged": {"sample": sample, "free_run_error_percent": error},
            "skipped": self.skipped,
        }

    def where(self) -> dict[str, Any]:
        """Say where the model fails, on fitted and on held-out runs apart; None where there are no such runs."""
        found: dict[str, Any] = {}
        for sample in ("fitted", "held_out"):
            looked = [run.looked for run in self.runs if run.sample == sample]
            found[sample] = where(looked) if looked else None
        return found


def compare_vessel(
    warehouse: Warehouse,
    vessel: str,
    set_id: str | None = None,
    horizon: str = "free",
    progress: Progress = silent,
) -> Comparison:
    """Put every usable run of a vessel beside what a parameter set predicts of it.

    Parameters
    ----------
    set_id : str, optional
        Parameter set, by id or alias; by default the current one.
    horizon : str, optional
        See `kempf.pipeline.predict.horizon.horizon_of`.

    Raises
    ------
    NotFound
        ``no_parameter_set``, ``no_runs``, ``no_segments``, ``effect_unknown``.
    UsageError
        ``set_of_another_vessel``, ``horizon_unknown``.
    DataRejected
        ``set_without_parameters``, ``nothing_to_compare``.
    """
    asked = horizon_of(horizon)
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
    progress(0, len(filtered), "predicting")
    levels = _levels(filtered, held, hull, values, chosen)
    legs = fitted_to_legs(chosen)
    if legs is not None:
        # the likelihood's lasting noise beside them: it moves no ship
        _, values = with_lasting_noise(chosen, model.ship, legs[1])
        legs = (legs[0], values, *legs[2:])
    runs, found, skipped = [], [], dict(data.skipped)
    for k, (one, segment) in enumerate(zip(filtered, ordered, strict=True)):
        progress(k, len(filtered), f"predicting {segment.segment_id}")
        try:
            compared = compare_run(
                *(one, Point(hull, values, levels[k].foreseen), asked),
                held_out=held[k],
                legs=None if legs is None else legs[:2],
                levels_from=levels[k].source,
                own_levels=levels[k].own,
                phases=phases_s(segment.detail.get("phases", ()), one.run.start_utc_ns),
                turns=_turns(segment, one.run),
            )
        except DataRejected as error:
            skipped[segment.segment_id] = error.message
            continue
        runs.append(compared)
        found.append(segment)
    progress(len(filtered), len(filtered), "predicted")
    if not runs:
        raise DataRejected(
            "nothing_to_compare",
            f"{chosen.parameter_set_id} predicts none of the {len(filtered)} manoeuvres of {vessel!r}: "
            + "; ".join(f"{name}: {why}" for name, why in sorted(skipped.items())[:3]),
            "Ask for another horizon, or compare another parameter set with --set.",
            {"skipped": skipped},
        )
    return Comparison(vessel, chosen, alias, asked, tuple(runs), tuple(found), skipped)


def _parameters(chosen: ParameterSet) -> tuple[Float, Float, EffectModel]:
    """Return hull, parameters of effects and lasting noise, and the model that they belong to."""
    known = known_effects(Own.from_json(chosen.settings.get("own") or {}))
    model = EffectModel(named(chosen.model_spec.get("effects", ()), known))
    found = {p.name: p.value for p in chosen.parameters}
    names = (*HULL_PARAMETERS, *model.names)
    lacking = [name for name in names if not np.isfinite(found.get(name, np.nan))]
    if lacking:
        raise DataRejected(
            "set_without_parameters",
            f"{chosen.parameter_set_id} has no value for {', '.join(lacking)}, which a prediction needs.",
            "Compare a set with all six parameters; `kempf params list` names them.",
            {"lacking": lacking},
        )
    values = np.array([found[name] for name in names])
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
    fit = chosen.convergence
    unseen = {*(fit.get("held_out") or ()), *(fit.get("left_out") or ())}
    bounds = list(inputs.get("segments", ()))
    # a model with effects names its held-out runs among its segments, in the order of the bounds
    names = chosen.settings.get("segments") or [""] * len(bounds)
    kept = [b for name, b in zip(names, bounds, strict=True) if name not in unseen]
    ids = frozenset(chosen.segment_ids) - unseen
    found = tuple(s for s in segments.current(warehouse, vessel) if s.segment_id in ids)
    return _Seen(ids, tuple((b["log_id"], b["start_utc_ns"], b["end_utc_ns"]) for b in kept), found)


def _is_seen(segment: Segment, seen: _Seen) -> bool:
    """Return whether a set was made from a segment, under this id, with other bounds, or from another log of it."""
    return (
        segment.segment_id in seen.ids
        or any(
            log_id == segment.log_id and start < segment.end_utc_ns and segment.start_utc_ns < end
            for log_id, start, end in seen.bounds
        )
        or any(len(once([segment, other], same)[0]) == 1 for other in seen.found)
    )


@dataclass(frozen=True, eq=False)
class _Levels:
    """Noise levels of one run, logarithms, shape (6,): to predict with, and fitted to the run itself."""

    foreseen: Float
    own: Float
    source: str


def _levels(
    filtered: list[RunFilter], held: list[bool], hull: Float, values: Float, chosen: ParameterSet
) -> list[_Levels]:
    """Return the noise levels of each run; a held-out run is predicted with the mean of the fitted ones' logarithms."""
    kept: Mapping[str, Any] = chosen.convergence.get("levels") or {}
    own, sources = [], []
    for k, one in enumerate(filtered):
        if one.run.name in kept and not held[k]:
            own.append(np.array(kept[one.run.name], dtype=np.float64))
            sources.append("fitted with the parameters")
        else:
            found = fit_levels(one, hull, values, first_levels(one))
            own.append(found.levels)
            sources.append("fitted to this manoeuvre, parameters held" + ("" if found.converged else "; not converged"))
    seen = [levels for levels, out in zip(own, held, strict=True) if not out]
    mean = np.mean(seen, axis=0) if seen else None
    return [
        _Levels(levels, levels, words)
        if mean is None or not out
        else _Levels(
            mean,
            levels,
            "mean of the fitted ones' logarithms; in where: fitted to this manoeuvre, parameters held",
        )
        for levels, out, words in zip(own, held, sources, strict=True)
    ]


def _turns(segment: Segment, run: GridRun) -> tuple[Turn, ...]:
    def seconds(ns: int) -> float:
        return (ns - run.start_utc_ns) / SECOND_NS

    overshoots = [
        (o["number"], 1 if o["side"] == "starboard" else -1, seconds(o["peak_utc_ns"]), o["beyond_nominal_deg"])
        for o in segment.detail.get("overshoots", ())
    ]
    return turns_of(overshoots, [seconds(t) for t in segment.executes_utc_ns], seconds(segment.end_utc_ns))
