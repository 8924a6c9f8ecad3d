"""The models of a vessel that fit as well as a given one: members of her diagnosis' confusion sets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.standing_model import SEARCH, inputs_of, model_of
from kempf.flows.jobs.identify.vessel_model import store_model
from kempf.flows.process.progress import Progress, silent
from kempf.schemas.enumeration import as_words, listed
from kempf.schemas.errors import KempfError, NotFound
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.code import code_version
from kempf.warehouse.storage.canonical import canonical_json
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import diagnoses, parameter_sets
from kempf.warehouse.tables.diagnoses import StoredDiagnosis
from kempf.warehouse.tables.parameter_set import ParameterSet

#: Verdicts that leave something.
_LEFT = ("partly_explained", "unexplained")


@dataclass(frozen=True)
class Rivals:
    """Models beside a given one."""

    sets: tuple[ParameterSet, ...]
    #: What a user should know of how they were found, sentences.
    remarks: tuple[str, ...]
    #: What the diagnoses say against the given model, sentences.
    against: tuple[str, ...] = ()


def rivals_of(warehouse: Warehouse, parameter_set: ParameterSet, progress: Progress = silent) -> Rivals:
    """Return the sets of the models that fit the data of a set as well as its own.

    The confusion sets of the vessel's diagnoses of the same manoeuvres name the effects that fit alike, of the present
    code where there are such: a diagnosis that began from the model with its effects has none of them. A model with
    another member in an effect's place is read where it is stored, and fitted to the same manoeuvres and stored where
    it is not; where other manoeuvres are chosen by now there is a remark in its place. No alias moves.

    Parameters
    ----------
    parameter_set : ParameterSet
        The set that is asked for.
    """
    effects = tuple(parameter_set.model_spec.get("effects", ()))
    candidates = [
        d for d in diagnoses.of_vessel(warehouse, parameter_set.vessel) if _same_data(d.inputs, parameter_set)
    ]
    if not candidates:
        return Rivals(
            (), ("no diagnosis says which models fit as well: this one is taken alone; see `kempf diagnose`",)
        )
    present = code_version.fingerprint("diagnose")
    candidates = [d for d in candidates if d.code_version == present] or candidates
    against = _against(candidates, effects)
    alike = [
        tuple(entry["effects"]) for d in candidates for entry in d.content.get("sets", ()) if len(entry["effects"]) > 1
    ]
    rivals = [
        tuple(other if name == effect else name for name in effects)
        for effect in effects
        for members in alike
        if effect in members
        for other in members
        if other not in effects
    ]
    if not rivals:
        return Rivals((), (), against)
    stored = {
        tuple(other.model_spec.get("effects", ())): other for other in _other_effects_alone(warehouse, parameter_set)
    }
    sets, remarks = [], []
    for names in dict.fromkeys(rivals):
        try:
            sets.append(stored[names] if names in stored else _made(warehouse, parameter_set, names, progress))
        except KempfError as error:
            remarks.append(f"{' + '.join(names)} fits as well and is not among the models: {error.message}")
    return Rivals(tuple(sets), tuple(remarks), against)


def _against(found: Sequence[StoredDiagnosis], effects: Sequence[str]) -> tuple[str, ...]:
    """Say which effects a model lacks by diagnoses of it, or of models with some of its effects, and what is left."""
    of_less = [d for d in found if set((d.inputs.get("model") or {}).get("effects") or ()) <= set(effects)]
    missing: dict[str, str] = {}
    for diagnosis in of_less:
        for entry in diagnosis.content.get("sets", ()):
            if not set(effects) & set(entry["effects"]):
                missing.setdefault(" or ".join(entry["effects"]), diagnosis.diagnosis_id)
    if missing:
        return (
            f"{listed(list(dict.fromkeys(missing.values())))} found that the model lacks {listed(list(missing))}: that "
            "is in no interval of this set until it is added to the model",
        )
    apart = [d.diagnosis_id for d in of_less if d.content.get("unresolved")]
    if apart:
        return (f"{max(apart)} says that readings are too far apart: what the model may lack is in no interval",)
    left = [d for d in of_less if d.verdict in _LEFT]
    if not left:
        return ()
    one = max(left, key=lambda d: d.diagnosis_id)
    return (f"{one.diagnosis_id} says {as_words(one.verdict)}: what no known effect explains is in no interval",)


def _inputs(parameter_set: ParameterSet) -> Mapping[str, Any]:
    inputs: Mapping[str, Any] = parameter_set.provenance.get("inputs") or {}
    return inputs


def _same_data(inputs: Mapping[str, Any], parameter_set: ParameterSet) -> bool:
    own = _inputs(parameter_set)
    return _manoeuvres(inputs) == _manoeuvres(own) and inputs.get("profile_sha256") == own.get("profile_sha256")


def _manoeuvres(inputs: Mapping[str, Any]) -> list[str]:
    """Return the bounds of the manoeuvres in some inputs; sets that were brought forward have them in another order."""
    return sorted(canonical_json(bounds) for bounds in inputs.get("segments") or ())


def _other_effects_alone(warehouse: Warehouse, parameter_set: ParameterSet) -> list[ParameterSet]:
    """Return the stored sets that differ from a set in the effects of their model alone, in the order of their ids.

    With one of another current or wind, or of other code, the interval of the effects would hold what is another model
    of the surroundings, or another version of the estimator.
    """
    names = sorted(parameter_sets.summaries(warehouse, parameter_set.vessel)["parameter_set_id"].to_list())
    every = parameter_sets.get_all(warehouse, parameter_set.vessel, names)
    own = _beside_effects(_inputs(parameter_set))
    return [
        other for other in every if _same_data(_inputs(other), parameter_set) and _beside_effects(_inputs(other)) == own
    ]


def _beside_effects(inputs: Mapping[str, Any]) -> tuple[Any, ...]:
    # a model's name and parent change no estimate; a setting that an older set does not have is the default
    model = ModelSpec.model_validate(inputs.get("model") or {}).model_dump(exclude={"effects", "name", "parent"})
    search = (inputs.get("settings") or {}).get(SEARCH)
    return model, search, inputs.get("estimator"), inputs.get("code_version")


def _made(
    warehouse: Warehouse, parameter_set: ParameterSet, names: tuple[str, ...], progress: Progress
) -> ParameterSet:
    spec, own = model_of(parameter_set)
    spec, search = spec.model_copy(update={"effects": names}), parameter_set.settings.get(SEARCH)
    chosen = choose(warehouse, parameter_set.vessel)
    if not _same_data(inputs_of(chosen, spec, own, search).as_json(), parameter_set):
        raise NotFound(
            "other_manoeuvres",
            "fitted now it would rest on other manoeuvres than the set",
            "Diagnose the vessel again, and predict by the set that follows.",
        )
    rival, _ = store_model(warehouse, chosen, spec, own, progress, search=search)
    return rival
