"""The addresses of the pages: ids as they are, a vessel by her name where that is a plain word."""

from __future__ import annotations

import re

from kempf.schemas.errors import NotFound
from kempf.warehouse.storage.keys import segment_of_address, vessel_key
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels

#: What an id looks like, by what it begins with; a log's is the SHA-256 of its bytes.
_KINDS = (
    (re.compile(r"seg-[0-9a-f]{4,16}"), "/segments/"),
    (re.compile(r"ps-[0-9a-f]{4,16}"), "/sets/"),
    (re.compile(r"dx-[0-9a-f]{4,16}"), "/diagnoses/"),
    (re.compile(r"[0-9a-f]{8,64}"), "/logs/"),
)


def of_vessel(name: str) -> str:
    """Return the address of a vessel's page.

    Examples
    --------
    >>> of_vessel("ferry")
    '/v/ferry'
    >>> of_vessel("../etc").startswith("/v/~")
    True
    """
    return "/v/" + segment_of_address(name)


def vessel_at(warehouse: Warehouse, segment: str) -> str:
    """Return the vessel whose address has this segment of a path.

    Raises
    ------
    NotFound
        ``no_vessel``, ``no_warehouse``.
    """
    if segment.startswith("~"):
        for name in vessels.names(warehouse):
            if vessel_key(name) == segment[1:]:
                return name
        raise NotFound(
            "no_vessel", f"No vessel has the address {segment!r}.", "Go to the fleet's page for those there are."
        )
    vessels.require(warehouse, segment)
    return segment


def address_of(warehouse: Warehouse, query: str) -> str:
    """Return the address of what a person typed: an id, its beginning, or the name of a vessel or an effect.

    Raises
    ------
    NotFound
        ``nothing_of_this_name``.
    """
    from kempf.schemas.effects import catalogue

    text = query.strip()
    if text in vessels.names(warehouse):
        return of_vessel(text)
    # as the pages write it too, and by the title
    effect = text.casefold().replace(" ", "_")
    by_title = {one.title.casefold(): one.name for one in catalogue().values()}
    if effect in catalogue() or text.casefold() in by_title:
        return f"/effects/{effect if effect in catalogue() else by_title[text.casefold()]}"
    for form, begin in _KINDS:
        if form.fullmatch(text):
            return begin + text
    raise NotFound(
        "nothing_of_this_name",
        f"{query[:100]!r} is neither a vessel, an effect, nor the id of a log, manoeuvre, parameter set or diagnosis.",
        "Ids begin with seg-, ps- or dx-, a log's is a hash; the fleet's page lists the vessels.",
    )
