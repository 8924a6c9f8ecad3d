"""What a format's reader hands to the screen: the records of a log, decoded or refused, before the common checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Protocol

import numpy as np
import polars as pl
from numpy.typing import NDArray

Float = NDArray[np.float64]
Flag = NDArray[np.bool_]
Code = NDArray[np.int8]
Nanoseconds = NDArray[np.int64]

#: Stands where a record has no time: no log was written in the year 1677.
NO_TIME = np.int64(np.iinfo(np.int64).min)


class Reason(StrEnum):
    """Why a record or value is refused."""

    CHECKSUM = "checksum"  # the sentence's checksum is absent or wrong
    MALFORMED = "malformed"  # it cannot be decoded: too few fields, broken JSON, cut line, bad time
    NO_CHANNEL = "no_channel"  # whole, but it carries none of the canonical channels (AIS, satellites in view, ...)
    VOID = "void"  # the instrument itself says that the data are not valid
    NO_TIME = "no_time"  # no time can be given to it
    CLOCK_UNSET = "clock_unset"  # a year in which no clock was set: before 2000 or after 2100
    CLOCK_BACK = (
        "clock_back"  # earlier than a record of the same source before it, or alone far ahead of its neighbours
    )
    DUPLICATE = "duplicate"  # same source, same time, same content as a record before it
    SAME_INSTANT = "same_instant"  # same source, channel and time as a record before it, other content
    NOT_A_NUMBER = "not_a_number"  # the field is there but is no finite number
    OUT_OF_RANGE = "out_of_range"  # outside the physical range of the channel


#: Reasons by code; code 0 is a record that is still good.
REASONS: tuple[Reason, ...] = tuple(Reason)
CODE: dict[Reason, int] = {reason: i + 1 for i, reason in enumerate(REASONS)}


@dataclass(frozen=True)
class MalformedRows:
    """What of most records, or of many that follow each other, is not as the profile or the header says."""

    #: A sentence that quotes it, with what was expected.
    found: str
    #: What to do.
    next_step: str
    #: Number of records.
    records: int


@dataclass(frozen=True)
class LostStretch:
    """A stretch of a damaged log that could not be read."""

    #: since_ns, until_ns: By the logger's clock, UTC nanoseconds; None where unknown.
    since_ns: int | None
    until_ns: int | None
    #: How many records are lost, where the file says so.
    messages: int | None
    why: str


class Pieces(Protocol):
    """The bytes of records: in memory, or read again when they are asked for."""

    def __len__(self) -> int:
        """Return the number of records."""
        ...

    def take(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> Pieces:
        """Return some of them, chosen by mask or by ascending index."""
        ...

    def binary(self) -> pl.Series:
        """Return them as a column of bytes."""
        ...

    def text(self) -> pl.Series:
        """Return them as a column of text, the long ones cut."""
        ...


@dataclass(frozen=True, eq=False)
class Chained:
    """Records whose bytes lie in two places, one behind the other."""

    first: Pieces
    second: Pieces

    def __len__(self) -> int:
        return len(self.first) + len(self.second)

    def take(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> Pieces:
        """Return some of them, chosen by mask or by ascending index."""
        index = np.flatnonzero(chosen) if chosen.dtype == np.bool_ else chosen
        here = index < len(self.first)
        # a place of which nothing is left is let go: else the chain grows by a link with every part of a long log
        if not here.any():
            return self.second.take(index - len(self.first))
        if here.all():
            return self.first.take(index)
        return Chained(self.first.take(index[here]), self.second.take(index[~here] - len(self.first)))

    def binary(self) -> pl.Series:
        """Return them as a column of bytes."""
        return pl.concat([self.first.binary(), self.second.binary()])

    def text(self) -> pl.Series:
        """Return them as a column of text, the long ones cut."""
        return pl.concat([self.first.text(), self.second.text()])


@dataclass(frozen=True, eq=False)
class Values:
    """One canonical channel over some records of a log."""

    #: Shape (n,). In SI; NaN where the record does not carry it or where it is no number.
    value: Float
    #: Shape (n,). Where the record offers a value, readable or not.
    present: Flag

    @classmethod
    def empty(cls, n: int) -> Values:
        """Return a channel that no record carries."""
        return cls(np.full(n, np.nan), np.zeros(n, dtype=np.bool_))

    def put(self, record: NDArray[np.int64], value: Float) -> None:
        """Set the values of some records, given by index; NaN says that the text is no number."""
        self.value[record] = value
        self.present[record] = True


@dataclass(frozen=True, eq=False)
class Decoded:
    """Records of one log that follow each other: all of them, or a part."""

    #: Shape (n,). Their numbers in the log, from 0 on, ascending.
    record: NDArray[np.int64]
    #: Each record as it stands in the file, shape (n,).
    raw: Pieces
    #: The part that distinguishes two records (without the logger's stamp), shape (n,).
    content: Pieces
    #: Shape (n,). `NO_TIME` where there is none.
    time_utc_ns: Nanoseconds
    #: Shape (n,). Index into ``source_names``; -1 where it is unknown.
    source: NDArray[np.int64]
    #: Talker and sentence, topic, or ``row``; a later part of the same log may have more, behind these.
    source_names: tuple[str, ...]
    #: Shape (n,). Code of the reason for which the reader refused the record, 0 for none.
    reason: Code
    #: By name of the channel.
    channels: dict[str, Values]
    #: What a person should know; of the last part.
    notes: list[str] = field(default_factory=list)
    #: What of the log could not be read; of the last part.
    lost: tuple[LostStretch, ...] = ()
    #: Why records are malformed, where they are many, the most frequent cause first; of the last part.
    malformed: tuple[MalformedRows, ...] = ()
    #: What to do where no record carries a channel, for they are in an encoding that is not read; of the last part.
    next_step: str = ""
    #: Whether no record of the log comes behind these.
    ends: bool = True
    #: Standard error, s, of the instants of a source where the log does not have them, by name.
    instant_std_s: Mapping[str, float] = field(default_factory=dict)

    def __len__(self) -> int:
        return int(self.record.size)

    def take(self, chosen: NDArray[np.int64]) -> Decoded:
        """Return some of the records, by ascending index."""
        return replace(
            self,
            record=self.record[chosen],
            raw=self.raw.take(chosen),
            content=self.content.take(chosen),
            time_utc_ns=self.time_utc_ns[chosen],
            source=self.source[chosen],
            reason=self.reason[chosen],
            channels={name: Values(v.value[chosen], v.present[chosen]) for name, v in self.channels.items()},
        )

    def behind(self, first: Decoded) -> Decoded:
        """Return records of an earlier part, and these behind them; notes and the rest are those of this part."""
        if not len(first):
            return self
        channels = {}
        for name in (*first.channels, *(name for name in self.channels if name not in first.channels)):
            a, b = (part.channels.get(name) or Values.empty(len(part)) for part in (first, self))
            channels[name] = Values(np.concatenate([a.value, b.value]), np.concatenate([a.present, b.present]))
        return replace(
            self,
            record=np.concatenate([first.record, self.record]),
            raw=Chained(first.raw, self.raw),
            content=Chained(first.content, self.content),
            time_utc_ns=np.concatenate([first.time_utc_ns, self.time_utc_ns]),
            source=np.concatenate([first.source, self.source]),
            reason=np.concatenate([first.reason, self.reason]),
            channels=channels,
        )
