"""What a format's reader hands to the screen: every record of the log, decoded or refused, before the common checks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol, Self

import numpy as np
import polars as pl
from numpy.typing import NDArray

from pipeline.ingest.readings import LostStretch, Reason

Float = NDArray[np.float64]
Flag = NDArray[np.bool_]
Code = NDArray[np.int8]
Nanoseconds = NDArray[np.int64]

#: Stands where a record has no time: no log was written in the year 1677.
NO_TIME = np.int64(np.iinfo(np.int64).min)

#: Reasons by code; code 0 is a record that is still good.
REASONS: tuple[Reason, ...] = tuple(Reason)
CODE: dict[Reason, int] = {reason: i + 1 for i, reason in enumerate(REASONS)}


class Pieces(Protocol):
    """The bytes of records: in memory, or read again when they are asked for."""

    def __len__(self) -> int:
        """Return the number of records."""
        ...

    def take(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> Self:
        """Return some of them, chosen by mask or by ascending index."""
        ...

    def binary(self) -> pl.Series:
        """Return them as a column of bytes."""
        ...

    def text(self) -> pl.Series:
        """Return them as a column of text, the long ones cut."""
        ...


@dataclass(frozen=True, eq=False)
class Values:
    """One canonical channel over all records of a log.

    Attributes
    ----------
    value : ndarray of float64, shape (n,)
        In SI; NaN where the record does not carry it or where it is no number.
    present : ndarray of bool, shape (n,)
        Where the record offers a value, readable or not.
    """

    value: Float
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
    """All records of one log.

    Attributes
    ----------
    raw : Pieces
        Each record as it stands in the file, shape (n,).
    content : Pieces
        The part that tells two records apart (without the logger's stamp), shape (n,).
    time_utc_ns : ndarray of int64, shape (n,)
        `NO_TIME` where there is none.
    source : ndarray of int64, shape (n,)
        Index into ``source_names``; -1 where it cannot be told.
    source_names : tuple of str
        Talker and sentence, topic, or ``row``.
    reason : ndarray of int8, shape (n,)
        Code of the reason for which the reader refused the record, 0 for none.
    channels : dict of str to Values
        By name of the channel.
    notes : list of str
        What a person should know.
    lost : tuple of LostStretch
        What of the log could not be read.
    """

    raw: Pieces
    content: Pieces
    time_utc_ns: Nanoseconds
    source: NDArray[np.int64]
    source_names: tuple[str, ...]
    reason: Code
    channels: dict[str, Values]
    notes: list[str] = field(default_factory=list)
    lost: tuple[LostStretch, ...] = ()

    def __len__(self) -> int:
        return len(self.raw)
