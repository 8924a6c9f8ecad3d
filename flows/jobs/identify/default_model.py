"""The model of a vessel where no other is named: the plain one, or that of her surroundings."""

from __future__ import annotations

from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.surroundings import default_model
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels


def default_model_of(warehouse: Warehouse, vessel: str) -> ModelSpec:
    """Return the model of a vessel where no other is named, as her profile has it now.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    return default_model(vessels.current(warehouse, vessel))
