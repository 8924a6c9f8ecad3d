"""A formula that was tried: what its refits found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def refits(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the refits of what `kempf effects try --json` prints, with how many manoeuvres each improves."""
    sets = [*document["sets"], *document["immaterial"], *document["stand_ins"]]
    found = [refit for one in sets for refit in one["refits"]] + list(document["refused"])
    return [{"why": "", **one, **_better(one)} for one in found]


def _better(refit: Mapping[str, Any]) -> dict[str, int]:
    gains = [*refit["gains_left_out"], *refit["gains_held_out"]]
    return {"better": sum(gain > 0 for gain in gains), "of": len(gains)}
