"""Channels whose clock the profile sets right: a known delay, a clock that runs too fast.

The checks of the clock were made before, on the times of the log; here they are put right. A record whose
channels are late by different times becomes one row a time.
"""

from __future__ import annotations

from dataclasses import replace

import polars as pl

from kempf.pipeline.ingest.readings import READING_SCHEMA, Readings
from kempf.schemas.channels import CHANNEL_COLUMNS, CHANNELS
from kempf.schemas.profile import ChannelMap, Source

_SECOND_NS = 1e9


class OwnClocks:
    """The clocks of one log's channels, as the profile knows them.

    Parameters
    ----------
    source : Source or None
        How the log is read.
    """

    def __init__(self, source: Source | None) -> None:
        channels = source.channels if source else {}
        self._late = {key: channel for key, channel in channels.items() if channel.delay_s or channel.clock_rate != 1.0}
        self._first: dict[str, int] = {}

    def notes(self) -> tuple[str, ...]:
        """Say what is set right."""
        return tuple(
            f"{mapped.channel}: the times of {key!r} set right by {_words(mapped)}, as the profile says"
            for key, mapped in self._late.items()
        )

    def set_right(self, readings: Readings) -> Readings:
        """Return readings at the times at which they were measured.

        Parameters
        ----------
        readings : Readings
            Screened; a log, or the part that follows on the one before.

        Returns
        -------
        Readings
            The same where no channel has a ``delay_s`` or a ``clock_rate``; nothing is added or lost, a row may be
            split.
        """
        if not self._late:
            return readings
        frame = readings.frame
        for key, mapped in self._late.items():
            frame = self._moved(frame, _of_source(readings.format, key), key, mapped)
        empty = pl.all_horizontal(pl.col(c).is_null() for c in CHANNEL_COLUMNS)
        frame = frame.filter(~empty).sort("record", "time_utc_ns", maintain_order=True).select(list(READING_SCHEMA))
        return replace(readings, frame=frame)

    def _moved(self, frame: pl.DataFrame, of_channel: pl.Expr, key: str, mapped: ChannelMap) -> pl.DataFrame:
        column = CHANNELS[mapped.channel].column
        own = frame.filter(of_channel & pl.col(column).is_not_null())
        if own.is_empty():
            return frame
        first = self._first.setdefault(key, int(own["time_utc_ns"].min()))  # type: ignore[arg-type]
        since = (pl.col("time_utc_ns") - first).cast(pl.Float64) / mapped.clock_rate - mapped.delay_s * _SECOND_NS
        others = [pl.lit(None, dtype=pl.Float64).alias(c) for c in CHANNEL_COLUMNS if c != column]
        moved = own.with_columns((first + since.round().cast(pl.Int64)).alias("time_utc_ns"), *others)
        left = frame.with_columns(pl.when(of_channel).then(None).otherwise(pl.col(column)).alias(column))
        return pl.concat([left, moved])


def _of_source(log_format: str, key: str) -> pl.Expr:
    """Return which rows an entry of the profile speaks of: all of delimited text, those of a sentence or a topic."""
    if log_format == "nmea":
        return pl.col("source") == key.partition(".")[0]
    if log_format == "mcap":
        # a topic may hold dots, a field too: the topic is what the key begins with; a second publisher has a number
        topic = pl.col("source").str.replace(r"#\d+$", "")
        return pl.any_horizontal(pl.lit(key).str.starts_with(own + ".") for own in (pl.col("source"), topic))
    return pl.lit(value=True)


def _words(mapped: ChannelMap) -> str:
    parts = [f"{mapped.delay_s:g} s"] if mapped.delay_s else []
    return " and ".join([*parts, *([f"a clock rate of {mapped.clock_rate:g}"] if mapped.clock_rate != 1.0 else [])])
