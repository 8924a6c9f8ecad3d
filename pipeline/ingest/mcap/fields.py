"""Which numbers the messages of an MCAP log hold, topic by topic, for a person who writes its profile."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np

from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.files import McapFiles
from kempf.pipeline.ingest.mcap.records import McapChannel, Schema
from kempf.pipeline.ingest.messages.columns import NoReaderError
from kempf.schemas.known_messages import OFFERED, TAKEN, plain_name
from kempf.schemas.profile import ChannelMap

#: Stretches of the file in which a message of every topic is looked for, and how deep its fields may lie.
_MOST, _DEEPEST = 8, 8

#: Field -> the channel that it is by the definition of its message; None where nobody but a person knows.
Fields = dict[str, ChannelMap | None]


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
        known: dict[str, ChannelMap] = TAKEN.get(kind, {}) | OFFERED.get(kind, {})
        fields: Fields = dict(known)
        fields.update(dict.fromkeys(k for k in numbers_of(channel, schema, first.get(number)) if k not in fields))
        topics.setdefault(channel.topic, {}).update(fields)
    return dict(sorted(topics.items()))


def _first_messages(stream: McapFiles) -> dict[int, bytes]:
    """Return the first message of every channel that has one in the first stretches of the file."""
    first: dict[int, bytes] = {}
    for batch in islice(stream.batches(), _MOST):
        numbers, places = np.unique(batch.channel, return_index=True)
        for number, at in zip(numbers.tolist(), places.tolist(), strict=True):
            first.setdefault(number, batch.content[batch.first[at] : batch.end[at]].tobytes())
        if first.keys() >= stream.channels.keys():
            break
    return first


def numbers_of(channel: McapChannel, schema: Schema | None, message: bytes | None) -> Iterator[str]:
    """Yield the fields that hold a number, but for time stamps."""
    try:
        if channel.encoding == "json":
            yield from _of_json(json.loads(message or b"{}"), "", 0)
        elif schema and (channel.encoding, schema.encoding) == ("cdr", "ros2msg"):
            yield from _of_cdr(schema)
        elif schema and channel.encoding == schema.encoding == "protobuf":
            yield from _of_protobuf(schema)
    except (NoReaderError, ValueError, RecursionError):
        return


def _of_json(value: Any, path: str, depth: int) -> Iterator[str]:
    if isinstance(value, dict) and depth < _DEEPEST:
        for key, below in value.items():
            if not _is_time(key):
                yield from _of_json(below, f"{path}.{key}" if path else key, depth + 1)
    elif path and isinstance(value, int | float) and not isinstance(value, bool):
        yield path


def _of_cdr(schema: Schema) -> Iterator[str]:
    from kempf.pipeline.ingest.messages.cdr_definition import PRIMITIVES, full_name, types_of

    types = types_of(schema.name, schema.data.decode("utf-8", errors="replace"))

    def below(name: str, path: str, depth: int) -> Iterator[str]:
        for own in types[name] if depth < _DEEPEST else ():
            if own.count is None and not _is_time(own.name):
                if own.kind in PRIMITIVES:
                    yield path + own.name
                elif own.kind == "geometry_msgs/Quaternion":
                    yield f"{path}{own.name}.yaw"
                elif own.kind in types:
                    yield from below(own.kind, f"{path}{own.name}.", depth + 1)

    yield from below(full_name(schema.name, ""), "", 0)


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
    return key in ("header", "stamp", "timestamp", "status")
