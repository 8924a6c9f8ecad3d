"""A vessel: her profile, and which folders of the tables are hers."""

from __future__ import annotations

from typing import Any

from kempf.warehouse.storage.keys import vessel_key
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels


def vessel_document(warehouse: Warehouse, name: str) -> dict[str, Any]:
    """Return the current profile of a vessel and the hashes of all its versions.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    versions = vessels.versions(warehouse, name)
    return {
        "vessel": name,
        "profile": versions[-1].profile.model_dump(mode="json", exclude_none=True),
        "versions": [v.profile_sha256 for v in versions],
        "partition": f"vessel_key={vessel_key(name)}",
    }
