"""When the messages of a topic came, and when they say that they were made: columns for the questions of clocks."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.ingest.decoded import Float, Nanoseconds
from kempf.pipeline.ingest.spans import Index


@dataclass(frozen=True, eq=False)
class Arrived:
    """Messages of one MCAP channel that stand in one part of the file."""

    #: Id of the channel in the file.
    channel: int
    topic: str
    #: Shape (m,). Numbers of the messages in the file, ascending.
    record: Index
    #: Shape (m,). By the recorder's clock.
    log_ns: Nanoseconds
    #: Shape (m,). What the messages say; `NO_TIME` where they say nothing.
    stamp_ns: Nanoseconds
    #: Shape (m,). The first field that is mapped, in the log's unit; NaN where it is absent.
    value: Float


@dataclass(frozen=True, eq=False)
class Arrivals:
    """Messages of one source, in the order of the file."""

    #: Topic, or one of its publishers.
    source: str
    #: record, log_ns, stamp_ns, value: Shapes (n,). As of `Arrived`.
    record: Index
    log_ns: Nanoseconds
    stamp_ns: Nanoseconds
    value: Float


def by_source(arrived: Iterable[Arrived], source_of: Callable[[Arrived], str]) -> list[Arrivals]:
    """Join what arrived, source by source, sorted by name.

    Parameters
    ----------
    arrived : iterable of Arrived
    source_of : callable
        Gives the name of the source.
    """
    parts: dict[str, list[Arrived]] = {}
    for one in arrived:
        if one.record.size:
            parts.setdefault(source_of(one), []).append(one)
    return [_joined(source, own) for source, own in sorted(parts.items())]


def _joined(source: str, parts: list[Arrived]) -> Arrivals:
    record = np.concatenate([one.record for one in parts])
    order = np.argsort(record, kind="stable")
    return Arrivals(
        source,
        record[order],
        np.concatenate([one.log_ns for one in parts])[order],
        np.concatenate([one.stamp_ns for one in parts])[order],
        np.concatenate([one.value for one in parts])[order],
    )
