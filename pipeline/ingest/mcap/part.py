"""The records of an MCAP file that are decoded together, and how parts of the file become one."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.ingest.decoded import Decoded, Values
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.container.batch import Batch, PayloadsBuilder, joined
from kempf.pipeline.ingest.mcap.times.arrivals import Arrived

T = TypeVar("T", bound=np.generic)


@dataclass(frozen=True, eq=False)
class Part:
    """The records of some megabytes of the file, decoded and not yet checked."""

    #: Where they stand.
    batch: Batch
    #: Shape (m,).
    time_ns: NDArray[np.int64]
    #: Shape (m,). Place of the topic in the order in which topics come, -1 where it is unknown.
    topic: NDArray[np.int64]
    #: Shape (m,). Code of the reason for which a record is refused, 0 for none.
    reason: NDArray[np.int8]
    #: Shape (m,). Whether the payload is text.
    text: NDArray[np.bool_]
    #: By canonical channel, in SI: numbers of records within the part, shape (k,), and what they carry, shape (k,).
    values: dict[str, list[tuple[NDArray[np.int64], NDArray[np.float64]]]]
    #: Number of the first record in the file.
    first: int = 0
    #: Good messages of the channels that are read, for the questions of clocks; empty where these are settled.
    arrived: list[Arrived] = field(default_factory=list)
    #: Numbers of records within the part, of the channels that share their topic with another one.
    shared: list[tuple[int, str, NDArray[np.int64]]] = field(default_factory=list)


_NO_BATCH = joined([])


class Waiting:
    """Parts that become one."""

    def __init__(self) -> None:
        self._places, self.parts = PayloadsBuilder(), list[Part]()
        self.size = 0
        #: Whether nothing of the file follows.
        self.ends = False

    def add(self, part: Part) -> None:
        """Take one more; of its bytes only where they stand."""
        self._places.add(part.batch)
        self.parts.append(replace(part, batch=_NO_BATCH))
        self.size += part.time_ns.size

    def decoded(self, log: LogFile, first: int, topics: tuple[str, ...]) -> Decoded:
        """Return them as one, the first record of which has the number ``first``; more of the log follows."""
        parts = self.parts
        payloads = self._places.build(log, _joined([part.text for part in parts], np.empty(0, np.bool_)))
        return Decoded(
            np.arange(first, first + self.size, dtype=np.int64),
            payloads,
            payloads,
            _joined([part.time_ns for part in parts], np.empty(0, np.int64)),
            _joined([part.topic for part in parts], np.empty(0, np.int64)),
            topics,
            _joined([part.reason for part in parts], np.empty(0, np.int8)),
            _dense(parts),
            ends=False,
        )


def _joined(parts: list[NDArray[T]], empty: NDArray[T]) -> NDArray[T]:
    return np.concatenate([empty, *parts])


def _dense(parts: list[Part]) -> dict[str, Values]:
    """Lay the values of all parts out over all records."""
    n = sum(part.time_ns.size for part in parts)
    channels: dict[str, Values] = {}
    base = 0
    for part in parts:
        for name, samples in part.values.items():
            for record, value in samples:
                channels.setdefault(name, Values.empty(n)).put(base + record, value)
        base += part.time_ns.size
    return channels
