"""A formula that was tried: what its refits found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def refits(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the refits of what `kempf effects try --json` prints, with how many manoeuvres each improves."""
    sets = [*document["sets"], *document["immaterial"], *document["stand_ins"]]
    rows = [refit for group in sets for refit in group["refits"]] + list(document["refused"])
    return [{"why": "", **refit, **_better(refit)} for refit in rows]


def _better(refit: Mapping[str, Any]) -> dict[str, int]:
    gains = [*refit["gains_left_out"], *refit["gains_held_out"]]
    return {"better": sum(gain > 0 for gain in gains), "of": len(gains)}
