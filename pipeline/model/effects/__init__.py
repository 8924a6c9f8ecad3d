"""The catalogue: one file an effect, each with an ``EFFECT`` of the file's name. Adding one is adding a file here."""

from __future__ import annotations

import pkgutil
from difflib import get_close_matches
from importlib import import_module

from kempf.pipeline.model.terms.content import as_json, digest
from kempf.pipeline.model.terms.effect import Effect
from kempf.pipeline.model.terms.own import from_expression
from kempf.pipeline.model.terms.own_file import from_file
from kempf.schemas.errors import KempfError, NotFound

__all__ = ["as_json", "catalogue", "digest", "from_expression", "from_file", "get"]


def catalogue() -> dict[str, Effect]:
    """Return every effect of this folder by name, in alphabetical order.

    Returns
    -------
    dict of str to Effect

    Raises
    ------
    KempfError
        ``catalogue_invalid``: a file cannot be imported, has no ``EFFECT``, or one whose name is not the file's.
    """
    found: dict[str, Effect] = {}
    for name in sorted(module.name for module in pkgutil.iter_modules(__path__)):
        try:
            effect = getattr(import_module(f"kempf.pipeline.model.effects.{name}"), "EFFECT", None)
        except Exception as error:  # whatever a file does when it is imported, its name must be told
            raise _wrong(name, f"importing it raised {type(error).__name__}: {error}") from error
        if not isinstance(effect, Effect):
            raise _wrong(name, "it defines no EFFECT = Effect(...)")
        if effect.name in found:
            raise _wrong(name, f"its effect is called {effect.name!r}, as another file's is")
        if effect.name != name:
            raise _wrong(name, f"its effect is called {effect.name!r}; a file bears the name of its effect")
        found[name] = effect
    return found


def get(name: str) -> Effect:
    """Return an effect of the catalogue.

    Parameters
    ----------
    name : str

    Raises
    ------
    NotFound
        ``effect_unknown``.
    """
    known = catalogue()
    if name not in known:
        close = get_close_matches(name[:60], known, n=1)
        hint = f"; did you mean {close[0]!r}?" if close else "."
        raise NotFound(
            "effect_unknown",
            f"The catalogue has no effect {name[:60]!r}{hint}",
            "`kempf effects list` names them all.",
            {"effect": name[:60]},
        )
    return known[name]


def _wrong(name: str, why: str) -> KempfError:
    return KempfError(
        "catalogue_invalid",
        f"The effect file pipeline/model/effects/{name}.py cannot be used: {why}.",
        "Mend the file, or take it out of the folder; docs/effects.md shows one that works.",
        {"file": f"{name}.py"},
    )
