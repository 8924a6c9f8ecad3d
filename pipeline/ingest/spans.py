"""Stretches of one byte buffer: the lines, rows or messages of a log, cut out and joined without a loop over them.

What the bytes mean does not belong here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl
import pyarrow as pa
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Index = NDArray[np.int64]

#: Longest raw text that is kept of a rejected record, characters.
RAW_LIMIT = 2_000

#: Steps of one byte before `trimmed` hands the lines that are still blank to `bytes.strip`.
_TRIM_STEPS = 64


@dataclass(frozen=True, eq=False)
class Spans:
    """Stretches of a buffer, in order and without overlap."""

    #: The bytes.
    buffer: Bytes
    #: start, stop: Shape (n,). First byte of each stretch, and the one after its last.
    start: Index
    stop: Index

    def __len__(self) -> int:
        return int(self.start.size)

    def take(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> Spans:
        """Return some of the stretches, chosen by mask or by ascending index."""
        return Spans(self.buffer, self.start[chosen], self.stop[chosen])

    def binary(self) -> pl.Series:
        """Return the stretches as a column of bytes."""
        offsets, data = self._gathered(0)
        array = pa.LargeBinaryArray.from_buffers(
            pa.large_binary(), len(self), [None, pa.py_buffer(offsets), pa.py_buffer(data)]
        )
        return pl.Series("content", array, dtype=pl.Binary)

    def _gathered(self, extra: int) -> tuple[Index, Bytes]:
        """Copy the stretches behind each other; return where each begins and ends, and the bytes.

        Stretches and the gaps between them are the values of one Arrow array that shares the buffer's memory; taking
        every other value copies the stretches in compiled code.
        """
        n = len(self)
        if n == 0:
            return np.zeros(1, dtype=np.int64), np.empty(0, dtype=np.uint8)
        bounds = np.empty(2 * n, dtype=np.int64)
        bounds[::2], bounds[1::2] = self.start, self.stop + extra
        whole = pa.LargeBinaryArray.from_buffers(
            pa.large_binary(), 2 * n - 1, [None, pa.py_buffer(bounds), pa.py_buffer(np.ascontiguousarray(self.buffer))]
        )
        _, offsets, data = whole.take(pa.array(np.arange(0, 2 * n, 2))).buffers()
        content = np.frombuffer(data, dtype=np.uint8) if data is not None else np.empty(0, dtype=np.uint8)
        return np.frombuffer(offsets, dtype=np.int64)[: n + 1], content

    def text(self, limit: int = RAW_LIMIT) -> pl.Series:
        """Return the stretches as text, at most ``limit`` characters each; bytes that are no UTF-8 become U+FFFD."""
        short = Spans(self.buffer, self.start, np.minimum(self.stop, self.start + limit))
        column = short.binary()
        try:
            text = column.cast(pl.String)
        except pl.exceptions.ComputeError:
            # one byte that is no UTF-8 refuses the whole column: only then value by value
            text = pl.Series([value.decode("utf-8", errors="replace") for value in column], dtype=pl.String)
        return text.rename("raw")


def as_bytes(data: bytes) -> Bytes:
    """Return the bytes as an array that shares their memory."""
    return np.frombuffer(data, dtype=np.uint8)


def lines_of(buffer: Bytes) -> Spans:
    """Cut a buffer at its line feeds, without them and the carriage returns before them.

    A buffer without any line feed is cut at its carriage returns.
    """
    feeds = np.flatnonzero(buffer == 10).astype(np.int64)
    if feeds.size == 0:
        feeds = np.flatnonzero(buffer == 13).astype(np.int64)
    start = np.concatenate((np.zeros(1, dtype=np.int64), feeds + 1))
    stop = np.concatenate((feeds, np.full(1, buffer.size, dtype=np.int64)))
    if buffer.size:
        stop = stop - ((stop > start) & (buffer[np.maximum(stop - 1, 0)] == 13))
    return Spans(buffer, start, stop)


def is_blank(byte: Bytes) -> NDArray[np.bool_]:
    """Return which bytes are blanks: space, tab, carriage return, vertical tab or form feed."""
    blank: NDArray[np.bool_] = (byte == 32) | ((byte >= 9) & (byte <= 13))
    return blank


def trimmed(spans: Spans) -> Spans:
    """Return the stretches without the blanks at either end; one that is all blank becomes empty."""
    buffer, start, stop = spans.buffer, spans.start.copy(), spans.stop.copy()
    left = right = np.arange(len(spans), dtype=np.int64)
    for _ in range(_TRIM_STEPS):
        left = left[start[left] < stop[left]]
        left = left[is_blank(buffer[start[left]])]
        start[left] += 1
        right = right[start[right] < stop[right]]
        right = right[is_blank(buffer[stop[right] - 1])]
        stop[right] -= 1
        if left.size == 0 and right.size == 0:
            break
    for i in np.union1d(left, right):
        whole = buffer[start[i] : stop[i]].tobytes()
        kept = whole.lstrip(b" \t\r\v\f\n")
        start[i] += len(whole) - len(kept)
        stop[i] = start[i] + len(kept.rstrip(b" \t\r\v\f\n"))
    return Spans(buffer, start, stop)


def first_within(places: Index, start: Index, stop: Index) -> Index:
    """Return the first of the ascending places in each stretch, -1 for none."""
    if places.size == 0:
        return np.full(start.shape, -1, dtype=np.int64)
    at = np.searchsorted(places, start)
    candidate = places[np.minimum(at, places.size - 1)]
    return np.where((at < places.size) & (candidate < stop), candidate, -1)


def spans_of(column: pl.Series) -> Spans:
    """Return a column of text as stretches of its own UTF-8 buffer; null becomes empty."""
    array = column.fill_null("").cast(pl.Binary).rechunk().to_arrow()
    array = array.cast(pa.large_binary())
    if isinstance(array, pa.ChunkedArray):
        array = array.combine_chunks()
    _, offsets, data = array.buffers()
    bounds = np.frombuffer(offsets, dtype=np.int64)[array.offset : array.offset + len(array) + 1]
    content = np.frombuffer(data, dtype=np.uint8) if data is not None else np.empty(0, dtype=np.uint8)
    return Spans(content, bounds[:-1].astype(np.int64), bounds[1:].astype(np.int64))
