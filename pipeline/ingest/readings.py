"""What every reader returns: the readings of one log, what was refused, and the count of both.

A *record* is one line, row or message of the log; a *value* is one canonical channel in one record. A record is kept
when it gives at least one value, else it is rejected with a reason; a value of a kept record may be rejected by itself.
The ledger of values is that of the kept records: what a refused record may have held is not guessed at.
Both ledgers close: read = kept + rejected.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Protocol

import polars as pl

from kempf.pipeline.ingest.decoded import LostStretch
from kempf.schemas.channels import CHANNEL_COLUMNS

#: Columns of `Readings.frame`; the channel columns are Float64 in SI, null where the record does not carry them;
#: ``instant_std_s`` is null where the log has the instant.
READING_SCHEMA: dict[str, pl.DataType] = {
    "record": pl.Int64(),
    "time_utc_ns": pl.Int64(),
    "instant_std_s": pl.Float64(),
    "source": pl.String(),
    **{column: pl.Float64() for column in CHANNEL_COLUMNS},
}

#: Columns of `Readings.rejected`. ``channel`` is null where the whole record is refused.
REJECTED_SCHEMA: dict[str, pl.DataType] = {
    "record": pl.Int64(),
    "time_utc_ns": pl.Int64(),
    "source": pl.String(),
    "channel": pl.String(),
    "reason": pl.String(),
    "raw": pl.String(),
}


@dataclass(frozen=True)
class Tally:
    """The ledger of one log."""

    records_read: int = 0
    records_kept: int = 0
    records_rejected: int = 0
    values_read: int = 0
    values_kept: int = 0
    values_rejected: int = 0
    #: number of rejected records and values by reason, sorted by reason
    by_reason: dict[str, int] = field(default_factory=dict)

    def __add__(self, other: Tally) -> Tally:
        """Return the ledger of two parts of a log."""
        reasons = sorted({*self.by_reason, *other.by_reason})
        return Tally(
            self.records_read + other.records_read,
            self.records_kept + other.records_kept,
            self.records_rejected + other.records_rejected,
            self.values_read + other.values_read,
            self.values_kept + other.values_kept,
            self.values_rejected + other.values_rejected,
            {reason: self.by_reason.get(reason, 0) + other.by_reason.get(reason, 0) for reason in reasons},
        )


class LogReadings(Protocol):
    """What was read of one log, wherever its rows are kept: `Readings`, or more of them than memory should hold."""

    @property
    def tally(self) -> Tally:
        """Closes against all rows."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """What a person should know."""
        ...

    @property
    def format(self) -> str:
        """How the file was read."""
        ...

    @property
    def lost(self) -> tuple[LostStretch, ...]:
        """What could not be read."""
        ...

    def lazy(self) -> pl.LazyFrame:
        """Return the readings, for those who want some columns of them."""
        ...

    def frames(self) -> Iterator[pl.DataFrame]:
        """Yield the readings, part by part."""
        ...

    def rejections(self) -> Iterator[pl.DataFrame]:
        """Yield what was refused, part by part."""
        ...


@dataclass(frozen=True)
class Readings:
    """The readings of one log, or of a part of it."""

    #: Schema `READING_SCHEMA`, sorted by record; at least one non-null channel in each row.
    frame: pl.DataFrame
    #: Schema `REJECTED_SCHEMA`, sorted by record then channel.
    rejected: pl.DataFrame
    #: Closes against both frames and the number of records in the file.
    tally: Tally
    #: What a person should know of how the file was read, one sentence each.
    notes: tuple[str, ...] = ()
    #: One of {"delimited", "mcap", "nmea"}. How the file was read.
    format: str = ""
    #: What of a damaged log could not be read, in the order of the file; empty for a whole one.
    lost: tuple[LostStretch, ...] = ()

    @property
    def partial(self) -> bool:
        """Whether something of the log is lost."""
        return bool(self.lost)

    def lazy(self) -> pl.LazyFrame:
        """Return the readings, for those who want some columns of them."""
        return self.frame.lazy()

    def frames(self) -> Iterator[pl.DataFrame]:
        """Yield the readings."""
        yield self.frame

    def rejections(self) -> Iterator[pl.DataFrame]:
        """Yield what was refused."""
        yield self.rejected
