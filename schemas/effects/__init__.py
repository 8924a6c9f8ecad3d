"""The catalogue: one file an effect, in the form of a user's own effect files. Adding one is adding a file here."""

from __future__ import annotations

from difflib import get_close_matches
from functools import cache
from importlib.resources import files

from kempf.schemas.effect import Effect
from kempf.schemas.effect_file import invalid, read
from kempf.schemas.errors import KempfError, NotFound, UsageError
from kempf.schemas.instrument_noise import NAMES

__all__ = ["catalogue", "get", "names", "require_free"]

_FOLDER = files(__name__)


def names() -> tuple[str, ...]:
    """Return the names of the catalogue's effects in alphabetical order; no file is read."""
    return tuple(sorted(f.name.removesuffix(".yaml") for f in _FOLDER.iterdir() if f.name.endswith(".yaml")))


def catalogue() -> dict[str, Effect]:
    """Return every effect by name, in alphabetical order.

    Raises
    ------
    KempfError
        ``catalogue_invalid``: a file is no effect file, or its effect bears another name than the file.
    """
    return {name: _effect(name) for name in names()}


def get(name: str) -> Effect:
    """Return an effect of the catalogue.

    Raises
    ------
    NotFound
        ``effect_unknown``.
    """
    known = names()
    if name not in known:
        close = get_close_matches(name[:60], known, n=1)
        hint = f"; did you mean {close[0]!r}?" if close else "."
        raise NotFound(
            "effect_unknown",
            f"The catalogue has no effect {name[:60]!r}{hint}",
            "`kempf effects list` names them all.",
            {"effect": name[:60]},
        )
    return _effect(name)


def require_free(name: str) -> None:
    """Refuse the name of an effect of the catalogue for a user's own.

    Raises
    ------
    UsageError
        ``effect_name``.
    """
    if name in NAMES:
        raise UsageError(
            "effect_name",
            f"{name!r} is the name of a noise of instruments; your own effect needs another name.",
            f"Rename it, my_{name} say.",
            {"effect": name},
        )
    if name in names():
        raise UsageError(
            "effect_name",
            f"{name!r} is an effect of the catalogue; your own effect needs another name.",
            f"Rename it, my_{name} say; `kempf effects show {name}` shows the catalogue's, `kempf effects add {name}` "
            "takes it.",
            {"effect": name},
        )


@cache
def _effect(name: str) -> Effect:
    file = f"{name}.yaml"
    where = f"schemas/effects/{file}"
    try:
        effect = read(_FOLDER.joinpath(file).read_text(encoding="utf-8"), where)
        if effect.name != name:
            raise invalid(where, f"its effect is called {effect.name!r}; a file bears the name of its effect")
    except UsageError as error:
        next_step = "Correct the file, or take it out of the folder; docs/effects.md shows one that works."
        raise KempfError("catalogue_invalid", error.message, next_step, {"file": file}) from error
    return effect
