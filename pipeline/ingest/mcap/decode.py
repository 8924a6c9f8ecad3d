"""MCAP logs: the messages of every topic to canonical channels, as the profile maps them or their definition says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.ingest.decoded import CODE, NO_TIME, Decoded, Reason
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.container.batch import Batch
from kempf.pipeline.ingest.mcap.container.files import McapFiles
from kempf.pipeline.ingest.mcap.container.records import McapChannel
from kempf.pipeline.ingest.mcap.part import Part, Waiting
from kempf.pipeline.ingest.mcap.times.arrivals import Arrived, by_source
from kempf.pipeline.ingest.mcap.times.clocks import put_right
from kempf.pipeline.ingest.mcap.times.corrected import Corrected
from kempf.pipeline.ingest.mcap.times.own_stamps import OwnStamps
from kempf.pipeline.ingest.mcap.times.publishers import Publishers
from kempf.pipeline.ingest.mcap.times.recorder_time import TIMES, RecorderTime
from kempf.pipeline.ingest.mcap.topics import sentences
from kempf.pipeline.ingest.mcap.topics.fields_seen import FieldsSeen
from kempf.pipeline.ingest.mcap.topics.odd_times import OddTime
from kempf.pipeline.ingest.mcap.topics.topics import DecodedTopics, Route
from kempf.pipeline.ingest.mcap.topics.unmapped import NAMED, unmapped
from kempf.pipeline.ingest.messages.columns import NoReaderError
from kempf.pipeline.ingest.spans import Spans
from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.known_messages import OFFERED, TAKEN, plain_name
from kempf.schemas.profile import ChannelMap, Source

#: Messages of a topic in which NMEA sentences are looked for, and bytes of each.
_LOOKED_AT, _HEAD = 3, 4096

#: Messages that are checked and handed on together. By the first of these it is judged whether the times of a log can
#: be believed; if not, it is read through for them first.
_TOGETHER = 1 << 16


def decode(name: str, log: LogFile, source: Source | None, patterns: list[str]) -> Iterator[Decoded]:
    """Decode an MCAP log as the profile's source describes it, some ten thousand messages at a time.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    log : LogFile
        Must stay open as long as a part is used.
    source : Source or None
        Its keys are ``<topic>.<field>``, nested fields with dots; its time, where given, names ``log_time`` (also taken
        where nothing is given), ``publish_time`` or a field of the messages. Without channels the messages are read
        whose definition says all, see `kempf.schemas.known_messages.TAKEN`.
    patterns : list of str
        File patterns of the profile, for the message where none fits.

    Yields
    ------
    Decoded
        Parts of the log, in the order of the file.

    Raises
    ------
    UsageError
        Neither profile nor definitions say what a topic means (``no_source_for_log``), no message has the time that the
        profile names (``no_time_column``), or two fields of one message are mapped to one channel.
    DataRejected
        A topic that the profile maps is not in the file (``topics_missing``), or it unpacks to far more than a log of
        its size holds.
    """
    yield from _DecodeJob(name, log, source).run(patterns)


def _topics(name: str, log: LogFile, source: Source | None, known: McapFiles) -> set[str]:
    """Return the topics of a file, as far as they decide to which of them a key of the profile belongs.

    The key /a.b.c may be the field c of /a.b or the field b.c of /a. Where the summary does not list the topics, the
    file is read through for them first.
    """
    channels = known.channels
    if not channels and any(key.count(".") > 1 for key in (source.channels if source else ())):
        stream = McapFiles(name, log)
        for _ in stream.batches():
            pass
        channels = stream.channels
    return {channel.topic for channel in channels.values()}


class _DecodeJob:
    """One pass over the file."""

    def __init__(self, name: str, log: LogFile, source: Source | None) -> None:
        self.name, self.log, self.source = name, log, source
        self.stream = McapFiles(name, log)
        self.topics = _topics(name, log, source, self.stream)
        self.keys = dict(source.channels) if source else {}
        self.owners = self._owners()
        time = source.time if source else None
        self.recorder = RecorderTime(time)
        self.time_field = time if time and time.column and time.column not in TIMES else None
        self.routes: dict[int, Route | None] = {}
        self.made: dict[McapChannel, Route | None] = {}
        self.refused: dict[str, NoReaderError] = {}
        self.fields = FieldsSeen()
        self.timed, self.untimed = False, set[str]()
        self.own_stamps, self.publishers = OwnStamps(), Publishers()
        self.numbers: dict[str, set[int]] = {}
        self.corrected, self.records, self.settled = Corrected({}), dict[str, NDArray[np.int64]](), False
        self.places: dict[str, int] = {}
        self.taken: list[str] = []
        self.offered: dict[str, str] = {}
        self.looked_at, self.sentences = set[str](), list[str]()

    def _owners(self) -> dict[str, tuple[str, str]]:
        """Split the profile's keys into topic and field: the longest topic that fits."""
        owners = {}
        for key in self.keys:
            fitting = [topic for topic in self.topics if key.startswith(topic + ".")]
            if fitting:
                topic = max(fitting, key=len)
                owners[key] = (topic, key[len(topic) + 1 :])
        return owners

    def run(self, patterns: list[str]) -> Iterator[Decoded]:
        """Read the file through."""
        first, groups = 0, self._groups()
        sample = next(groups)
        self._settle_clocks(sample)
        for group in chain([sample], groups):
            self._correct(group)
            decoded = replace(group.decoded(self.log, first, tuple(self.places)), instant_std_s=self.corrected.std_s)
            first += group.size
            if not group.ends:
                yield decoded
                continue
            self.require_something(patterns)
            notes = [*self.stream.notes, *self.recorder.notes, *self.corrected.notes, *self._notes()]
            steps = dict.fromkeys(why.next_step for why in self.refused.values() if why.next_step)
            lost = tuple(self.stream.lost)
            yield replace(decoded, notes=notes, lost=lost, next_step=" ".join(steps), ends=True)

    def parts(self) -> Iterator[Part]:
        """Read the file a few megabytes at a time; no more than that is held."""
        first = 0
        for batch in self.stream.batches():
            yield self._part(batch, first)
            first += batch.first.size

    def _groups(self) -> Iterator[Waiting]:
        """Read the file some ten thousand messages at a time, the last of them perhaps none."""
        waiting = Waiting()
        for part in self.parts():
            waiting.add(part)
            if waiting.size >= _TOGETHER:
                yield waiting
                waiting = Waiting()
        waiting.ends = True
        yield waiting

    def _settle_clocks(self, sample: Waiting) -> None:
        """Judge the times of the first messages, and if they cannot be believed, those of all."""
        arrived = [one for part in sample.parts for one in part.arrived]
        corrected = self._put_right(arrived)
        if not sample.ends and corrected.times_ns:
            whole = _DecodeJob(self.name, self.log, self.source)
            arrived = [one for part in whole.parts() for one in part.arrived]
            corrected = self._put_right(arrived)
        self.corrected, self.settled = corrected, True
        sources = by_source(arrived, self._source_of) if corrected.times_ns else []
        self.records = {own.source: own.record for own in sources if own.source in corrected.times_ns}

    def _put_right(self, arrived: list[Arrived]) -> Corrected:
        self.publishers.decide(arrived)
        return put_right(by_source(arrived, self._source_of), stamps_count=self.time_field is not None)

    def _source_of(self, one: Arrived) -> str:
        return self.publishers.source(one.channel, one.topic)

    def _correct(self, group: Waiting) -> None:
        """Give records the times that were put right, and those of a second publisher a source of their own."""
        for part in group.parts:
            for one in part.arrived:
                source = self._source_of(one)
                if source in self.records:
                    at = np.searchsorted(self.records[source], one.record)
                    part.time_ns[one.record - part.first] = self.corrected.times_ns[source][at]
            for number, topic, record in part.shared:
                source = self.publishers.source(number, topic)
                if source != topic:
                    part.topic[record] = self.places.setdefault(source, len(self.places))

    def _part(self, batch: Batch, first: int) -> Part:
        n = batch.first.size
        time = self.recorder.of(batch)
        topic, text = np.full(n, -1, dtype=np.int64), np.zeros(n, dtype=np.bool_)
        part = Part(batch, time, topic, np.zeros(n, dtype=np.int8), text, {}, first)
        for number, record in _by_channel(batch.channel):
            channel = self.stream.channels.get(number)
            if channel is None:
                part.reason[record], time[record] = CODE[Reason.MALFORMED], NO_TIME
                continue
            topic[record] = self.places.setdefault(channel.topic, len(self.places))
            text[record] = channel.encoding == "json"
            if batch.lost:
                part.reason[record] = CODE[Reason.MALFORMED]
            elif (route := self._route(number, channel)) is None:
                part.reason[record] = CODE[Reason.NO_CHANNEL]
                self._look_for_sentences(channel.topic, batch, record)
            else:
                self._read(part, record, number, channel, route)
        self.fields.end_part()
        return part

    def _look_for_sentences(self, topic: str, batch: Batch, record: NDArray[np.int64]) -> None:
        """Look once whether the messages of a topic that nobody asks for hold NMEA sentences."""
        if topic not in self.looked_at:
            self.looked_at.add(topic)
            places = ((batch.first[i], min(batch.end[i], batch.first[i] + _HEAD)) for i in record[:_LOOKED_AT].tolist())
            if any(sentences.holds_sentence(batch.content[first:end].tobytes()) for first, end in places):
                self.sentences.append(topic)

    def _read(self, part: Part, record: NDArray[np.int64], number: int, channel: McapChannel, route: Route) -> None:
        """Decode the messages of one channel."""
        batch, topic = part.batch, channel.topic
        payloads = Spans(batch.content, batch.first[record], batch.end[record])
        self.stream.budget.decode(int((payloads.stop - payloads.start).sum()))
        decoded = route.read(payloads)
        self._note_arrival(part, record, number, channel, decoded, payloads)
        part.reason[record[~decoded.good]] = CODE[Reason.MALFORMED]
        if decoded.time_ns is not None:
            timed = decoded.time_ns >= 0
            self.timed |= bool(timed.any())
            part.time_ns[record[timed]] = decoded.time_ns[timed]
            if not timed[decoded.good].all():
                self.untimed.add(topic)
        good = np.flatnonzero(decoded.good) if not decoded.good.all() else slice(None)
        whole = payloads.take(good) if not isinstance(good, slice) else payloads
        for key, (value, present) in decoded.values.items():
            mapped = route.mapped[key]
            self.fields.add(
                key,
                record[good],
                present[good],
                part.time_ns[record[good]],
                whole,
                channel,
                self.stream.schemas.get(channel.schema),
            )
            if present.any():
                samples = record[present], value[present] * mapped.factor + mapped.offset_si
                part.values.setdefault(mapped.channel, []).append(samples)

    def _note_arrival(
        self,
        part: Part,
        record: NDArray[np.int64],
        number: int,
        channel: McapChannel,
        decoded: DecodedTopics,
        payloads: Spans,
    ) -> None:
        """Keep what the questions of clocks ask for, as long as they are open or the answer has to be applied."""
        numbers = self.numbers.setdefault(channel.topic, set())
        numbers.add(number)
        part.shared.append((number, channel.topic, record))
        if self.settled and not self.records and len(numbers) == 1:
            return
        good = decoded.good
        stamp, value = np.full(record.size, NO_TIME), np.full(record.size, np.nan)
        if decoded.time_ns is not None:
            stamp = np.where(decoded.time_ns >= 0, decoded.time_ns, NO_TIME)
        elif not self.settled:
            stamp = self.own_stamps.read(channel, self.stream.schemas.get(channel.schema), payloads)
        for own, present in decoded.values.values():
            value = np.where(present, own, np.nan)
            break
        part.arrived.append(
            Arrived(
                number, channel.topic, part.first + record[good], part.time_ns[record[good]], stamp[good], value[good]
            )
        )

    def _route(self, number: int, channel: McapChannel) -> Route | None:
        """Return the reader of a channel, None where nothing is asked of it or it cannot be read."""
        if number not in self.routes:
            # channels that say the same have one reader, however many there are
            if channel not in self.made:
                self.made[channel] = self._new_route(channel)
            self.routes[number] = self.made[channel]
        return self.routes[number]

    def _new_route(self, channel: McapChannel) -> Route | None:
        schema = self.stream.schemas.get(channel.schema)
        if channel.topic not in self.topics:
            before = self.owners
            self.topics.add(channel.topic)
            self.owners = self._owners()
            self._refuse_late_owner(before, channel.topic)
        own = {key: owner for key, owner in self.owners.items() if owner[0] == channel.topic}
        mapped = {field: self.keys[key] for key, (_, field) in own.items()}
        kind = plain_name(schema.name) if schema else ""
        if not self.keys and kind in TAKEN:
            mapped = TAKEN[kind]
            self.taken.append(f"{channel.topic} ({', '.join(entry.channel for entry in mapped.values())})")
        elif not mapped and kind in OFFERED:
            self.offered[channel.topic] = _lines(channel.topic, OFFERED[kind])
        if not mapped:
            return None
        try:
            return Route(channel, schema, mapped, self.time_field)
        except NoReaderError as why:
            self.refused[channel.topic] = why
            return None

    def _refuse_late_owner(self, before: dict[str, tuple[str, str]], topic: str) -> None:
        """Refuse a file whose summary leaves out a topic to which a key belongs that was read from another one."""
        misread = [
            key for key, owner in before.items() if self.owners[key] != owner and owner[0] in self.fields.topics()
        ]
        if misread:
            raise DataRejected(
                "summary_incomplete",
                f"{self.name} has the topic {topic!r}, which its summary does not list; {misread[0]!r} was taken for a "
                f"field of {before[misread[0]][0]!r} until then.",
                "Write the file's summary anew, with `mcap recover` for example.",
                {"name": self.name, "topic": topic, "keys": misread},
            )

    def _notes(self) -> list[str]:
        """Say what a person should know of the topics."""
        notes = [f"Topic {topic} {why}." for topic, why in self.refused.items()]
        if self.taken:
            notes.append(f"Read without a profile, by the definition of the messages: {', '.join(self.taken)}.")
        absent = {}
        for number, route in self.routes.items():
            topic = self.stream.channels[number].topic
            for key in route.mapped if route else ():
                if not self.fields.seen(topic, key):
                    why = route.absent.get(key) if route else None
                    absent[topic, key] = f"No message of {topic} has the field {key}{f': {why}' if why else ''}."
        notes += absent.values()
        notes += self.fields.notes()
        assert self.time_field is not None or not self.untimed
        odd, of_times = self._odd_times(), dict.fromkeys(n for r in self.routes.values() if r for n in r.time_notes)
        for topic in sorted(self.untimed):
            column = self.time_field.column if self.time_field else ""
            found = f"have log time where {column} is no time, such as {odd[topic].found}" if topic in odd else ""
            notes.append(f"Messages of {topic} {found or f'without {column} have log time'}.")
        notes += of_times
        notes += self.publishers.notes()
        read = {self.stream.channels[number].topic for number, route in self.routes.items() if route}
        topics = {channel.topic for channel in self.stream.channels.values()}
        others = sorted((set(self.places) & topics) - read - set(self.refused))
        if others:
            more = f" and {len(others) - NAMED} more" if len(others) > NAMED else ""
            notes.append(f"Topics without a channel: {', '.join(others[:NAMED])}{more}.")
        if self.sentences:
            notes.append(f"{sentences.about(self.sentences)} {sentences.NEXT_STEP}")
        for topic, lines in self.offered.items():
            notes.append(f"Topic {topic} is mapped so if its axes are those of REP-103: {lines}.")
        return notes

    def _odd_times(self) -> dict[str, OddTime]:
        """Return by topic the first time of its messages that is not written as the profile says."""
        routes = ((self.stream.channels[number].topic, route) for number, route in self.routes.items())
        return {topic: route.odd_time for topic, route in routes if route and route.odd_time}

    def require_something(self, patterns: list[str]) -> None:
        """Refuse a file of which nothing was asked that it has."""
        topics = sorted({channel.topic for channel in self.stream.channels.values()})
        named = ", ".join(topics[:NAMED]) or "none"
        if not self.keys and not self.taken:
            offers = [lines for _, lines in sorted(self.offered.items())]
            fits = self.source is not None
            raise unmapped(self.name, topics, patterns, fits=fits, offers=offers, spoken=self.sentences)
        if self.time_field is not None and not self.timed:
            column = self.time_field.column or ""
            for topic, odd in self._odd_times().items():
                raise odd.refusal(self.name, column, topic)
            raise UsageError(
                "no_time_column",
                f"The source for {self.name} takes its time from {column!r}, which no message that it maps has; "
                f"every MCAP message has {' and '.join(TIMES)}.",
                "Name one of these or a field of the messages, such as header.stamp, as the column of 'time', "
                "or leave 'time' out.",
                {"name": self.name, "column": column},
            )
        missing = [key for key in self.keys if key not in self.owners]
        if missing and not self.stream.partial:
            raise DataRejected(
                "topics_missing",
                f"{self.name} lacks topics that the profile maps: {', '.join(missing)}; it has {named}.",
                "Correct the keys '<topic>.<field>' in the profile's source, or take out those that this logger lacks.",
                {"name": self.name, "missing": missing, "found": topics},
            )
        if missing:
            self.stream.notes.append(f"What is left of the file has no topic for {', '.join(missing)}.")


def _lines(topic: str, fields: dict[str, ChannelMap]) -> str:
    """Return lines for a profile."""
    lines = []
    for key, entry in fields.items():
        extra = (", positive: port" if entry.positive == "port" else "") + (
            f", offset: {entry.offset:.6g}" if entry.offset else ""
        )
        lines.append(f"'{topic}.{key}: {{channel: {entry.channel}, unit: {entry.unit}{extra}}}'")
    return ", ".join(lines)


def _by_channel(channel: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Yield every channel with its messages, ascending."""
    order = np.argsort(channel, kind="stable")
    cuts = np.flatnonzero(np.diff(channel[order])) + 1
    for record in np.split(order, cuts):
        if record.size:
            yield int(channel[record[0]]), record
