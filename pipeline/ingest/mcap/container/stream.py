"""An MCAP file from its first byte to its last, a few megabytes in memory at a time; damage costs what it lies in.

The file is read in the order it was written, so that one that was never closed, one without an index and one that
lost its end are read the same way as a whole one. The summary says where to go on behind damage; where it is gone
too, the next chunk is looked for. What the messages say is read in `decode`.

References
----------
MCAP specification, https://mcap.dev/spec.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.ingest.decoded import LostStretch
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.container.batch import Batch, Piece, joined, lost_chunk, messages_of, stretch
from kempf.pipeline.ingest.mcap.container.budget import Budget
from kempf.pipeline.ingest.mcap.container.records import (
    CHANNEL,
    CHUNK,
    CHUNK_LIMIT,
    DATA_END,
    FIRST_PRIVATE,
    FOOTER,
    MESSAGE,
    SCHEMA,
    DamagedChunkError,
    McapChannel,
    Schema,
    head_of,
    parse_channel,
    parse_schema,
    unpacked,
)
from kempf.pipeline.ingest.mcap.container.seams import end_of_file
from kempf.pipeline.ingest.mcap.container.summary import read_summary
from kempf.pipeline.ingest.mcap.container.unchunked import FIRST_WINDOW, WINDOW, believed, chunk_behind
from kempf.pipeline.ingest.mcap.container.walk import HEAD, walk
from kempf.pipeline.ingest.sniff import MCAP_MAGIC
from kempf.pipeline.ingest.spans import Index, as_bytes
from kempf.schemas.instants import iso_cut

#: Bytes that are known of a message whose chunk is lost: two places, its channel, two times.
_HEADS = 40

#: From here on a chunk is handed on as it is; smaller ones are worth a copy that puts them together.
_LARGE = 1 << 19

#: Lost stretches that are listed one by one; what more there are is one.
_MOST_STRETCHES = 1_000

#: Largest record that is read for what it says; a larger one, such as an attachment, is stepped over.
_RECORD_LIMIT = CHUNK_LIMIT + (1 << 20)


class McapStream:
    """One pass over an MCAP file.

    Parameters
    ----------
    name : str
        Name of the log, for messages.
    log : LogFile
    place : (int, int), optional
        First byte of the file in the log, and the one behind its last; the whole log if left out.
    budget : Budget, optional
        How much more the log may hold; that of a whole log if left out.

    Attributes
    ----------
    channels, schemas : dict by id
        Complete once `batches` has come to its end.
    lost : list of LostStretch
        What could not be read, in the order of the file.
    notes : list of str
    partial : bool
        Whether the file is cut or damaged.
    """

    def __init__(
        self, name: str, log: LogFile, place: tuple[int, int] | None = None, budget: Budget | None = None
    ) -> None:
        self._begin, end = place or (0, log.size)
        self._log = log.part(self._begin, end)
        self._budget = budget or Budget(name, log.size)
        self._summary = read_summary(self._log)
        self.channels: dict[int, McapChannel] = dict(self._summary.channels)
        self.schemas: dict[int, Schema] = dict(self._summary.schemas)
        self.lost: list[LostStretch] = []
        self.notes: list[str] = list(self._summary.notes)
        self._length = dict(self._summary.chunks)
        self._expected = np.array(sorted(self._length), dtype=np.int64)
        self._lengths = np.array([self._length[at] for at in sorted(self._length)], dtype=np.int64)
        self._crc: int | None = 0 if self._summary.data_end < 0 or self._summary.data_crc else None
        self._crc_to = 0
        self._last_ns: int | None = None
        self._read = 0

    @property
    def partial(self) -> bool:
        """Whether something of the file is lost."""
        return bool(self.lost)

    @property
    def since_ns(self) -> int | None:
        """Earliest log time that the file states, ns."""
        return self._summary.since_ns

    @cached_property
    def _outside_believed(self) -> bool:
        return believed(self._log, self._summary)

    def batches(self) -> Iterator[Batch]:
        """Read the file.

        Yields
        ------
        Batch
            In the order of the file.

        Raises
        ------
        DataRejected
            ``log_too_large``, ``too_many_records``: it unpacks to far more than a log of its size holds.
        """
        waiting: list[Batch] = []
        size = 0
        for batch in self._pieces():
            self._count(batch)
            own = _HEADS * batch.first.size if batch.lost else batch.content.size
            if waiting and (size + own > WINDOW or own >= _LARGE or batch.lost != waiting[0].lost):
                yield joined(waiting)
                waiting, size = [], 0
            if own >= _LARGE:
                yield batch
            else:
                waiting.append(batch)
                size += own
        if waiting:
            yield joined(waiting)
        expected = self._summary.messages
        if expected is not None and expected > self._read and not self.lost:
            self._lose(
                LostStretch(None, None, expected - self._read, "the summary counts more messages than were found")
            )

    def _count(self, batch: Batch) -> None:
        self._read += batch.first.size
        self._budget.unpack(0, batch.first.size)
        if batch.log_time.size and not batch.lost:
            self._last_ns = int(batch.log_time.max())

    def _lose(self, lost: LostStretch, note: str = "") -> None:
        if len(self.lost) >= _MOST_STRETCHES:
            since = self.lost[-1].since_ns
            self.lost[-1] = stretch(since, lost.until_ns, None, "the file is damaged in very many places")
            return
        self.lost.append(lost)
        span = _span(lost) or "at a time unknown"
        count = f"{lost.messages} messages" if lost.messages is not None else "an unknown number of messages"
        self.notes.append(note or f"Lost: {count}, {span}: {lost.why}.")

    def _pieces(self) -> Iterator[Batch]:
        at, stop = len(MCAP_MAGIC), self._summary.stop
        window = WINDOW
        while at < stop:
            data = self._log.read(at, min(window, stop - at))
            window = min(2 * window, WINDOW)
            buffer = as_bytes(data)
            opcode, first, end, reached = walk(buffer, 0, len(data))
            if reached == 0:
                length = int.from_bytes(data[1:HEAD], "little") if len(data) >= HEAD else stop
                if HEAD + length > stop - at or self._sound(at, *_alone(data[0], length)) == 0:
                    yield from self._mended(at)
                    at, window = self._resume(at, stop), FIRST_WINDOW
                    continue
                if HEAD + length > _RECORD_LIMIT or data[0] not in (CHUNK, MESSAGE, SCHEMA, CHANNEL):
                    if data[0] in (CHUNK, MESSAGE):
                        batch, lost = lost_chunk(self._log, at, HEAD + length, f"it is larger than {CHUNK_LIMIT} bytes")
                        self._lose(lost)
                        yield batch
                    self._check(at, HEAD + length)
                    at += HEAD + length
                    continue
                data = self._log.read(at, HEAD + length)
                buffer = as_bytes(data)
                opcode, first, end, reached = walk(buffer, 0, len(data))
            sound = self._sound(at, opcode, first, end)
            yield from self._window(at, data, opcode[:sound], first[:sound], end[:sound])
            if sound < opcode.size:
                kind, place = int(opcode[sound]), at + int(first[sound]) - HEAD
                if kind == DATA_END and self._summary.data_end in (-1, place):
                    self._end(data, place - at, at, int(first[sound]), int(end[sound]))
                    return
                self._check_window(at, data, place - at)
                yield from self._mended(place)
                at, window = self._resume(place, stop), FIRST_WINDOW
                continue
            self._check_window(at, data, reached)
            at += reached
        if not self._summary.ended:
            self._cut("the file is cut short: it has no end record")

    def _sound(self, at: int, opcode: NDArray[np.uint8], first: Index, end: Index) -> int:
        """Return how many records of a window come before the first that is damaged or ends the data section."""
        strange = (opcode == 0) | (opcode == DATA_END) | (opcode == FOOTER)
        if not self._summary.ended:
            # opcodes of a later version of the format; in a file that is damaged, rather the wrong place
            strange |= (opcode > DATA_END) & (opcode < FIRST_PRIVATE)
        messages = opcode == MESSAGE
        if messages.any() and not self._outside_believed:
            strange |= messages
        # the walk is off where it steps over the beginning of a chunk that the summary knows
        beyond = np.searchsorted(self._expected, at + first - HEAD, side="right")
        strange |= np.searchsorted(self._expected, at + end, side="left") > beyond
        if self._expected.size:
            own = np.minimum(np.searchsorted(self._expected, at + first - HEAD), self._expected.size - 1)
            is_chunk = self._expected[own] == at + first - HEAD
            strange |= is_chunk & (end - first + HEAD != self._lengths[own])
        damaged = np.flatnonzero(strange)
        return int(damaged[0]) if damaged.size else int(opcode.size)

    def _window(self, at: int, data: bytes, opcode: NDArray[np.uint8], first: Index, end: Index) -> Iterator[Batch]:
        """Hand on the messages of some records, those of chunks and those outside in the order of the file."""
        buffer = as_bytes(data)
        structural = np.flatnonzero((opcode == CHUNK) | (opcode == CHANNEL) | (opcode == SCHEMA))
        loose_from = 0
        for i in [*structural.tolist(), opcode.size]:
            loose = loose_from + np.flatnonzero(opcode[loose_from:i] == MESSAGE)
            if loose.size:
                low, high = int(first[loose[0]]), int(end[loose[-1]])
                piece = Piece(self._begin + at + low, high - low, packed=False, size=high - low)
                yield messages_of(buffer[low:high], first[loose] - low, end[loose] - low, piece)
            loose_from = i + 1
            if i < opcode.size:
                content = memoryview(data)[int(first[i]) : int(end[i])]
                if opcode[i] == CHUNK:
                    yield from self._chunk(at + int(first[i]) - HEAD, content)
                else:
                    self._describe(int(opcode[i]), bytes(content))

    def _chunk(self, place: int, content: memoryview) -> Iterator[Batch]:
        head = head_of(content)
        if head is not None and head.size <= CHUNK_LIMIT:
            # before it is known whether it is whole and holds messages: unpacking costs the same
            self._budget.unpack(head.size, 0)
        try:
            records = unpacked(content, CHUNK_LIMIT)
        except DamagedChunkError as why:
            batch, lost = lost_chunk(self._log, place, HEAD + len(content), str(why))
            self._note_chunk(place, lost)
            yield batch
            return
        buffer = as_bytes(records)
        opcode, first, end, reached = walk(buffer, 0, buffer.size)
        for i in np.flatnonzero((opcode == CHANNEL) | (opcode == SCHEMA)):
            self._describe(int(opcode[i]), records[first[i] : end[i]])
        message = opcode == MESSAGE
        if message.any():
            piece = Piece(self._begin + place, HEAD + len(content), packed=True, size=buffer.size)
            yield messages_of(buffer, first[message], end[message], piece)
        if reached < buffer.size:
            until = head.until_ns if head else None
            self._note_chunk(
                place, stretch(self._last_ns, until, None, f"its records are damaged from byte {reached} on")
            )

    def _note_chunk(self, place: int, lost: LostStretch) -> None:
        count = f"{lost.messages} messages by its index" if lost.messages else "an unknown number of messages"
        span = _span(lost)
        self._lose(lost, f"The chunk at byte {place} is lost, {count}{f', {span}' if span else ''}: {lost.why}.")

    def _describe(self, opcode: int, content: bytes) -> None:
        """Take note of a channel or schema; a damaged one is left out and its messages with it."""
        if opcode == CHANNEL:
            if (channel := parse_channel(content)) and self.channels.setdefault(*channel) != channel[1]:
                self.notes.append(f"Channel {channel[0]} is described twice, differently: the first description holds.")
        elif schema := parse_schema(content):
            self.schemas.setdefault(*schema)

    def _mended(self, place: int) -> Iterator[Batch]:
        """Read a chunk whose record has a damaged head, where the summary knows how long it is."""
        if place in self._length:
            yield from self._chunk(place, memoryview(self._log.read(place, self._length[place]))[HEAD:])

    def _resume(self, at: int, stop: int) -> int:
        """Return where to go on behind damage: at the next chunk that the summary knows, or that can be found."""
        if at in self._length:
            self.notes.append(f"The file is damaged at byte {at}: its summary says where the chunk there ends.")
            return at + self._length[at]
        later = self._expected[self._expected > at]
        place = int(later[0]) if later.size else -1
        if place < 0 and not self._summary.chunks:
            place = chunk_behind(self._log, at + 1, stop, stop)
        if place < 0:
            if self._summary.ended and self._summary.data_end > at:
                if self._summary.messages is None:  # else their count shows it
                    self._lose(stretch(self._last_ns, None, None, f"the file is damaged from byte {at} to its end"))
                return self._summary.data_end
            self._cut(f"the file is cut short or damaged at byte {at}")
            self._summary.ended = True  # said once
            return stop
        head = head_of(self._log.read(place + HEAD, 64))
        until = head.since_ns if head else None
        self._lose(
            stretch(self._last_ns, until, None, f"the file is damaged at byte {at}; reading goes on at byte {place}")
        )
        return place

    def _cut(self, why: str) -> None:
        self._lose(
            stretch(self._last_ns, None, None, why),
            f"The MCAP file is cut short or damaged at its end, all whole chunks were read: {why}.",
        )

    def _check_window(self, at: int, data: bytes, length: int) -> None:
        """Carry the CRC of the data section on."""
        if self._crc is not None and at == (self._crc_to or at):
            start = self._log.read(0, at) if self._crc_to == 0 else b""
            self._crc = zlib.crc32(memoryview(data)[:length], zlib.crc32(start, self._crc))
            self._crc_to = at + length
        else:
            self._crc = None

    def _check(self, at: int, length: int) -> None:
        for piece in self._log.pieces(at, at + length):
            self._check_window(at, piece, len(piece))
            at += len(piece)

    def _end(self, data: bytes, length: int, at: int, first: int, end: int) -> None:
        """Compare the CRC of the data section with the one in its last record."""
        self._check_window(at, data, length)
        stored_crc = int.from_bytes(data[first : first + 4], "little") if end - first >= 4 else 0
        if stored_crc and self._crc is not None and self._crc != stored_crc and not self.lost:
            why = "the CRC of the data section does not match, so that what has no CRC of its own may be damaged"
            self._lose(
                LostStretch(None, None, None, why), f"Something in the file is damaged, and nothing says where: {why}."
            )
        if not self._summary.stands_right:
            self._say_what_follows(at + end)

    def _say_what_follows(self, at: int) -> None:
        """Say what stands behind the end of the file, or that its end is missing, where its summary is of no use.

        Parameters
        ----------
        at : int
            Behind the data section.
        """
        behind = end_of_file(self._log, at)
        left = 0 if behind is None else self._log.size - behind
        if behind is not None and left:
            if any(piece.count(0) < len(piece) for piece in self._log.pieces(behind)):
                why = f"{left} bytes stand behind the end of the MCAP file, which are no MCAP file"
                self._lose(stretch(self._last_ns, None, None, why), f"Not read: {why}.")
            else:
                # of a copier, or of a disk that was reserved
                self.notes.append(f"{left} bytes behind the end of the MCAP file are zero and were left out.")
        elif not self._summary.ended:
            self.notes.append("The end of the file is missing; its data section is whole.")
        self._summary.ended = True


def _alone(opcode: int, length: int) -> tuple[NDArray[np.uint8], Index, Index]:
    """Return one record as a walk returns it."""
    return np.array([opcode], dtype=np.uint8), np.array([HEAD]), np.array([HEAD + length])


def _span(lost: LostStretch) -> str:
    """Return log times as a person reads them, nothing where they are not known."""
    since, until = (None if ns is None else iso_cut(ns) for ns in (lost.since_ns, lost.until_ns))
    if since is None:
        return f"log times until {until}" if until else ""
    return f"log times {since} to {until}" if until else f"log times from {since} on"
