"""Which model a command begins from: a stored set's, a file's, the vessel's current one, or the plain one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from kempf.flows.jobs.identify.chosen_set import chosen_set
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN, Own, model_of, standing_model
from kempf.flows.jobs.ingest.files import read_model
from kempf.schemas.errors import UsageError
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases

_LARGEST = 100_000


def chosen_model(
    warehouse: Warehouse, vessel: str, set_id: str | None, model: Path | None, own: Own = NONE_OF_ONES_OWN
) -> tuple[ModelSpec, Own]:
    """Return the model to begin from and the effects of a person's own in it.

    Parameters
    ----------
    set_id : str or None
        Parameter set.
    model : Path or None
        Model file.
    own : Own, optional
        Effects of a person's own that the file may name.

    Raises
    ------
    UsageError
        ``two_models``, ``set_of_another_vessel``, ``model_unknown``: an effect that is not there.
    """
    if set_id is not None and model is not None:
        raise UsageError("two_models", "Both --set and --model say where to begin.", "Give one of them.")
    if model is not None:
        return _known(read_model(model), own, model), Own()
    if set_id is None:
        return standing_model(warehouse, vessel)
    return model_of(chosen_set(warehouse, vessel, set_id)[0])


def named_model(warehouse: Warehouse, vessel: str, name: str, own: Own = NONE_OF_ONES_OWN) -> tuple[ModelSpec, Own]:
    """Return the model that a file describes, or that of a parameter set of the vessel, by id or alias.

    Raises
    ------
    NotFound
        ``no_parameter_set``, or there is no such file.
    UsageError
        See `kempf.flows.jobs.ingest.files.read_model`.
    """
    path = Path(name)
    if not path.exists() and (name.startswith("ps-") or name in aliases.of_vessel(warehouse, vessel)):
        return model_of(chosen_set(warehouse, vessel, name)[0])
    return _known(read_model(path), own, path), Own()


def _known(spec: ModelSpec, own: Own, path: Path) -> ModelSpec:
    """Return a model whose effects are all in the catalogue or a person's own."""
    from kempf.schemas import effects

    lost = [name for name in spec.effects if name not in effects.names() and name not in (*own.files, *own.formulas)]
    if lost:
        raise UsageError(
            "model_unknown",
            f"{path} asks for the effect {', '.join(map(repr, lost))}, which is not in the catalogue.",
            "`kempf effects list` names them all; hand an effect of your own over with --effect-file.",
            {"base": spec.base, "effects": lost},
        )
    return spec


def read_effect_files(paths: Sequence[Path]) -> dict[str, str]:
    """Return the texts of effect files by the names of the effects in them.

    Raises
    ------
    UsageError
        ``effect_file``: there is no such file, or it is no text.
    KempfError
        What is wrong in it, with its name.
    """
    from kempf.pipeline.model.terms.own import from_file

    texts = {}
    for path in paths:
        try:
            if path.stat().st_size > _LARGEST:
                raise UsageError(
                    "effect_file", f"{path} is {path.stat().st_size} bytes long; an effect is a page.", "Name another."
                )
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise UsageError(
                "effect_file", f"{path} cannot be read: {error}.", "Name a YAML file as in docs/effects.md."
            ) from error
        texts[from_file(text, str(path)).name] = text
    return texts
