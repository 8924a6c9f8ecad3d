"""Why a vessel has no current set though she had one, in words, and what helps."""

from __future__ import annotations

import shlex

from kempf.schemas.errors import NotFound
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets, segments


def why_withdrawn(warehouse: Warehouse, vessel: str, withdrawn: str) -> tuple[str, list[str]]:
    """Return why no set of a vessel is current, a phrase, and the commands that help.

    Parameters
    ----------
    withdrawn : str
        Id of the set that was current.
    """
    name = shlex.quote(vessel)
    reprocess = [f"kempf reprocess --vessel {name}"]
    try:
        former = parameter_sets.stored_anywhere(warehouse, withdrawn, vessel).vessel
    except NotFound:
        anew = [f"kempf params alias current ID --vessel {name}", f"kempf identify --vessel {name}"]
        return f"{withdrawn} is not in the warehouse any more", anew
    if former != vessel:
        return f"her model, {withdrawn}, is still one of her earlier name, {former!r}", reprocess
    if any(segment.is_fitted for segment in segments.found_in(warehouse, vessel)):
        return f"what {withdrawn} rests on was corrected or removed", reprocess
    return (
        "in her logs, as they are read now, no manoeuvre is found that a model is fitted to",
        [f"kempf segments --vessel {name}", "kempf doctor LOG", f"kempf vessels set {name} --profile FILE"],
    )
