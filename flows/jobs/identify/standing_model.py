"""The current model with effects of a vessel, read and pointed to: aliases, parents, a person's own effects.

What is stored is read here; nothing is fitted, so that to show a model costs no more than to read it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import EllipsisType
from typing import Any

from kempf.flows.jobs.identify.chosen_manoeuvres import Chosen
from kempf.flows.jobs.identify.chosen_set import chosen_set
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.schemas import effects
from kempf.schemas.effect import Effect
from kempf.schemas.effect_file import read
from kempf.schemas.errors import NotFound
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets, vessels
from kempf.warehouse.tables.parameter_set import Bounds, Inputs, ParameterSet, parameter_set_id

#: the estimator of these sets, its name in earlier versions where the model has effects, and that of single manoeuvres
POOLED, WITH_EFFECTS, SINGLE = "ml-pooled", "ml-effects", "ml"
#: key of a pooled set's settings that holds those of its search, where they are not the defaults
SEARCH = "search"


@dataclass(frozen=True)
class Own:
    """Effects of a person's own: their text by name, formulas or a whole file."""

    formulas: Mapping[str, Sequence[str]] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)

    def effects(self) -> dict[str, Effect]:
        """Return the effects that the texts describe."""
        by_name = {name: read(text, name) for name, text in self.files.items()}
        if self.formulas:
            from kempf.pipeline.model.terms.own import from_expression

            by_name |= {name: from_expression(tuple(texts), name) for name, texts in self.formulas.items()}
        return by_name

    def as_json(self) -> dict[str, Any]:
        """Return the texts as JSON content."""
        return {
            "formulas": {name: list(texts) for name, texts in sorted(self.formulas.items())},
            "files": dict(sorted(self.files.items())),
        }

    @staticmethod
    def from_json(content: Mapping[str, Any]) -> Own:
        """Return what `as_json` gave."""
        return Own(
            {name: tuple(texts) for name, texts in content.get("formulas", {}).items()}, dict(content.get("files", {}))
        )

    def beside(self, other: Own) -> Own:
        """Return the effects of both; of one name the other's.

        Raises
        ------
        UsageError
            ``effect_name``: one of the other's is called as one of the catalogue is.
        """
        for name in (*other.formulas, *other.files):
            effects.require_free(name)
        return Own({**self.formulas, **other.formulas}, {**self.files, **other.files})


NONE_OF_ONES_OWN = Own()


def known_effects(own: Own) -> dict[str, Effect]:
    """Return the catalogue and a person's own effects by name."""
    return {**effects.catalogue(), **own.effects()}


def named(names: Sequence[str], known: Mapping[str, Effect]) -> tuple[Effect, ...]:
    """Return effects by name, in order.

    Raises
    ------
    NotFound
        ``effect_unknown``.
    """
    return tuple(known[name] if name in known else effects.get(name) for name in names)


def inputs_of(chosen: Chosen, spec: ModelSpec, own: Own, search: Mapping[str, Any] | None = None) -> Inputs:
    """Return all that a model's parameter set is a function of.

    Parameters
    ----------
    spec : ModelSpec
        ``effects`` names them in order.
    own : Own
        Those that are not in the catalogue.
    search : mapping, optional
        Settings of the search that differ from the defaults.
    """
    settings = {"segments": [s.segment_id for s in chosen.segments], **effect_settings(spec, own)}
    return Inputs(
        log_ids=tuple(s.log_id for s in chosen.segments),
        profile_sha256=chosen.profile_sha256,
        bounds=tuple(Bounds(s.log_id, s.start_utc_ns, s.end_utc_ns) for s in chosen.segments),
        model_spec=spec.model_dump(mode="json"),
        estimator=POOLED,
        settings={**settings, **({SEARCH: dict(search)} if search else {})},
        code_version=chosen.code_version,
        draughts_m=chosen.draughts_m if goes_by_load(spec, own) else {},
    )


def goes_by_load(spec: ModelSpec, own: Own) -> bool:
    """Return whether an effect of a model goes by how the ship is laden in each log."""
    return any(effect.uses("day") for effect in named(spec.effects, known_effects(own)))


def stored_model(
    warehouse: Warehouse, chosen: Chosen, spec: ModelSpec, own: Own, search: Mapping[str, Any] | None = None
) -> ParameterSet | None:
    """Return the parameter set of a model of these manoeuvres, None where it is not stored yet."""
    name = parameter_set_id(inputs_of(chosen, spec, own, search))
    there = set(parameter_sets.summaries(warehouse, chosen.vessel)["parameter_set_id"].to_list())
    return parameter_sets.get(warehouse, name, chosen.vessel) if name in there else None


def effect_settings(spec: ModelSpec, own: Own) -> dict[str, Any]:
    """Return what pins the effects of a model: their digests, and the texts of those that are not in the catalogue."""
    used = named(spec.effects, known_effects(own))
    in_model = Own(
        {n: t for n, t in own.formulas.items() if n in spec.effects},
        {n: t for n, t in own.files.items() if n in spec.effects},
    )
    return {"effects": {effect.name: effect.sha256 for effect in used}, "own": in_model.as_json()}


def point(warehouse: Warehouse, model: ParameterSet, expected: str | EllipsisType | None = ...) -> None:
    """Make a model the vessel's current one in place of a set; errors are those of `aliases.point`."""
    aliases.point(warehouse, model.vessel, model.parameter_set_id, expected=expected)


def current_id(warehouse: Warehouse, vessel: str) -> str | None:
    """Return the id of a vessel's current set, None where she has none."""
    return aliases.of_vessel(warehouse, vessel).get(aliases.CURRENT)


def require_current(warehouse: Warehouse, vessel: str, shown: str | None) -> str | None:
    """Return the id of a vessel's current set, which must be the one that was shown.

    Parameters
    ----------
    shown : str or None
        Empty where it was shown that she has none, None where nobody looked.

    Raises
    ------
    UsageError
        ``moved_meanwhile``.
    """
    now = current_id(warehouse, vessel)
    if shown is not None and shown != (now or ""):
        raise aliases.moved_meanwhile(vessel, now, shown)
    return now


def standing(warehouse: Warehouse, vessel: str) -> ParameterSet | None:
    """Return a vessel's current model, None where her current set is of no model of this kind."""
    name = current_id(warehouse, vessel)
    return _if_model(parameter_sets.get(warehouse, name, vessel)) if name else None


def current_effects(warehouse: Warehouse, only: str | None = None) -> dict[str, tuple[str, ...]]:
    """Return the effects in the current set of every vessel that has one, or of one vessel, in order."""
    held = aliases.holders(warehouse, aliases.CURRENT)
    chosen = {vessel: name for vessel, name in held.items() if only in (None, vessel)}
    models = parameter_sets.specifications(warehouse, list(chosen.values()))
    return {vessel: tuple(models.get(name, {}).get("effects") or ()) for vessel, name in chosen.items()}


def standing_or_withdrawn(warehouse: Warehouse, vessel: str) -> ParameterSet | None:
    """Return a vessel's current model or, where it was withdrawn and none came after it, that one; else None.

    It is as it is stored: which model it is stands there, also where a set that it brings forward is lost.

    Raises
    ------
    NotFound
        ``no_parameter_set``: it is lost.
    """
    name = aliases.of_model(aliases.of_vessel(warehouse, vessel))
    return _if_model(parameter_sets.stored_anywhere(warehouse, name, vessel)) if name else None


def _if_model(stored: ParameterSet) -> ParameterSet | None:
    return stored if stored.estimator in (POOLED, WITH_EFFECTS) else None


def model_of(stored: ParameterSet) -> tuple[ModelSpec, Own]:
    """Return the model of a stored set and the effects of a person's own in it."""
    return ModelSpec.model_validate(dict(stored.model_spec)), Own.from_json(stored.settings.get("own") or {})


def standing_model(warehouse: Warehouse, vessel: str) -> tuple[ModelSpec, Own]:
    """Return a vessel's model, also where its set was withdrawn; the one of her surroundings where she has none yet."""
    now = standing_or_withdrawn(warehouse, vessel)
    return model_of(now) if now else (default_model_of(warehouse, vessel), Own())


def undo(warehouse: Warehouse, vessel: str, shown: str | None = None) -> ParameterSet:
    """Make the parent of a vessel's current model the current one; nothing is deleted.

    Parameters
    ----------
    shown : str, optional
        Id of the set that was taken to be her current one.

    Raises
    ------
    NotFound
        ``no_vessel``, ``no_parent``; ``no_parameter_set``: her current one was withdrawn.
    UsageError
        ``moved_meanwhile``.
    """
    vessels.require(warehouse, vessel)
    require_current(warehouse, vessel, shown)
    now = standing(warehouse, vessel)
    if now is None and aliases.WITHDRAWN in aliases.of_vessel(warehouse, vessel):
        chosen_set(warehouse, vessel)  # says what was withdrawn, and what brings it back
    if now is None or now.parent is None:
        raise NotFound(
            "no_parent",
            f"There is nothing to undo: {vessel!r} has {'no current model' if now is None else 'the plain model'}.",
            f"See `kempf ladder --vessel {vessel}`.",
        )
    before = parameter_sets.get(warehouse, now.parent, vessel)
    point(warehouse, before, now.parameter_set_id)
    return before


def _chain(warehouse: Warehouse, model: ParameterSet) -> list[ParameterSet]:
    """Return a model and its parents, the plain one first."""
    chain = [model]
    while chain[0].parent is not None:
        chain.insert(0, parameter_sets.get(warehouse, chain[0].parent, model.vessel))
    return chain


def rungs_to(warehouse: Warehouse, model: ParameterSet) -> list[dict[str, Any]]:
    """Return the rungs of the ladder that lead to a model, the plain one first, as JSON content."""
    return [
        {**parameter_set.fit["rung"], "step": step, "parameter_set_id": parameter_set.parameter_set_id}
        for step, parameter_set in enumerate(_chain(warehouse, model))
    ]
