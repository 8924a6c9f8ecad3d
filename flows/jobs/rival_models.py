"""The models of a vessel that fit as well as a given one: members of her diagnosis' confusion sets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from kempf.flows.jobs.chosen_manoeuvres import choose
from kempf.flows.jobs.standing_model import model_of
from kempf.flows.jobs.vessel_model import store_model
from kempf.flows.process.progress import Progress, silent
from kempf.schemas.errors import KempfError
from kempf.warehouse import diagnoses, parameter_sets
from kempf.warehouse.canonical import canonical_json
from kempf.warehouse.parameter_set import ParameterSet
from kempf.warehouse.store import Warehouse


@dataclass(frozen=True)
class Rivals:
    """Models beside a given one."""

    sets: tuple[ParameterSet, ...]
    #: What a user should know of how they were found, sentences.
    remarks: tuple[str, ...]


def rivals_of(warehouse: Warehouse, one: ParameterSet, progress: Progress = silent) -> Rivals:
    """Return the sets of the models that fit the data of a set as well as its own.

    A confusion set of the vessel's newest diagnosis names the effects that fit alike; a model with another member in an
    effect's place is read where it is stored, and fitted to the same manoeuvres and stored where it is not. No alias
    moves.

    Parameters
    ----------
    one : ParameterSet
        The set that is asked for.
    """
    effects = tuple(one.model_spec.get("effects", ()))
    found = [d for d in diagnoses.of_vessel(warehouse, one.vessel) if _same_data(d.inputs, one)]
    if not found:
        return Rivals(
            (), ("no diagnosis says which models fit as well: this one is taken alone; see `kempf diagnose`",)
        )
    alike = [tuple(entry["effects"]) for entry in found[-1].content.get("sets", ()) if len(entry["effects"]) > 1]
    wanted = [
        tuple(other if name == effect else name for name in effects)
        for effect in effects
        for members in alike
        if effect in members
        for other in members
        if other not in effects
    ]
    if not wanted:
        return Rivals((), ())
    stored = {tuple(other.model_spec.get("effects", ())): other for other in _of_same_data(warehouse, one)}
    sets, remarks = [], []
    for names in dict.fromkeys(wanted):
        try:
            sets.append(stored[names] if names in stored else _made(warehouse, one, names, progress))
        except KempfError as error:
            remarks.append(f"{' + '.join(names)} fits as well and is not among the models: {error.message}")
    return Rivals(tuple(sets), tuple(remarks))


def _same_data(inputs: Mapping[str, Any], one: ParameterSet) -> bool:
    own: Mapping[str, Any] = one.provenance.get("inputs") or {}
    return _manoeuvres(inputs) == _manoeuvres(own) and inputs.get("profile_sha256") == own.get("profile_sha256")


def _manoeuvres(inputs: Mapping[str, Any]) -> list[str]:
    """Return the bounds of the manoeuvres in some inputs; sets that were brought forward have them in another order."""
    return sorted(canonical_json(bounds) for bounds in inputs.get("segments") or ())


def _of_same_data(warehouse: Warehouse, one: ParameterSet) -> list[ParameterSet]:
    """Return the stored sets of the same manoeuvres and estimator, in the order of their ids."""
    names = sorted(parameter_sets.summaries(warehouse, one.vessel)["parameter_set_id"].to_list())
    every = parameter_sets.get_all(warehouse, one.vessel, names)
    return [
        other
        for other in every
        if other.estimator == one.estimator and _same_data(other.provenance.get("inputs") or {}, one)
    ]


def _made(warehouse: Warehouse, one: ParameterSet, names: tuple[str, ...], progress: Progress) -> ParameterSet:
    spec, own = model_of(one)
    chosen = choose(warehouse, one.vessel)
    made, _ = store_model(warehouse, chosen, spec.model_copy(update={"effects": names}), own, progress)
    return made
