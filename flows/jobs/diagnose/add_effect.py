"""The job that adds an effect to the model of a vessel."""

from __future__ import annotations

from kempf.flows.jobs.identify.chosen_manoeuvres import choose_refreshed
from kempf.flows.jobs.identify.standing_model import (
    NONE_OF_ONES_OWN,
    Own,
    known_effects,
    named,
    point,
    require_current,
    standing_model,
    stored_model,
)
from kempf.flows.process.progress import Progress, silent
from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets
from kempf.warehouse.tables.parameter_set import ParameterSet

#: standard errors beyond which a prediction is worse, and part of the misfit:
#: `kempf.pipeline.diagnose.steps.improves_prediction`
WORSE, LEAST_RISE = 2.0, 0.01


def add_effect(
    warehouse: Warehouse,
    vessel: str,
    name: str,
    own: Own = NONE_OF_ONES_OWN,
    progress: Progress = silent,
    *,
    begin: tuple[ModelSpec, Own] | None = None,
    force: bool = False,
    shown: str | None = None,
) -> ParameterSet:
    """Add an effect to a vessel's model, refit, and make the result her model; its parent is the one before.

    A model that predicts worse than its parent, beyond the error, or that did not converge where its parent did, is
    stored and does not become hers.

    Parameters
    ----------
    name : str
        Of the catalogue, or of an effect in ``own``.
    own : Own, optional
        An effect of a person's own.
    begin : (ModelSpec, Own), optional
        The model that it is added to; the vessel's current one by default.
    force : bool, optional
        Make it her model though it predicts worse.
    shown : str, optional
        Id of the set that was taken to be her current one when this was asked for.

    Raises
    ------
    NotFound
        ``effect_unknown``, ``no_vessel``, ``no_segments``, ``no_runs``.
    UsageError
        ``effect_there``, ``effect_name``; ``moved_meanwhile``: somebody gave her another model in between, which stays.
    DataRejected
        ``effect_worsens``: with the errors before and after.
    """
    named((name,), known_effects(own))
    now = require_current(warehouse, vessel, shown)
    spec, before = begin or standing_model(warehouse, vessel)
    if name in spec.effects:
        raise UsageError(
            "effect_there", f"The model of {vessel!r} holds {name!r} already.", f"See `kempf ladder --vessel {vessel}`."
        )
    larger_spec = spec.model_copy(update={"effects": (*spec.effects, name)})
    both = before.beside(own)
    chosen = choose_refreshed(warehouse, vessel, progress)
    parameter_set = stored_model(warehouse, chosen, larger_spec, both)
    if parameter_set is None:
        # only a fit needs the estimators, which take a while to load
        from kempf.flows.jobs.identify.vessel_model import store_model

        parameter_set, _ = store_model(warehouse, chosen, larger_spec, both, progress)
    worse = [*worsening(parameter_set), *_lost_its_top(warehouse, parameter_set)]
    if worse and not force:
        raise DataRejected(
            "effect_worsens",
            f"{name} makes the model of {vessel!r} worse: {'; '.join(worse)}. It is stored as "
            f"{parameter_set.parameter_set_id}; her current one stays.",
            "Add it all the same with --force, or see what `kempf diagnose` names.",
            {"effect": name, "parameter_set_id": parameter_set.parameter_set_id, "worse": worse},
        )
    point(warehouse, parameter_set, now)
    return parameter_set


def _lost_its_top(warehouse: Warehouse, parameter_set: ParameterSet) -> list[str]:
    """Return that a fit did not converge though its parent's did, a phrase."""
    if parameter_set.convergence.get("converged") or parameter_set.parent is None:
        return []
    parent = parameter_sets.get(warehouse, parameter_set.parent)
    if not parent.convergence.get("converged"):
        return []
    return [f"the fit did not converge ({parameter_set.convergence.get('reason')}), as the one without it did"]


def worsening(parameter_set: ParameterSet) -> list[str]:
    """Return what a model predicts worse than its parent one leg ahead, beyond the error, a phrase each."""
    ahead = parameter_set.fit["rung"].get("one_leg_ahead")
    phrases = []
    for sample, change in ((ahead or {}).get("beside_the_rung_below") or {}).items():
        words = {
            "fitted": "of fitted manoeuvres",
            "left_out": "of manoeuvres left out",
            "held_out": "of those held out",
        }
        if change["in_std"] is None and (change["falls_by"] or 0.0) < 0.0:
            phrases.append(f"the prediction {words[sample]} diverges")
        elif change["in_std"] is not None and change["in_std"] < -WORSE and change["falls_by"] < -LEAST_RISE:
            phrases.append(
                f"the misfit {words[sample]} one leg ahead rises by {-100.0 * change['falls_by']:.0f} % "
                f"({-change['in_std']:.1f} standard errors; {change['better']} of {change['of']} better)"
            )
    return phrases
