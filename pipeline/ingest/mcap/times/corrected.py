"""What became of the times of an MCAP log's messages."""

from __future__ import annotations

from dataclasses import dataclass

from kempf.pipeline.ingest.decoded import Nanoseconds


@dataclass(frozen=True, eq=False)
class Corrected:
    """Times that replace those as recorded."""

    #: By source, shapes (n,). Only of sources whose times change.
    times_ns: dict[str, Nanoseconds]
    #: What a person should know.
    notes: tuple[str, ...] = ()
