"""Which numbers the messages of an MCAP log hold, topic by topic, for a person who writes its profile."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import islice
from math import isfinite
from typing import Any

import numpy as np

from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.container.files import McapFiles
from kempf.pipeline.ingest.mcap.container.records import McapChannel, Schema
from kempf.pipeline.ingest.mcap.topics import sentences
from kempf.pipeline.ingest.mcap.topics.joint_names import joint_names
from kempf.pipeline.ingest.mcap.topics.topics import reader_of
from kempf.pipeline.ingest.messages.columns import NoReaderError
from kempf.pipeline.ingest.spans import Spans, as_bytes
from kempf.schemas.known_messages import OFFERED, TAKEN, in_ned, plain_name
from kempf.schemas.profile import ChannelMap

#: Stretches of the file in which a message of every topic is looked for, and how deep its fields may lie.
_MOST, _DEEPEST = 8, 8

#: Messages of each channel that are looked at, for a first one may be empty.
_MESSAGES = 16

#: The end of a `frame_id` whose axes point north, east and down, in CDR and in JSON, and how far it may be to there.
_NED, _HEADER = (b"_ned\0", b'_ned"'), 256

#: Longest list whose elements are offered one by one; a longer one is a matrix, a scan or a picture.
_LONGEST = 8

#: What says when or the how-many-eth a message is, and not what was measured.
_TIMES = frozenset(
    (
        *("header", "stamp", "timestamp", "status", "time", "t", "utc", "epoch", "sec", "nsec", "nanosec"),
        *("secs", "nsecs", "seq", "sequence", "counter", "id"),
    )
)

#: Field -> the channel that it is by the definition of its message, or the name that the log gives it; None where
#: nobody but a person knows.
Fields = dict[str, ChannelMap | str | None]


def fields_of(name: str, log: LogFile) -> dict[str, Fields]:
    """Return the fields of every topic that hold one number each; none of a topic whose messages cannot be read.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    log : LogFile

    Raises
    ------
    DataRejected
        The file unpacks to far more than a log of its size holds.
    """
    stream = McapFiles(name, log)
    first = _first_messages(stream)
    topics: dict[str, Fields] = {}
    for number, channel in stream.channels.items():
        schema = stream.schemas.get(channel.schema)
        kind = plain_name(schema.name) if schema else ""
        messages = first.get(number, [b""])
        offered = OFFERED.get(kind, {})
        if any(end in message[:_HEADER] for message in messages for end in _NED):
            offered = {field: in_ned(mapped) for field, mapped in offered.items()}
        known: dict[str, ChannelMap] = TAKEN.get(kind, {}) | offered
        fields: Fields = dict(known)
        for message in messages:
            fields = fields | {k: None for k in numbers_of(channel, schema, message) if k not in fields}
            if kind == "sensor_msgs/JointState":
                named = {str(k): name for k, name in enumerate(joint_names(message))}
                fields |= {key: named.get(key.rpartition(".")[2]) for key, one in fields.items() if one is None}
        topics.setdefault(channel.topic, {}).update(fields)
    return dict(sorted(topics.items()))


def obstacles(name: str, log: LogFile) -> dict[str, str]:
    """Return why topics hold no number that can be read, as sentences, each with what to do.

    Parameters
    ----------
    name, log
        See `fields_of`.
    """
    stream = McapFiles(name, log)
    found, spoken = {}, set()
    for number, messages in _first_messages(stream).items():
        if (channel := stream.channels.get(number)) is None:
            continue
        if any(map(sentences.holds_sentence, messages)):
            spoken.add(channel.topic)
        try:
            reader_of(channel, stream.schemas.get(channel.schema), [], [])
        except NoReaderError as why:
            found[f"Topic {channel.topic} {why}."] = why.next_step
    return {sentences.about(spoken): sentences.NEXT_STEP} | found if spoken else found


def _first_messages(stream: McapFiles) -> dict[int, list[bytes]]:
    """Return the first messages of every channel that has some in the first stretches of the file."""
    first: dict[int, list[bytes]] = {}
    for batch in islice(stream.batches(), _MOST):
        for number in np.unique(batch.channel).tolist():
            own = first.setdefault(number, [])
            for at in np.flatnonzero(batch.channel == number)[: _MESSAGES - len(own)].tolist():
                own.append(batch.content[batch.first[at] : batch.end[at]].tobytes())
        if first.keys() >= stream.channels.keys():
            break
    return first


def numbers_of(channel: McapChannel, schema: Schema | None, message: bytes | None) -> Iterator[str]:
    """Yield the fields of a message that hold a number, but for times and counters."""
    try:
        if channel.encoding == "json":
            yield from _of_json(json.loads(message or b"{}"), "", 0)
        elif schema and (channel.encoding, schema.encoding) == ("cdr", "ros2msg"):
            yield from _of_cdr(schema, message or b"")
        elif schema and channel.encoding == schema.encoding == "protobuf":
            yield from _of_protobuf(schema)
    except (NoReaderError, ValueError, RecursionError):
        return


def _of_json(value: Any, path: str, depth: int) -> Iterator[str]:
    if isinstance(value, dict) and depth < _DEEPEST:
        for key, below in value.items():
            if not _is_time(key):
                yield from _of_json(below, f"{path}.{key}" if path else key, depth + 1)
    elif path and isinstance(value, list) and len(value) <= _LONGEST and depth < _DEEPEST:
        for k, below in enumerate(value):
            yield from _of_json(below, f"{path}.{k}", depth + 1)
    elif path and _is_number(value):
        yield path


def _is_number(value: Any) -> bool:
    """Return whether a value is read as a number, be it as text."""
    try:
        return not isinstance(value, bool) and isinstance(value, int | float | str) and isfinite(float(value))
    except (ValueError, OverflowError):
        return False


def _of_cdr(schema: Schema, message: bytes) -> Iterator[str]:
    from kempf.pipeline.ingest.messages.cdr_definition import PRIMITIVES, full_name, types_of

    types = types_of(schema.name, schema.data.decode("utf-8", errors="replace"))

    def below(name: str, path: str, depth: int) -> Iterator[str]:
        for own in types[name] if depth < _DEEPEST else ():
            if own.count is not None and own.kind in PRIMITIVES and not own.name.endswith("covariance"):
                yield from _elements(schema, f"{path}{own.name}", own.count, message)
            elif own.count is None and not _is_time(own.name) and own.kind != "std_msgs/MultiArrayLayout":
                if own.kind in PRIMITIVES:
                    yield path + own.name
                elif own.kind == "geometry_msgs/Quaternion":
                    yield f"{path}{own.name}.yaw"
                elif own.kind in types:
                    yield from below(own.kind, f"{path}{own.name}.", depth + 1)

    yield from below(full_name(schema.name, ""), "", 0)


def _elements(schema: Schema, path: str, count: int, message: bytes) -> Iterator[str]:
    """Yield the elements of a list of numbers; of one of any length (-1) those that a message has."""
    if count < 0 and message:
        from kempf.pipeline.ingest.messages.cdr_reader import CdrReader

        # one more shows a list that is too long
        wanted = [f"{path}.{k}" for k in range(_LONGEST + 1)]
        try:
            reader = CdrReader(schema.name, schema.data.decode("utf-8", errors="replace"), wanted)
        except NoReaderError:
            return
        payload = Spans(as_bytes(message), np.zeros(1, dtype=np.int64), np.full(1, len(message)))
        count = int(reader.read(payload).present.sum())
    if count <= _LONGEST:
        yield from (f"{path}.{k}" for k in range(count))


def _of_protobuf(schema: Schema) -> Iterator[str]:
    from kempf.pipeline.ingest.messages.protobuf_reader import MESSAGE_TYPE, NUMBERS, proto_types_of

    types = proto_types_of(schema.data)

    def below(name: str, path: str, depth: int) -> Iterator[str]:
        for key, own in types.get(name, {}).items() if depth < _DEEPEST else ():
            if not own.repeated and not _is_time(key):
                if own.kind == MESSAGE_TYPE:
                    yield from below(own.type_name, f"{path}{key}.", depth + 1)
                elif own.kind in NUMBERS:
                    yield path + key

    yield from below(f".{schema.name}", "", 0)


def _is_time(key: str) -> bool:
    return key.lower() in _TIMES
