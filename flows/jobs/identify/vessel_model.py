"""Models with effects: fitted to all manoeuvres of a vessel but the held-out ones, and stored as parameter sets.

A model's parent is the model with one effect less, so a vessel's ladder is the chain of its parents.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from kempf.flows.jobs.identify.chosen_manoeuvres import Chosen
from kempf.flows.jobs.identify.errors_of_fit import errors_of
from kempf.flows.jobs.identify.lasting_noise import lasting_noise_of
from kempf.flows.jobs.identify.loads_of_logs import loads_of_logs
from kempf.flows.jobs.identify.parameter_set_of import (
    SetRequest,
    arm_of,
    channel_warnings,
    described,
    stored,
    without_arm,
)
from kempf.flows.jobs.identify.standing_model import SEARCH, SINGLE, Own, inputs_of, known_effects, named, stored_model
from kempf.flows.jobs.identify.vessel_runs import VesselRuns, assemble, assembled
from kempf.flows.process.cores import usable
from kempf.flows.process.fit_report import reported_to
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.diagnose.split import split
from kempf.pipeline.diagnose.steps.ladder_step import rung, step_of
from kempf.pipeline.estimate.agreement import LEVEL, Agreement, agreement_of
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.maximum_likelihood import settings_of
from kempf.pipeline.estimate.plain_fit import Alone, PlainFit, off_in_std
from kempf.pipeline.estimate.plausibility import plausibility_warnings
from kempf.pipeline.estimate.pooled_fit import PooledFit, ShipPart
from kempf.pipeline.estimate.pooled_uncertainty import PooledUncertainty, uncertainty_of
from kempf.pipeline.estimate.posterior import posterior_of
from kempf.pipeline.estimate.record.grid_run import common_slip
from kempf.pipeline.estimate.record.left_out import instants_left_out
from kempf.pipeline.estimate.result import discrete_values
from kempf.pipeline.shooting.ahead import Ahead, ahead_of
from kempf.schemas.errors import NotFound
from kempf.schemas.model_spec import HULL_PARAMETERS, N_HULL, NOISE_PARAMETERS, ModelSpec
from kempf.schemas.units import as_read
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets, provenance, vessels
from kempf.warehouse.tables.parameter_set import ParameterSet, parameter_set_id
from kempf.warehouse.tables.parameter_set import StoredValue as Stored

_STEP_S = 1.0
#: standard errors from nothing within which an effect may as well not be there
_THERE = 2.0
#: key of a pooled set's convergence that holds what its fit leaves for further runs
POSTERIOR = "posterior"


@dataclass(frozen=True, eq=False)
class Fitted:
    """A vessel's manoeuvres and the fits that lead to a model, the plain one first."""

    runs: VesselRuns
    plain: PlainFit
    #: With one effect more each.
    fits: tuple[PooledFit, ...]

    @cached_property
    def ahead(self) -> tuple[Ahead | None, ...]:
        """The same models one leg ahead, fitted to predict it; None where one manoeuvre alone is fitted."""
        _, left = split(self.runs.runs)
        with ThreadPoolExecutor(max_workers=usable()) as workers:
            return ahead_of(self.fits, [self.runs.runs[i] for i in left], workers)


def _fitted_model(
    runs: VesselRuns,
    spec: ModelSpec,
    own: Own,
    search: Mapping[str, Any] | None = None,
    listener: Listener = SILENT,
) -> Fitted:
    """Fit a model and every model on the way to it."""
    used = named(spec.effects, known_effects(own))
    chosen, _ = split(runs.runs)
    with ThreadPoolExecutor(max_workers=usable()) as workers:
        fitted = [runs.runs[i] for i in chosen]
        plain, fits = staged(fitted, runs.spec, used, workers, settings_of(search or {}), listener)
    return Fitted(runs, plain, tuple(fits))


def store_model(
    warehouse: Warehouse,
    chosen: Chosen,
    spec: ModelSpec,
    own: Own,
    progress: Progress = silent,
    flow_run: str | None = None,
    fitted: Fitted | None = None,
    search: Mapping[str, Any] | None = None,
    keep: Callable[[Sequence[ParameterSet]], None] | None = None,
) -> tuple[ParameterSet, bool]:
    """Store a model and every model on the way to it, each the parent of the next, in one commit.

    Parameters
    ----------
    chosen : Chosen
        Manoeuvres.
    fitted : Fitted, optional
        The model's fits, where the caller has them; else they are made here.
    search : mapping, optional
        Settings of the search that differ from the defaults.
    keep : callable, optional
        Takes what is new, where the caller stores it.

    Returns
    -------
    (ParameterSet, bool)
        The model, and whether it is new.
    """
    parameter_set = stored_model(warehouse, chosen, spec, own, search)
    if parameter_set is not None:
        return parameter_set, False
    way = [spec.model_copy(update={"effects": spec.effects[:k]}) for k in range(len(spec.effects) + 1)]
    all_inputs = [inputs_of(chosen, model, own, search) for model in way]
    names = [parameter_set_id(inputs) for inputs in all_inputs]
    there = set(parameter_sets.summaries(warehouse, chosen.vessel)["parameter_set_id"].to_list())
    if fitted is None:
        runs = assembled(warehouse, chosen, spec, progress)
        # the models one after the other, then all of them one leg ahead
        pieces = len(way) + 1
        fitted = _fitted_model(runs, spec, own, search, reported_to(progress, pieces))
        progress(len(way), pieces, "predicting one leg ahead")
    profile = vessels.get(warehouse, chosen.profile_sha256)
    new_sets = []
    for inputs, name, parent, fit in zip(all_inputs, names, [None, *names[:-1]], fitted.fits, strict=True):
        if name not in there:
            origin = provenance.collect(
                warehouse, inputs, list(chosen.ingests.values()), flow_run, vessel=chosen.vessel
            )
            ids = tuple(segment.segment_id for segment in chosen.segments)
            new_sets.append(_model_set(fit, fitted, SetRequest(inputs, profile, chosen.vessel, ids, origin, parent)))
            progress(len(way) + 1, len(way) + 1, errors_in_words(new_sets[-1].fit["rung"]))
    if keep is None:
        parameter_sets.insert(warehouse, new_sets)
    else:
        keep(new_sets)
    return new_sets[-1], True


def errors_in_words(rung: Mapping[str, Any]) -> str:
    """Say how well a rung of the ladder runs free, in the manoeuvres that it was fitted to and in those held out."""

    def share(error: float | None) -> str:
        return "diverges" if error is None or np.isnan(error) else f"{100.0 * error:.3g} %"

    held = f", {share(rung['held_out_error'])} held out" if rung["held_out"] else ""
    return f"{rung['added'] or 'the plain model'}: free-run error {share(rung['in_sample_error'])} fitted{held}"


def build_model(instruments: Mapping[str, Instruments], request: SetRequest) -> ParameterSet:
    """Compute the model of several manoeuvres together; nothing is stored.

    Parameters
    ----------
    instruments : mapping of str to Instruments
        Series by log.
    """
    fitted = _fitted_request(instruments, request)
    return _model_set(fitted.fits[-1], fitted, request)


def build_single(instruments: Mapping[str, Instruments], request: SetRequest) -> ParameterSet:
    """Compute the set of one manoeuvre whose model has effects; nothing is stored.

    Parameters
    ----------
    instruments : mapping of str to Instruments
        Series by log.

    Raises
    ------
    KempfError
        The segment cannot be identified from, or an effect cannot be determined from it.
    """
    return _single(_fitted_request(instruments, request), request)


def build_with_errors_that_last(instruments: Mapping[str, Instruments], request: SetRequest) -> ParameterSet | None:
    """Compute the set of one manoeuvre of the plain model with errors of her instruments that last.

    They are lasting noise (decision 0044), and what is not known of a lateness that was taken from a velocity (decision
    0045): it is the same in the whole manoeuvre.

    Parameters
    ----------
    instruments : mapping of str to Instruments
        Series by log.

    Returns
    -------
    ParameterSet or None
        None where the manoeuvre shows neither, or the search did not converge.
    """
    fitted = _fitted_request(instruments, request)
    fit = fitted.fits[-1]
    late = not all(filtered.run.instant_errors.known for filtered in fit.runs)
    return _single(fitted, request) if (fit.noise or late) and fit.converged else None


def _single(fitted: Fitted, request: SetRequest) -> ParameterSet:
    fit, (record,) = fitted.fits[-1], fitted.runs.records
    errors = errors_of(fit, uncertainty_of(fit))
    uncertainty = errors.widened(agreement_of(fit)) if fit.ship.model.effects else errors.together
    result = as_set(errors.fit, uncertainty, fitted.runs, fitted.plain.gross_errors, request)
    return replace(
        result,
        noise=(
            *(Stored(name, level, None, NOISE_PARAMETERS[name]) for name, level in fit.sigmas(0).items()),
            *result.noise,
        ),
        fit=uncertainty.one_step[0],
        warnings=(*record.warnings, *result.warnings),
        parent=request.spec.parent,
    )


def _fitted_request(instruments: Mapping[str, Instruments], request: SetRequest) -> Fitted:
    spec, settings = request.spec, request.inputs.settings
    bounds = list(zip(request.segment_ids, request.inputs.bounds, strict=True))
    laden = loads_of_logs(bounds, request.inputs.draughts_m)
    runs = assemble(instruments, request.profile, bounds, spec, laden=laden)
    # the plain model of one manoeuvre has no settings but those of its search
    search = settings if request.inputs.estimator == SINGLE and not spec.effects else settings.get(SEARCH)
    return _fitted_model(runs, spec, Own.from_json(settings.get("own") or {}), search)


def _model_set(fit: PooledFit, fitted: Fitted, request: SetRequest) -> ParameterSet:
    """Return the set of all manoeuvres together, with what the model predicts of those held out."""
    runs, effects = fitted.runs, request.spec.effects
    if request.parent is None and effects:
        raise NotFound(
            "no_parent", f"The model {' + '.join(effects)} has no parent.", "Make it with `kempf effects add`."
        )
    _, left = split(runs.runs)
    number = next(k for k, candidate in enumerate(fitted.fits) if candidate is fit)
    before = fitted.ahead[number - 1] if number else None
    plain, errors = fitted.plain, errors_of(fit, uncertainty_of(fit))
    step = step_of(errors.fit, [runs.runs[i] for i in left], fitted.ahead[number])
    agreement = agreement_of(fit) if effects else plain.agreement
    result = as_set(errors.fit, errors.widened(agreement), runs, plain.gross_errors, request)
    left_behind = posterior_of(fit, errors.fit, errors.together, agreement, fit.log_likelihood, errors.late)
    alone = () if step.held else ("no manoeuvre is held out: fewer than three can be used; the errors are in sample",)
    # of the manoeuvres that the inputs name, so that a rerun says the same
    skipped = {name: why for name, why in {**runs.skipped, **plain.left_out}.items() if name in request.segment_ids}
    return replace(
        result,
        fit={"horizon": "free run", "rung": rung(0, step, before)},
        convergence={
            **result.convergence,
            "held_out": [run.name for run in step.held],
            "left_out": skipped,
            POSTERIOR: {**left_behind.as_json(), "slip_m": common_slip([filtered.run for filtered in fit.runs])},
            **(
                {} if effects or len(plain.alone) < 2 else {"pooling": pooling(plain.agreement, plain.alone, plain.fit)}
            ),
        },
        warnings=(
            *(f"left out: {name} ({why})" for name, why in sorted(skipped.items())),
            *alone,
            *(() if effects else _disagreement(plain)),
            *_ahead_disagrees(step.ahead),
            *_of_nothing(step.ahead, errors.fit.ship_part(errors.widened(agreement).covariance)),
            *result.warnings,
        ),
        parent=request.parent,
    )


def pooling(agreement: Agreement, alone: Sequence[Alone], fit: PooledFit, before: int = 0) -> dict[str, Any]:
    """Return what separate hulls say of a common one, JSON content.

    Parameters
    ----------
    alone : sequence of Alone
        Runs, each by itself.
    before : int, optional
        How many more runs the fit rests on.
    """
    return {
        "segments": before + len(alone),
        "statistic": agreement.statistic,
        "degrees_of_freedom": agreement.degrees_of_freedom,
        "p_value": agreement.p_value,
        "may_be_pooled": agreement.p_value >= LEVEL,
        "widened": agreement.widened,
        "members": [
            {
                "segment": single.run.name,
                "gross_errors": single.gross_errors,
                "off_in_std": dict(zip(HULL_PARAMETERS, off_in_std(single, fit).tolist(), strict=True)),
            }
            for single in alone
        ],
    }


def _ahead_disagrees(ahead: Ahead | None) -> tuple[str, ...]:
    if ahead is None or ahead.disagrees is None:
        return ()
    return (
        f"fits one step and one leg ahead disagree, so the model lacks something: the misfit one leg "
        f"({ahead.horizon_s:.3g} s) ahead is {100.0 * ahead.disagrees.falls_by:.0f} % smaller with parameters fitted "
        "to legs, which predictions of manoeuvres take (one_leg_ahead)",
    )


def _of_nothing(ahead: Ahead | None, ship: ShipPart) -> tuple[str, ...]:
    """Return a warning for every effect that may as well not be there, by the parameters that predictions take."""
    by_likelihood = (ship.model, ship.values, ship.std[N_HULL:])
    taken = by_likelihood
    if ahead is not None and ahead.disagrees is not None:
        taken = (ahead.model, ahead.fit.values, ahead.std[N_HULL:])
    warnings = []
    for effect in ship.model.effects:
        model, values, std = taken if taken[0].own(effect.name).any() else by_likelihood
        own = np.flatnonzero(model.own(effect.name))
        pairs = [(p, values[k], std[k]) for p, k in zip(effect.parameters, own, strict=True) if not p.shapes]
        if pairs and all(abs(value) < _THERE * error for _, value, error in pairs):
            sizes = ", ".join(_as_read(f"{effect.name}.{p.name}", value, error, p.unit) for p, value, error in pairs)
            warnings.append(f"within {_THERE:g} standard errors of nothing, these data do not show it: {sizes}")
    return tuple(warnings)


def _as_read(name: str, value: float, error: float, unit: str) -> str:
    factor, shown = as_read(unit)
    return f"{name} = {factor * value:.2g} ± {factor * error:.1g} {shown}".rstrip()


def _disagreement(plain: PlainFit) -> tuple[str, ...]:
    if plain.agreement.p_value >= LEVEL:
        return ()
    return (
        f"the {len(plain.alone)} manoeuvres do not share one hull (p = {plain.agreement.p_value:.1g}): the ship, her "
        "load or what acts on her changed, or the model lacks something; standard errors are widened "
        f"{plain.agreement.widened:.1f} times",
    )


def as_set(
    fit: PooledFit, uncertainty: PooledUncertainty, runs: VesselRuns, gross_errors: int, request: SetRequest
) -> ParameterSet:
    """Return what every set of a common fit holds.

    Parameters
    ----------
    uncertainty : PooledUncertainty
        The errors that are stated.
    gross_errors : int
        Measurements that were taken out.
    """
    spec, ship = request.spec, fit.ship_part(uncertainty.covariance)
    covariance = ship.covariance
    speed = float(np.mean([np.mean(filtered.run.speed_m_s) for filtered in fit.runs]))
    return ParameterSet(
        **described(request),
        model_name=" + ".join((spec.name, *spec.effects)),
        parameters=_parameters(ship),
        discrete=stored(discrete_values(fit.hull, np.nan_to_num(covariance[:6, :6]), speed, _STEP_S)),
        noise=lasting_noise_of(fit),
        covariance_names=(*HULL_PARAMETERS, *ship.model.names),
        covariance=tuple(tuple(float(x) for x in row) for row in covariance),
        fit={},
        iterations=[],
        convergence={
            "converged": fit.converged,
            "reason": fit.reason,
            "iterations": fit.iterations,
            "log_likelihood": fit.log_likelihood,
            "measurements": fit.count,
            "speed_m_s": speed,
            "step_s": _STEP_S,
            "grid_step_s": fit.runs[0].run.step_s,
            "standard_errors": uncertainty.kind,
            **({"widened": agreement_of(fit).widened} if ship.model.effects else {}),
            "gross_errors": gross_errors,
            "gross_error_instants_s": _gross_errors(fit, runs),
            "levels": {filtered.run.name: list(levels) for filtered, levels in zip(fit.runs, fit.levels, strict=True)},
        },
        warnings=(
            *(() if fit.converged else (f"not converged: {fit.reason}",)),
            *_at_bounds(ship),
            *dict.fromkeys(
                sentence
                for step in uncertainty.one_step
                for sentence in plausibility_warnings(fit.hull, ship.std[:6], step)
            ),
            *without_arm(spec, arm_of(spec, request.profile)),
            *channel_warnings(request.origin),
        ),
        parent=None,
    )


def _at_bounds(ship: ShipPart) -> tuple[str, ...]:
    """Return a warning for every parameter of an effect that ended at a bound."""
    lowest, highest = ship.model.at_bounds(ship.values)
    return tuple(
        f"at a bound, not estimated: {ship.model.names[k]} = {ship.values[k]:.3g}"
        + ("; the effect as fitted changes nothing" if ship.values[k] == 0.0 else "")
        for k in np.flatnonzero(lowest | highest)
    )


def _gross_errors(fit: PooledFit, runs: VesselRuns) -> dict[str, dict[str, list[float]]]:
    """Return which measurements the fit left out, by run and measurement, so that a comparison leaves them out too."""
    whole = {run.name: run for run in runs.runs}
    left_out = {filtered.run.name: instants_left_out(whole[filtered.run.name], filtered.run) for filtered in fit.runs}
    return {name: instants for name, instants in left_out.items() if instants}


def _parameters(ship: ShipPart) -> tuple[Stored, ...]:
    units = [*HULL_PARAMETERS.values(), *(p.unit for _, p in ship.model.parameters)]
    names = [*HULL_PARAMETERS, *ship.model.names]
    return tuple(
        Stored(n, float(v), float(s) if np.isfinite(s) else None, u)
        for n, v, s, u in zip(names, ship.parameters, ship.std, units, strict=True)
    )
