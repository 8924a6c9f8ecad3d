"""A name that is no vessel's."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

from kempf.schemas.errors import NotFound


def no_vessel(name: str, known: Iterable[str], next_step: str) -> NotFound:
    """Return the error of a name that is no vessel's.

    Parameters
    ----------
    known : iterable of str
        Names of vessels.
    next_step : str
        What to do about it, a sentence.
    """
    names = sorted(known)
    like = get_close_matches(name, names)
    hint = f"; like it: {', '.join(map(repr, like))}" if like else f"; known: {', '.join(names[:20]) or 'none'}"
    return NotFound(
        "no_vessel", f"There is no vessel {name!r}{hint}.", next_step, {"vessel": name, "known": names[:20]}
    )
