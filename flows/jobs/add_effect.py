"""The job that adds an effect to the model of a vessel."""

from __future__ import annotations

from kempf.flows.jobs.chosen_manoeuvres import choose_refreshed
from kempf.flows.jobs.standing_model import (
    NONE_OF_ONES_OWN,
    Own,
    known_effects,
    named,
    point,
    standing_model,
    stored_model,
)
from kempf.flows.process.progress import Progress, silent
from kempf.schemas.errors import UsageError
from kempf.warehouse.parameter_set import ParameterSet
from kempf.warehouse.store import Warehouse


def add_effect(
    warehouse: Warehouse, vessel: str, name: str, own: Own = NONE_OF_ONES_OWN, progress: Progress = silent
) -> ParameterSet:
    """Add an effect to a vessel's model, refit, and make the result her model; its parent is the one before.

    Parameters
    ----------
    name : str
        Of the catalogue, or of an effect in ``own``.
    own : Own, optional
        An effect of a person's own.

    Raises
    ------
    NotFound
        ``effect_unknown``, ``no_vessel``, ``no_segments``, ``no_runs``.
    UsageError
        ``effect_there``, ``effect_name``.
    """
    named((name,), known_effects(own))
    spec, before = standing_model(warehouse, vessel)
    if name in spec.effects:
        raise UsageError(
            "effect_there", f"The model of {vessel!r} holds {name!r} already.", f"See `kempf ladder --vessel {vessel}`."
        )
    wanted = spec.model_copy(update={"effects": (*spec.effects, name)})
    both = before.beside(own)
    chosen = choose_refreshed(warehouse, vessel, progress)
    made = stored_model(warehouse, chosen, wanted, both)
    if made is None:
        # only a fit needs the estimators, which take a while to load
        from kempf.flows.jobs.vessel_model import store_model

        made, _ = store_model(warehouse, chosen, wanted, both, progress)
    point(warehouse, made)
    return made
