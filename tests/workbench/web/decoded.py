"""The binary answer of series as the page's JavaScript reads it."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float


def decoded(answer: bytes) -> tuple[dict[str, Any], dict[str, tuple[Float, Float]]]:
    """Return the header of an answer, and seconds and values by channel."""
    line, _, rest = answer.partition(b"\n")
    head = json.loads(line)
    numbers, channels, at = np.frombuffer(rest, dtype="<f4").astype(np.float64), {}, 0
    for entry in head["series"]:
        n = entry["count"]
        channels[entry["name"]] = (numbers[at : at + n], numbers[at + n : at + 2 * n])
        at += 2 * n
    return head, channels
