"""What ingest refused because it lies outside the physical range of its channel, counted: it is in no series."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import polars as pl

#: The reason as it stands in the ledger of what was refused.
_OUT_OF_RANGE = "out_of_range"


def count(rejections: Iterable[pl.DataFrame]) -> dict[tuple[str, str | None], int]:
    """Count the refused values by source and channel; a record that was refused whole has no channel.

    Parameters
    ----------
    rejections : iterable of polars.DataFrame
        Schema `kempf.pipeline.ingest.readings.REJECTED_SCHEMA`, in parts.
    """
    counts: dict[tuple[str, str | None], int] = {}
    for part in rejections:
        beyond = part.filter((pl.col("reason") == _OUT_OF_RANGE) & pl.col("source").is_not_null())
        for source, channel, many in beyond.group_by("source", "channel").len().iter_rows():
            counts[source, channel] = counts.get((source, channel), 0) + many
    return counts


def by_channel(refused: Mapping[tuple[str, str | None], int], sources: Mapping[str, str]) -> dict[str, int]:
    """Return the counts of the channels that a log uses; what was refused whole counts for all channels of its source.

    Parameters
    ----------
    sources : mapping of str to str
        Source that serves each channel, `kempf.pipeline.channels.instruments.Instruments.sources`.

    Returns
    -------
    dict of str to int
        By channel; by source where nothing of it was kept and its channels are not known.
    """
    counts: dict[str, int] = {}
    for (source, channel), many in sorted(refused.items(), key=lambda item: (item[0][0], item[0][1] or "")):
        served = [name for name, whose in sources.items() if whose == source]
        if channel is not None:
            names = [channel] if sources.get(channel, source) == source else []
        else:
            names = served or [source]
        for name in names:
            counts[name] = counts.get(name, 0) + many
    return counts
