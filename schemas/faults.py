"""What is wrong with a document that a person wrote, as sentences: the key, what was found there, what was expected."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic import ValidationError

#: Letters of a found value that are shown.
_SHOWN = 40
#: Words for what pydantic expects, by the kind of its error; the numbers are of the error's context.
_EXPECTED = {
    "string_type": "text",
    "string_too_short": "text of at least {min_length} characters",
    "string_too_long": "text of at most {max_length} characters",
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "literal_error": "{expected}",
    "greater_than": "a number greater than {gt:g}",
    "greater_than_equal": "a number of at least {ge:g}",
    "less_than": "a number less than {lt:g}",
    "less_than_equal": "a number of at most {le:g}",
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": "keys with their values",
    "model_type": "keys with their values",
    "model_attributes_type": "keys with their values",
    "timezone_aware": "a time with its zone, such as 2025-05-03T12:00:00Z",
}


def faults_of(error: ValidationError, whole: str, content: Any = None) -> list[str]:
    """Say what is wrong with a document.

    Parameters
    ----------
    error : pydantic.ValidationError
    whole : str
        What the document is called where a fault is of no single key.
    content : Any, optional
        Of the document, so that entries that it names are not numbered.

    Examples
    --------
    >>> from pydantic import ValidationError
    >>> from kempf.schemas.model_spec import ModelSpec
    >>> try:
    ...     ModelSpec.model_validate({"current": "sideways", "wnid": "none"})
    ... except ValidationError as error:
    ...     faults_of(error, "model")
    ["current: found 'sideways', expected 'earth', 'lateral' or 'none'", 'wnid: there is no such key']
    """
    return [f"{_place(fault['loc'], content) or whole}: {_fault(fault)}" for fault in error.errors()]


def _place(loc: tuple[int | str, ...], content: Any) -> str:
    place = list(loc)
    entries = content.get(place[0]) if isinstance(content, Mapping) and len(place) > 1 else None
    if isinstance(entries, Mapping) and isinstance(place[1], int):
        place[1] = list(entries)[place[1]]
    return ".".join(map(str, place))[:80]


def _fault(fault: Any) -> str:
    kind, value, context = fault["type"], fault["input"], fault.get("ctx", {})
    if kind == "missing":
        return "the key is missing"
    if kind == "extra_forbidden":
        return "there is no such key"
    if kind in ("too_short", "too_long"):
        most = kind == "too_long"
        limit = context["max_length" if most else "min_length"]
        entries = "entry" if limit == 1 else "entries"
        return f"found {len(value)} entries, expected at {'most' if most else 'least'} {limit} {entries}"
    if kind == "value_error":
        return str(fault["msg"]).removeprefix("Value error, ")
    expected = _EXPECTED.get(kind)
    if expected is None:
        return f"found {_shown(value)}: {fault['msg']}"
    return f"found {_shown(value)}, expected {expected.format(**context)}"


def _shown(value: Any) -> str:
    if value is None:
        return "nothing"
    try:
        text = repr(value)
    except ValueError:  # an integer of thousands of digits is not written out
        return f"a {type(value).__name__} too long to show"
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."
