"""A whole log read at once, for tests and benchmarks that look at all of it; ingest takes it part by part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import polars as pl

from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.read import read_parts
from kempf.pipeline.ingest.readings import Readings, Tally
from kempf.schemas.profile import VesselProfile


def read_log(name: str, log: bytes | LogFile, profile: VesselProfile) -> Readings:
    """Read one log and hold all of it; arguments and errors as in `read_parts`.

    Returns
    -------
    Readings
        In canonical channels, SI and UTC, with everything that was refused and why.
    """
    return joined(list(read_parts(name, log, profile)))


def joined(parts: Sequence[Readings]) -> Readings:
    """Return the parts of a log as one; notes and what is lost are those of the last."""
    if len(parts) == 1:
        return parts[0]
    return replace(
        parts[-1],
        # a part may hold back records for the next one
        frame=pl.concat([part.frame for part in parts]).sort("record", maintain_order=True),
        rejected=pl.concat([part.rejected for part in parts]).sort(
            "record", "channel", nulls_last=False, maintain_order=True
        ),
        tally=sum((part.tally for part in parts), Tally()),
    )
