"""The channels that a chart offers."""

from __future__ import annotations

from typing import Any

from kempf.schemas.channels import CHANNELS
from kempf.workbench.charts.signs import SIGNS

#: What a model predicts and no log holds.
LATERAL = "lateral_speed"


def entry(name: str, source: str, *, shown: bool) -> dict[str, Any]:
    """Return a channel as a chart offers it."""
    channel = CHANNELS[name]
    sign = SIGNS.get(name, "")
    return {"name": name, "unit": channel.unit, "sign": sign, "words": channel.words, "source": source, "shown": shown}


def derived() -> dict[str, Any]:
    """Return the lateral speed as a channel that a chart can show beside those of a log."""
    words = "lateral speed through the water from GNSS and heading, eq. (18) of the paper"
    own = {"name": LATERAL, "unit": "m/s", "sign": SIGNS[LATERAL], "words": words, "source": "GNSS"}
    return {**own, "shown": True, "derived": True}
