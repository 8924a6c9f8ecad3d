"""The payloads of an MCAP file, read again from it when they are asked for: few are, and then few at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import polars as pl
from numpy.typing import NDArray

from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.batch import Batch, Piece
from kempf.pipeline.ingest.spans import RAW_LIMIT, Bytes, Index, Spans

#: Bytes of a payload that is no text which are shown, in hexadecimal digits.
_SHOWN = 64


@dataclass(frozen=True, eq=False)
class _Block:
    """Payloads of one batch: where its bytes come from, and where in them the payloads lie."""

    pieces: tuple[Piece, ...]
    first: NDArray[np.uint32]
    end: NDArray[np.uint32]


class PayloadsBuilder:
    """Takes note of where the payloads of batches stand."""

    def __init__(self) -> None:
        self._blocks: list[_Block] = []

    def add(self, batch: Batch) -> None:
        """Take note of one batch."""
        self._blocks.append(_Block(batch.pieces, batch.first.astype(np.uint32), batch.end.astype(np.uint32)))

    def build(self, log: LogFile, is_text: NDArray[np.bool_]) -> Payloads:
        """Return all payloads; ``is_text`` tells of each whether it is shown as it stands."""
        return Payloads(log, self._blocks, is_text)


class Payloads:
    """Payloads of a whole file, or of some of its messages.

    Parameters
    ----------
    log : LogFile
        Must stay open.
    blocks : list of _Block
    is_text : ndarray of bool, shape (n,)
    chosen : ndarray of int64, shape (m,), optional
        Some of the messages, ascending; else all.
    """

    def __init__(
        self, log: LogFile, blocks: list[_Block], is_text: NDArray[np.bool_], chosen: Index | None = None
    ) -> None:
        self._log, self._blocks, self._is_text = log, blocks, is_text
        self._begins = np.cumsum([0] + [block.first.size for block in blocks])
        self._chosen = np.arange(self._begins[-1], dtype=np.int64) if chosen is None else chosen

    def __len__(self) -> int:
        return int(self._chosen.size)

    def take(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> Payloads:
        """Return some of the payloads, by mask or by ascending index."""
        return Payloads(self._log, self._blocks, self._is_text, self._chosen[chosen])

    def binary(self) -> pl.Series:
        """Return the payloads as a column of bytes."""
        parts = [spans.binary() for spans, _ in self._blocks_chosen()]
        return pl.concat(parts) if parts else pl.Series("content", [], dtype=pl.Binary)

    def text(self, limit: int = RAW_LIMIT) -> pl.Series:
        """Return the payloads as text of at most ``limit`` characters, what is no text as its first bytes."""
        parts = [_shown(spans, self._is_text[record], limit) for spans, record in self._blocks_chosen()]
        return pl.concat(parts) if parts else pl.Series("raw", [], dtype=pl.String)

    def _blocks_chosen(self) -> Iterator[tuple[Spans, Index]]:
        """Read the blocks that are asked for again, one at a time: their payloads and the numbers of the messages."""
        bounds = np.searchsorted(self._chosen, self._begins)
        for block, begin, low, high in zip(self._blocks, self._begins[:-1], bounds[:-1], bounds[1:], strict=True):
            if low == high:
                continue
            record = self._chosen[low:high]
            own = record - begin
            content: Bytes = np.concatenate([np.empty(0, np.uint8), *(piece.read(self._log) for piece in block.pieces)])
            yield Spans(content, block.first[own].astype(np.int64), block.end[own].astype(np.int64)), record


def _shown(spans: Spans, is_text: NDArray[np.bool_], limit: int) -> pl.Series:
    """Return payloads as they are shown."""
    if is_text.all():
        return spans.text(limit)
    shown = np.empty(len(spans), dtype=object)
    shown[is_text] = spans.take(is_text).text(limit).to_list()
    for i in np.flatnonzero(~is_text):
        own = spans.buffer[spans.start[i] : spans.stop[i]]
        more = f"... {own.size} bytes" if own.size > _SHOWN else ""
        shown[i] = own[:_SHOWN].tobytes().hex() + more
    return pl.Series("raw", shown.tolist(), dtype=pl.String)
