"""What became of the times of an MCAP log's messages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from kempf.pipeline.ingest.decoded import Nanoseconds


@dataclass(frozen=True, eq=False)
class Corrected:
    """Times that replace those as recorded."""

    #: By source, shapes (n,). Only of sources whose times change.
    times_ns: dict[str, Nanoseconds]
    #: What a person should know.
    notes: tuple[str, ...] = ()
    #: Standard error of these times by source, s, where messages that came together were spread.
    std_s: Mapping[str, float] = field(default_factory=dict)
