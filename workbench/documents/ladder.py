"""The ladder: the models that lead to a vessel's current one, with their errors."""

from __future__ import annotations

from typing import Any

from kempf.flows.jobs.identify.chosen_set import chosen_set
from kempf.flows.jobs.identify.standing_model import current_id, rungs_to, standing
from kempf.schemas.errors import NotFound
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, vessels


def ladder_document(warehouse: Warehouse, vessel: str) -> list[dict[str, Any]]:
    """Return the rungs of a vessel's ladder, the plain model's first, as JSON content.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``, ``no_model``.
    """
    vessels.require(warehouse, vessel)
    model = standing(warehouse, vessel)
    if model is None:
        if aliases.WITHDRAWN in aliases.of_vessel(warehouse, vessel):
            chosen_set(warehouse, vessel)  # says what was withdrawn, and what brings it back
        raise NotFound(
            "no_model",
            f"{vessel!r} has no current model of several manoeuvres yet.",
            f"Run `kempf identify --vessel {vessel}`, or `kempf diagnose --vessel {vessel}`.",
            {"vessel": vessel, "current": current_id(warehouse, vessel)},
        )
    return rungs_to(warehouse, model)
