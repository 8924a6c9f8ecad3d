"""Numbers as they are typed into a form or an address."""

from __future__ import annotations

from kempf.schemas.errors import UsageError


def number_of(text: str, of: str, unit: str = "") -> float | None:
    """Return a number; None of a blank field.

    Parameters
    ----------
    of : str
        What it is, for the message.
    unit : str, optional
        In which it is expected, in words.

    Raises
    ------
    UsageError
        ``number_unreadable``.

    Examples
    --------
    >>> number_of(" 8.1", "draught"), number_of("", "draught")
    (8.1, None)
    """
    if not text.strip():
        return None
    try:
        return float(text[:40])
    except ValueError:
        expected = f"Give it in {unit}" if unit else "Give a number"
        raise UsageError(
            "number_unreadable", f"{text[:40]!r} is no {of}.", f"{expected}, or leave the field blank."
        ) from None


def whole_number(text: str) -> int | None:
    """Return the whole number that decimal digits give; None of anything else, and of more than nine digits.

    Examples
    --------
    >>> whole_number("12"), whole_number("-1"), whole_number("²"), whole_number(""), whole_number("9" * 10)
    (12, None, None, None, None)
    """
    # `isdigit` takes a superscript too, which `int` does not read
    return int(text) if text.isdecimal() and len(text) < 10 else None
