"""Storing several things in common commits, so that one that is refused does not take the others with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from kempf.flows.process.wrap_error import wrapped
from kempf.schemas.errors import KempfError

T = TypeVar("T")


def together_or_each(items: Mapping[str, T], store: Callable[[Sequence[T]], object]) -> dict[str, KempfError]:
    """Store things together; where that fails each alone.

    Parameters
    ----------
    items : mapping of str to T
        By what they are called.
    store : callable
        Stores some of them in one commit a table.

    Returns
    -------
    dict of str to KempfError
        Why some could not be stored, by what they are called.
    """
    try:
        store(list(items.values()))
    except Exception as error:  # noqa: BLE001 - reported to those that it concerns
        if len(items) == 1:
            return dict.fromkeys(items, wrapped(error))
        failed: dict[str, KempfError] = {}
        for name, item in items.items():
            failed |= together_or_each({name: item}, store)
        return failed
    return {}
