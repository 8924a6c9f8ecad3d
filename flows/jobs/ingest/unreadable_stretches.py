"""Lost stretches of a log as they are shown to a person and to a program."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from kempf.pipeline.ingest.decoded import LostStretch
from kempf.schemas.instants import iso_utc


def as_json(lost: Sequence[LostStretch]) -> list[dict[str, Any]]:
    """Return stretches as JSON content, times in ISO 8601."""
    return [
        {
            "since": None if stretch.since_ns is None else iso_utc(stretch.since_ns),
            "until": None if stretch.until_ns is None else iso_utc(stretch.until_ns),
            "messages": stretch.messages,
            "why": stretch.why,
        }
        for stretch in lost
    ]
