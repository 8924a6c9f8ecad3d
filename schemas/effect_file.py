"""Reading an effect file: YAML of the form of `kempf.schemas.effect.Effect`, the catalogue's and a user's own alike."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from kempf.schemas import yaml_text
from kempf.schemas.effect import Effect
from kempf.schemas.errors import UsageError
from kempf.schemas.faults import faults_of

_LONGEST = 50_000
_NEXT = "Correct it; docs/effects.md shows an effect file that works."


def read(text: str, where: str) -> Effect:
    """Read an effect file; whether its formulas can be computed is not looked at here.

    Parameters
    ----------
    text : str
        Its content, YAML.
    where : str
        Its name, for the messages.

    Raises
    ------
    UsageError
        ``effect_file_invalid``: one message that names the file and the key, whatever is wrong with it.
    """
    content = _content(text, where)
    try:
        return Effect.model_validate(content)
    except ValidationError as error:
        faults = faults_of(error, "file", content)
        raise invalid(where, "; ".join(faults[:5]), {"faults": faults}) from error


def invalid(where: str, why: str, details: Mapping[str, Any] | None = None, next_step: str = _NEXT) -> UsageError:
    """Return the error of an effect file that cannot be used.

    Parameters
    ----------
    where, why : str
        Name of the file, and what is wrong with it.
    """
    return UsageError(
        "effect_file_invalid",
        f"{where} is not a valid effect file: {why}.",
        next_step,
        {"file": where, **(details or {})},
    )


def _content(text: str, where: str) -> dict[str, Any]:
    if len(text) > _LONGEST:
        raise invalid(where, f"it is {len(text)} characters long, {_LONGEST} is the most")
    try:
        content = yaml_text.load(text)
    except yaml_text.NotYaml as error:
        raise invalid(where, f"it is not valid YAML: {str(error)[:300]}") from error
    if not isinstance(content, dict):
        raise invalid(where, f"expected keys such as 'name' and 'terms', found {type(content).__name__}")
    return content
