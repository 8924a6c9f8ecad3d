"""MCAP logs with JSON messages: topics and fields to canonical channels, as the profile maps them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.ingest.decoded import CODE, NO_TIME, Decoded, Values
from pipeline.ingest.mapping import check_once
from pipeline.ingest.mcap_chunks import Batch, Container, open_container
from pipeline.ingest.mcap_json import fields_of
from pipeline.ingest.numerals import number
from pipeline.ingest.readings import Reason
from pipeline.ingest.spans import Spans
from schemas.errors import DataRejected, UsageError
from schemas.profile import ChannelMap, Source

_TIMES = ("log_time", "publish_time")


@dataclass(frozen=True, eq=False)
class _Messages:
    """All messages of a file behind each other."""

    payload: Spans
    topic: NDArray[np.int64]
    time: NDArray[np.int64]
    lost: NDArray[np.bool_]


def decode(name: str, data: bytes, source: Source | None, patterns: list[str]) -> Decoded:
    """Decode an MCAP log as the profile's source describes it.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    data : bytes
        The whole file.
    source : Source or None
        Its keys are ``<topic>.<field>``, nested fields with dots; its time, where given, names ``log_time`` (also taken
        where nothing is given) or ``publish_time``.
    patterns : list of str
        File patterns of the profile, for the message where none fits.

    Returns
    -------
    Decoded

    Raises
    ------
    UsageError
        The profile has no source for the file, or names a time that MCAP does not have.
    DataRejected
        A topic that the profile maps is not in the file.
    """
    found = open_container(data)
    topics = tuple(sorted({topic for topic, _ in found.channels.values()}))
    if source is None or not source.channels:
        raise UsageError(
            "no_source_for_log",
            f"{name} is an MCAP file, for which the profile maps no topic; "
            f"its topics are {', '.join(topics) or 'none'}.",
            "Add a source to the profile that maps '<topic>.<field>' to channels. See docs/profile.md.",
            {"name": name, "topics": list(topics), "patterns": patterns},
        )
    clock = source.time.column if source.time else _TIMES[0]
    if clock not in _TIMES:
        raise UsageError(
            "no_time_column",
            f"The source for {name} takes its time from {clock!r}; an MCAP message has {' and '.join(_TIMES)}.",
            "Name one of these as the column of 'time', or leave 'time' out.",
            {"name": name, "column": clock},
        )
    mapped = _by_topic(name, source, topics, found)
    messages = _messages(found, topics, clock)
    reason, channels = _read_topics(found, messages, topics, mapped)
    reason[messages.lost | (messages.topic < 0)] = CODE[Reason.MALFORMED]
    time = np.where(messages.topic < 0, NO_TIME, messages.time)
    return Decoded(messages.payload, messages.payload, time, messages.topic, topics, reason, channels, found.notes)


def _by_topic(name: str, source: Source, topics: tuple[str, ...], found: Container) -> dict[str, dict[str, ChannelMap]]:
    """Split the profile's keys into topic and field, by the topics that the file has."""
    mapped: dict[str, dict[str, ChannelMap]] = {}
    missing = []
    for key, channel in source.channels.items():
        fitting = [topic for topic in topics if key.startswith(topic + ".")]
        if not fitting:
            missing.append(key)
            continue
        topic = max(fitting, key=len)
        mapped.setdefault(topic, {})[key[len(topic) + 1 :]] = channel
    if missing and not found.partial:
        raise DataRejected(
            "topics_missing",
            f"{name} lacks topics that the profile maps: {', '.join(missing)}; it has {', '.join(topics) or 'none'}.",
            "Mend the keys '<topic>.<field>' in the profile's source, or take out those that this logger lacks.",
            {"name": name, "missing": missing, "found": list(topics)},
        )
    if missing:
        found.notes.append(f"What is left of the file has no topic for {', '.join(missing)}.")
    return mapped


def _messages(found: Container, topics: tuple[str, ...], clock: str) -> _Messages:
    """Lay all batches behind each other in one buffer, with one spare byte behind each."""
    place = {topic: k for k, topic in enumerate(topics)}
    table = np.full(1 << 16, -1, dtype=np.int64)
    for number_of, (topic, _) in found.channels.items():
        table[number_of] = place[topic]
    used = [_slim(batch) for batch in found.batches]
    base = np.concatenate(([0], np.cumsum([b.content.size + 1 for b in used]))).astype(np.int64)
    buffer = np.full(int(base[-1]), 32, dtype=np.uint8)
    for batch, at in zip(used, base[:-1], strict=True):
        buffer[at : at + batch.content.size] = batch.content

    def all_of(parts: list[NDArray[np.int64]]) -> NDArray[np.int64]:
        return np.concatenate([np.empty(0, dtype=np.int64), *parts])

    channel = all_of([b.channel for b in used])
    return _Messages(
        Spans(
            buffer,
            all_of([b.first + at for b, at in zip(used, base[:-1], strict=True)]),
            all_of([b.end + at for b, at in zip(used, base[:-1], strict=True)]),
        ),
        np.where(channel < 0, -1, table[np.maximum(channel, 0)]),
        all_of([getattr(b, clock) for b in used]),
        np.concatenate([np.zeros(0, np.bool_), *(np.full(b.first.size, b.lost) for b in used)]).astype(np.bool_),
    )


def _slim(batch: Batch) -> Batch:
    """Return a batch without the bytes in front of its first message and behind its last one."""
    if batch.first.size == 0 or batch.lost:
        return batch
    low, high = int(batch.first[0]), int(batch.end[-1])
    return Batch(
        batch.content[low:high],
        batch.first - low,
        batch.end - low,
        batch.channel,
        batch.log_time,
        batch.publish_time,
    )


def _read_topics(
    found: Container, messages: _Messages, topics: tuple[str, ...], mapped: dict[str, dict[str, ChannelMap]]
) -> tuple[NDArray[np.int8], dict[str, Values]]:
    """Return the reason of every message and the channels, read topic by topic."""
    n = len(messages.payload)
    reason = np.zeros(n, dtype=np.int8)
    channels: dict[str, Values] = {}
    encodings: dict[str, set[str]] = {}
    for topic, encoding in found.channels.values():
        encodings.setdefault(topic, set()).add(encoding)
    for k, topic in enumerate(topics):
        record = np.flatnonzero((messages.topic == k) & ~messages.lost)
        foreign = encodings[topic] - {"json"}
        check_once(f"{topic}", mapped.get(topic, {}))
        if topic not in mapped or foreign:
            reason[record] = CODE[Reason.NO_CHANNEL]
            if topic in mapped:
                kinds = ", ".join(sorted(foreign)) or "no encoding"
                found.notes.append(f"Topic {topic} is encoded as {kinds}; only JSON is read.")
            continue
        if record.size == 0:
            continue
        text, good = fields_of(messages.payload.take(record), list(mapped[topic]))
        reason[record[~good]] = CODE[Reason.MALFORMED]
        for column, (field_name, channel) in zip(text.columns, mapped[topic].items(), strict=True):
            there = text[column].is_not_null().to_numpy() & good
            if not there.any():
                found.notes.append(f"No message of {topic} has the field {field_name}.")
            value = number(text[column]) * channel.factor + channel.offset_si
            channels.setdefault(channel.channel, Values.empty(n)).put(record[there], value[there])
    unmapped = [topic for topic in topics if topic not in mapped]
    if unmapped:
        found.notes.append(f"Topics without a channel: {', '.join(unmapped)}.")
    return reason, channels
