"""Which fields of a channel's messages are asked for, and how they become canonical channels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.ingest.mapping import check_once
from kempf.pipeline.ingest.mcap.container.records import McapChannel, Schema
from kempf.pipeline.ingest.mcap.topics.odd_times import OddTime, odd_time
from kempf.pipeline.ingest.mcap.topics.unread import unread
from kempf.pipeline.ingest.messages.columns import Columns, MessageReader
from kempf.pipeline.ingest.spans import Spans
from kempf.pipeline.ingest.text.row_times import text_instants
from kempf.pipeline.ingest.text.times import NS_PER
from kempf.schemas.known_messages import VOID_WHERE_NEGATIVE, plain_name
from kempf.schemas.profile import ChannelMap, TimeColumn, start_ns
from kempf.schemas.units import SECOND_NS

#: Parts of a quaternion, and the angles that are made of it.
_QUATERNION = ("x", "y", "z", "w")
_ANGLES = ("yaw", "pitch", "roll")
#: How far the length of a quaternion may be from one.
_UNIT_WITHIN = 0.1

#: What a stamp's whole seconds and nanoseconds are called: ROS 2, protobuf, ROS 1, Foxglove's JSON.
_STAMPS = (("sec", "nanosec"), ("seconds", "nanos"), ("secs", "nsecs"), ("sec", "nsec"))
_LAST = float(np.iinfo(np.int64).max)


@dataclass(frozen=True, eq=False)
class DecodedTopics:
    """Messages of one channel."""

    #: Shape (m,).
    good: NDArray[np.bool_]
    #: By field, in the log's unit, shapes (m,).
    values: dict[str, tuple[NDArray[np.float64], NDArray[np.bool_]]]
    #: Shape (m,), or None. Where the time is asked of the messages; -1 where they do not give it.
    time_ns: NDArray[np.int64] | None


class Route:
    """Reads what is asked of one channel.

    Parameters
    ----------
    channel : McapChannel
    schema : Schema or None
    mapped : dict of str to ChannelMap
        By field; none where nothing is asked of the channel.
    time : TimeColumn or None
        Where it names a field of the messages.

    Raises
    ------
    NoReaderError
        The messages cannot be read; says why.
    UsageError
        Two fields of one message are mapped to one channel.
    """

    def __init__(
        self, channel: McapChannel, schema: Schema | None, mapped: dict[str, ChannelMap], time: TimeColumn | None
    ) -> None:
        check_once(channel.topic, mapped)
        self.mapped = mapped
        self._time = time
        self._clock = (time.column if time else None) or ""
        self._void = VOID_WHERE_NEGATIVE.get(plain_name(schema.name), ()) if schema else ()
        wanted = dict.fromkeys(mapped)
        for key in mapped:
            wanted |= dict.fromkeys(_parts(key))
        for _, test in self._void:
            wanted[test] = None
        if time is not None:
            wanted |= dict.fromkeys([self._clock, *(f"{self._clock}.{p}" for pair in _STAMPS for p in pair)])
        self._wanted = list(wanted)
        self._reader = reader_of(channel, schema, self._wanted, [self._clock] if time is not None else [])
        #: the first time of its messages that is none, if one was read that is not as the profile says
        self.odd_time: OddTime | None = None
        #: what a person should know of the times
        self.time_notes: list[str] = []
        lacks = self._reader.missing
        #: mapped fields that no message can have, each with why
        self.absent = {k: lacks[k] for k in mapped if k in lacks and (not _parts(k) or set(_parts(k)) & set(lacks))}

    def read(self, payloads: Spans) -> DecodedTopics:
        """Decode messages, shape (m,)."""
        columns = self._reader.read(payloads)
        values = {}
        for key in self.mapped:
            value, present = self._column(columns, key)
            for begin, test in self._void:
                if key.startswith(begin):
                    sign, known = self._of(columns, test)
                    present = present & ~(known & (sign < 0))
            values[key] = value, present
        return DecodedTopics(columns.good, values, None if self._time is None else self._instants(columns))

    def _of(self, columns: Columns, key: str) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        at = self._wanted.index(key)
        return columns.value[at], columns.present[at]

    def _column(self, columns: Columns, key: str) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return a field, or the angle that it names of the quaternion in whose place it stands."""
        value, present = self._of(columns, key)
        parts = _parts(key)
        if parts and not present.all():
            x, y, z, w = (self._of(columns, part)[0] for part in parts)
            whole = np.logical_and.reduce([self._of(columns, part)[1] for part in parts]) & ~present
            value = np.where(whole, _angle(key.rpartition(".")[2], x, y, z, w), value)
            present = present | whole
        return value, present

    def _instants(self, columns: Columns) -> NDArray[np.int64]:
        assert self._time is not None
        time = np.full(columns.good.size, -1, dtype=np.int64)
        start = start_ns(self._time.start) if self._time.start else 0
        value, present = self._of(columns, self._clock)
        scale = NS_PER[self._time.unit or "s"]
        with np.errstate(invalid="ignore"):
            usable = present & (value >= 0) & (value * scale + start < _LAST)
        time[usable] = _nanoseconds(value[usable], scale) + start
        for whole, rest in _STAMPS:
            (second, has_second), (nano, has_nano) = (self._of(columns, f"{self._clock}.{p}") for p in (whole, rest))
            with np.errstate(invalid="ignore"):
                usable = (
                    has_second
                    & has_nano
                    & (second >= 0)
                    & (second < _LAST / SECOND_NS)
                    & (nano >= 0)
                    & (nano < SECOND_NS)
                )
            time[usable] = second[usable].astype(np.int64) * SECOND_NS + nano[usable].astype(np.int64)
        slot = self._wanted.index(self._clock)
        if self._time.unit is None and slot in columns.text:
            at, text = columns.text[slot]
            instant, good = text_instants(text.str.strip_chars(), self._time, self.time_notes)
            time[at[good]] = instant[good]
        self.odd_time = self.odd_time or odd_time(columns, slot, time, self._time)
        return time


def _nanoseconds(value: NDArray[np.float64], scale: int) -> NDArray[np.int64]:
    """Scale to nanoseconds, whole part and fraction apart, so that nothing but the number itself is rounded."""
    whole = np.floor(value)
    return whole.astype(np.int64) * scale + np.round((value - whole) * scale).astype(np.int64)


def _parts(key: str) -> list[str]:
    """Return the fields of the quaternion that a key may name an angle of; none where its last word is no angle."""
    before, _, last = key.rpartition(".")
    return [f"{before}.{part}" if before else part for part in _QUATERNION] if last in _ANGLES else []


def _angle(
    which: str, x: NDArray[np.float64], y: NDArray[np.float64], z: NDArray[np.float64], w: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return one of the angles of the rotations about z, then y, then x; NaN for what is no rotation."""
    length = np.sqrt(x * x + y * y + z * z + w * w)
    with np.errstate(invalid="ignore", divide="ignore"):
        x, y, z, w = (np.where(np.abs(length - 1.0) <= _UNIT_WITHIN, q / length, np.nan) for q in (x, y, z, w))
    if which == "yaw":
        return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    if which == "pitch":
        return np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    return np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))


def reader_of(channel: McapChannel, schema: Schema | None, wanted: list[str], text: list[str]) -> MessageReader:
    """Return a reader of a channel's encoding; each is imported where it is used, for what it compiles.

    Parameters
    ----------
    text : list of str
        Fields whose text may be a time.

    Raises
    ------
    NoReaderError
        The messages cannot be read; says why, and what to do.
    """
    schema_encoding = schema.encoding if schema else ""
    if channel.encoding == "json":
        from kempf.pipeline.ingest.messages.json_reader import JsonReader

        return JsonReader(wanted, text)
    if channel.encoding == "cdr" and schema and schema_encoding == "ros2msg" and schema.data.strip():
        from kempf.pipeline.ingest.messages.cdr_reader import CdrReader

        return CdrReader(schema.name, schema.data.decode("utf-8", errors="replace"), wanted)
    if channel.encoding == "protobuf" and schema and schema_encoding == "protobuf":
        from kempf.pipeline.ingest.messages.protobuf_reader import ProtobufReader

        return ProtobufReader(schema.name, schema.data, wanted)
    raise unread(channel.encoding, schema)
