"""What the reader of an encoding returns: some fields of many messages, each a column of numbers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import polars as pl
from numpy.typing import NDArray

from kempf.pipeline.ingest.spans import Spans


@dataclass(frozen=True, eq=False)
class Columns:
    """Fields of messages."""

    #: Shape (k, m). NaN where a field is absent, or is there and is no finite number.
    value: NDArray[np.float64]
    #: Shape (k, m). Where the message carries the field, readable or not.
    present: NDArray[np.bool_]
    #: Shape (m,). Which messages could be decoded.
    good: NDArray[np.bool_]
    #: By field, where its text is asked for: which messages have text that is no number, shape (t,), ascending, and it.
    text: dict[int, tuple[NDArray[np.int64], pl.Series]] = field(default_factory=dict)

    @classmethod
    def empty(cls, fields: int, messages: int) -> Columns:
        """Return columns to be filled: nothing is there, no message is good."""
        return cls(
            np.full((fields, messages), np.nan),
            np.zeros((fields, messages), dtype=np.bool_),
            np.zeros(messages, dtype=np.bool_),
        )


class MessageReader(Protocol):
    """Reads the fields that it was made for."""

    #: Fields that are no number of the messages, as far as their definition says; each with why.
    missing: dict[str, str]

    def read(self, payloads: Spans) -> Columns:
        """Return the fields of messages, shape (m,) in, columns of m values out."""
        ...


class NoReaderError(Exception):
    """Messages of a channel cannot be read.

    Parameters
    ----------
    why : str
        What of them; the topic stands before it.
    next_step : str, optional
        What to do.
    """

    def __init__(self, why: str, next_step: str = "") -> None:
        super().__init__(why)
        self.next_step = next_step
