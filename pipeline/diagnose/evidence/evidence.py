"""From a diagnosis to all that its report shows: every number and curve, nothing drawn."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.evidence.added_variable import added_variables
from kempf.pipeline.diagnose.evidence.judged_run import JudgedRun, judged_fitted, judged_held_out
from kempf.pipeline.diagnose.evidence.manoeuvre_evidence import SailedZigzag, manoeuvre_evidence
from kempf.pipeline.diagnose.evidence.misfit import misfit_of
from kempf.pipeline.diagnose.evidence.unmodelled_acceleration import unmodelled_acceleration
from kempf.pipeline.diagnose.screening.unsure_instants import with_instants
from kempf.pipeline.diagnose.steps.confusion_sets import ALIKE, alike
from kempf.pipeline.diagnose.steps.ladder_step import Step
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis
from kempf.pipeline.estimate.agreement import Agreement, agreement_of
from kempf.pipeline.estimate.pooled_uncertainty import uncertainty_of
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.predict.median_error import median_error
from kempf.pipeline.predict.run_residuals import PhaseInterval
from kempf.pipeline.predict.smoothed_states import smoothed_states
from kempf.pipeline.shooting.ahead import Ahead
from kempf.schemas.diagnosis_evidence import (
    CandidateEffect,
    ConfusionMap,
    DiagnosisEvidence,
    DisturbanceLevel,
    FittedModel,
    FittedParameter,
    ManoeuvreEvidence,
    MisfitPlaces,
)
from kempf.schemas.effect import Effect
from kempf.schemas.model_spec import HULL_PARAMETERS

#: effects in the confusion map
_MAPPED = 14
_DISTURBANCES = (
    ("lateral disturbance force", "m/s² per √s"),
    ("disturbance moment", "rad/s² per √s"),
    ("current", "m/s per √s"),
)


def evidence_of(
    diagnosis: Diagnosis,
    phases: Mapping[str, Sequence[PhaseInterval]],
    zigzags: Mapping[str, SailedZigzag],
    left_out: Mapping[str, str],
    workers: Executor,
) -> DiagnosisEvidence:
    """Gather what a report shows of a diagnosis.

    Parameters
    ----------
    phases : mapping of str to sequence of PhaseInterval
        By run; a run without has none.
    zigzags : mapping of str to SailedZigzag
        By run.
    left_out : mapping of str to str
        Why a segment was not used, by its id.
    workers : Executor
        Manoeuvres share it; nothing depends on it.
    """
    steps = (*diagnosis.given, *diagnosis.steps)
    first, last = steps[0], steps[-1]
    by_legs = last.shown_by_legs
    before = _Judged(first, diagnosis, phases, workers.map)
    after = before if last is first else _Judged(last, diagnosis, phases, workers.map)
    held = {run.name for run in diagnosis.held}

    def shown(number: int) -> ManoeuvreEvidence:
        judged = before.all[number]
        name = judged.residuals.filtered.run.name
        other = None if after is before else after.all[number]
        return manoeuvre_evidence(judged, other, after.states[number], zigzags[name], held_out=name in held)

    manoeuvres = sorted(
        workers.map(shown, range(len(before.all))), key=lambda manoeuvre: (manoeuvre.start_utc_ns, manoeuvre.segment_id)
    )
    return DiagnosisEvidence(
        models=tuple(_model(step, first, diagnosis, workers, by_legs=by_legs) for step in steps),
        given=len(diagnosis.given),
        candidates=_candidates(diagnosis),
        confusion=_confusion(diagnosis.steps[0]),
        added_variables=added_variables(diagnosis, workers),
        unmodelled_before=unmodelled_acceleration(before.runs, before.states),
        unmodelled_after=None if after is before else unmodelled_acceleration(after.runs, after.states),
        manoeuvres=tuple(manoeuvres),
        ranges=_ranges(manoeuvres),
        misfit=MisfitPlaces(
            before=misfit_of(before.fitted), after=misfit_of(after.fitted), held_out=misfit_of(after.held_out)
        ),
        left_out=dict(left_out),
    )


class _Judged:
    """All manoeuvres under one model, with their states given all measurements."""

    def __init__(
        self,
        step: Step,
        diagnosis: Diagnosis,
        phases: Mapping[str, Sequence[PhaseInterval]],
        each: Callable[[Callable[[JudgedRun], Float], Sequence[JudgedRun]], Iterable[Float]],
    ) -> None:
        by_legs = diagnosis.steps[-1].shown_by_legs
        self.fitted = judged_fitted(step, phases, by_legs=by_legs)
        self.held_out = judged_held_out(step, diagnosis.held, phases, by_legs=by_legs)
        self.all = (*self.fitted, *self.held_out)
        self.runs = tuple(judged.residuals.filtered.run for judged in self.all)
        self.states = tuple(
            each(lambda run: smoothed_states(run.residuals.filtered, run.point, run.one_step_free), self.all)
        )


def _fitted_parameters(step: Step, plain: Agreement, workers: Executor) -> tuple[FittedParameter, ...]:
    """Return the parameters of hull and effects with their standard errors, as a parameter set states them."""
    stated = with_instants(step.fit, workers)
    if step.fit.ship.model.effects:
        covariance = agreement_of(stated.fit).widened ** 2 * stated.fit.covariance + stated.covariance
    else:
        covariance = plain.widened**2 * (uncertainty_of(step.fit).covariance + stated.covariance)
    ship = stated.fit.ship_part(covariance)
    return _parameters(ship.model, ship.parameters, ship.std)


def _parameters(model: EffectModel, values: Float, std: Float) -> tuple[FittedParameter, ...]:
    names = [*HULL_PARAMETERS, *model.names]
    units = [*HULL_PARAMETERS.values(), *(parameter.unit for _, parameter in model.parameters)]
    return tuple(
        FittedParameter(name=name, unit=unit, value=float(value), std=float(error))
        for name, unit, value, error in zip(names, units, values, std, strict=True)
    )


def _model(step: Step, first: Step, diagnosis: Diagnosis, workers: Executor, *, by_legs: bool) -> FittedModel:
    used = np.any([filtered.levels_used()[:3] for filtered in step.fit.runs], axis=0)
    intensities = zip(_DISTURBANCES, step.intensities, first.intensities, used, strict=True)
    fitted, held_out = (np.array([run.relative_error for run in runs]) for runs in step.free_runs(by_legs=by_legs))
    # with the parameters fitted to legs the median, as the sentences: free runs of a ship that keeps no course run off
    middle = median_error if by_legs else _mean
    return FittedModel(
        effects=tuple(effect.title for effect in step.fit.model.ship.effects),
        # the diagnosed model is no step of the search, but as a rung it has one effect more than the one below
        added="" if step is first else (step.added or step.fit.model.ship.effects[-1]).title,
        parameters=_fitted_parameters(step, diagnosis.plain.agreement, workers),
        leg_parameters=_leg_parameters(step.ahead) if by_legs and step.ahead is not None else (),
        fitted_errors=fitted,
        held_out_errors=held_out,
        fitted_error=middle(fitted),
        held_out_error=middle(held_out) if held_out.size else None,
        disturbances=tuple(
            DisturbanceLevel(name=name, unit=unit, intensity=float(level), share=float(level / base))
            for (name, unit), level, base, there in intensities
            if there
        ),
        log_likelihood=step.fit.log_likelihood,
        converged=step.fit.converged,
    )


def _mean(errors: Float) -> float:
    return float(np.mean(errors))


def _leg_parameters(ahead: Ahead) -> tuple[FittedParameter, ...]:
    """Return the parameters fitted to legs."""
    return _parameters(ahead.model, ahead.fit.shared, ahead.std)


def _candidates(diagnosis: Diagnosis) -> dict[str, CandidateEffect]:
    refitted: dict[str, tuple[str, tuple[FittedParameter, ...]]] = {}
    for number, step in enumerate(diagnosis.steps[1:], start=1):
        for candidate, _ in step.chosen_from:
            refitted[candidate.effect.name] = (f"S{number}", _sized(candidate.effect, diagnosis))
    candidates = {}
    for candidate in diagnosis.steps[0].screened:
        set_id, parameters = refitted.get(candidate.effect.name, ("", ()))
        candidates[candidate.effect.name] = CandidateEffect(
            separated_by=candidate.effect.separated_by,
            missing_channels=candidate.missing,
            set_id=set_id,
            refitted=parameters,
        )
    return candidates


def _sized(effect: Effect, diagnosis: Diagnosis) -> tuple[FittedParameter, ...]:
    """Return the parameters of an effect with their standard errors, beside everything else that is claimed."""
    size = diagnosis.sizes[effect.name]
    return tuple(
        FittedParameter(name=f"{effect.name}.{parameter.name}", unit=parameter.unit, value=float(value), std=float(std))
        for parameter, value, std in zip(effect.parameters, size.values, size.std, strict=True)
    )


def _confusion(first: Step) -> ConfusionMap:
    shown = [candidate for candidate in first.screened if candidate.direction.size][:_MAPPED]
    return ConfusionMap(
        titles=tuple(candidate.effect.title for candidate in shown),
        squared_cosine=np.array([[alike(a, b) for b in shown] for a in shown]).reshape(len(shown), len(shown)),
        threshold=ALIKE,
    )


def _ranges(manoeuvres: Sequence[ManoeuvreEvidence]) -> dict[str, tuple[float, float]]:
    ranges = {}
    for name in ("drift", "turn", "rudder", "speed"):
        every = np.concatenate([getattr(manoeuvre, name) for manoeuvre in manoeuvres])
        known = every[np.isfinite(every)]
        ranges[name] = (float(np.min(known)), float(np.max(known))) if known.size else (np.nan, np.nan)
    return ranges
