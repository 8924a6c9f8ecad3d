"""Which messages give the fields that are mapped: a field that ends on the way may go on under another name."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.ingest.decoded import Flag, Nanoseconds
from kempf.pipeline.ingest.mcap.container.records import McapChannel, Schema
from kempf.pipeline.ingest.mcap.topics.fields import numbers_of
from kempf.pipeline.ingest.spans import Index, Spans
from kempf.schemas.instants import iso_cut

#: Messages without a field before its first one, or after its last one, that are worth a note, and their share of all.
_MANY, _SHARE = 20, 0.05
#: Names that a note offers, at most.
_NAMED = 6


@dataclass(frozen=True, eq=False)
class _Field:
    """One mapped field in the messages of one channel that stand in one part of the file."""

    #: record, present, time_ns: Shape (m,).
    record: Index
    present: Flag
    time_ns: Nanoseconds
    payloads: Spans
    channel: McapChannel
    schema: Schema | None


@dataclass(eq=False)
class _Ends:
    """What is known of a field so far."""

    messages: int = 0
    #: Messages before the first that gives it, and after the last that does.
    before: int = 0
    after: int = 0
    seen: bool = False
    #: Of the first message that gives it, and of the first behind the last one, UTC nanoseconds.
    since_ns: int = 0
    until_ns: int = 0
    #: The numbers that the first message of the log has, and the first behind the last one that gives it.
    first: tuple[str, ...] = ()
    last: tuple[str, ...] = ()


class FieldsSeen:
    """Takes note of every mapped field as the parts of a file are read."""

    def __init__(self) -> None:
        self._ends: dict[tuple[str, str], _Ends] = {}
        self._part: dict[tuple[str, str], list[_Field]] = {}

    def seen(self, topic: str, key: str) -> bool:
        """Return whether any message of a topic gave a field."""
        return (topic, key) in self._ends and self._ends[topic, key].seen

    def topics(self) -> set[str]:
        """Return the topics of which any message gave a field, the part that is being read left out."""
        return {topic for (topic, _), ends in self._ends.items() if ends.seen}

    def add(
        self,
        key: str,
        record: Index,
        present: Flag,
        time_ns: Nanoseconds,
        payloads: Spans,
        channel: McapChannel,
        schema: Schema | None,
    ) -> None:
        """Take the whole messages of one channel within a part.

        Parameters
        ----------
        key : str
            The field.
        record, present, time_ns : ndarray, shape (m,)
            Numbers of the messages, ascending, whether they give it, and their times.
        payloads : Spans
            Shape (m,).
        channel, schema : McapChannel, Schema or None
        """
        if record.size:
            own = _Field(record, present, time_ns, payloads, channel, schema)
            self._part.setdefault((channel.topic, key), []).append(own)

    def end_part(self) -> None:
        """Count what was added, in the order of the file."""
        for name, fields in self._part.items():
            self._count(self._ends.setdefault(name, _Ends()), fields)
        self._part.clear()

    def _count(self, ends: _Ends, fields: list[_Field]) -> None:
        if len(fields) == 1:
            (one,) = fields
            order, present, time = np.arange(one.record.size), one.present, one.time_ns
        else:
            order = np.argsort(np.concatenate([one.record for one in fields]), kind="stable")
            present = np.concatenate([one.present for one in fields])[order]
            time = np.concatenate([one.time_ns for one in fields])[order]
        (given,) = np.nonzero(present)
        if not ends.messages and not present[0]:
            ends.first = _numbers(fields, int(order[0]))
        if not ends.seen and given.size:
            ends.seen, ends.since_ns = True, int(time[given[0]])
            ends.before += int(given[0])
        elif not ends.seen:
            ends.before += present.size
        begins = int(given[-1]) + 1 if given.size else 0
        if given.size:
            ends.after = 0
        if ends.seen and begins < present.size:
            if ends.after == 0:
                ends.until_ns, ends.last = int(time[begins]), _numbers(fields, int(order[begins]))
            ends.after += present.size - begins
        ends.messages += present.size

    def notes(self) -> list[str]:
        """Name the fields that begin late or end early."""
        notes = []
        for (topic, key), ends in self._ends.items():
            if not ends.seen:
                continue
            for many, numbers, where, at in (
                (ends.before, ends.first, "first", ends.since_ns),
                (ends.after, ends.last, "last", ends.until_ns),
            ):
                # what the instrument itself says is void is there
                if many < _MANY or many < _SHARE * ends.messages or key in numbers:
                    continue
                named = ", ".join(numbers[:_NAMED])
                when = f"{'until' if where == 'first' else 'from'} {iso_cut(at)}"
                notes.append(
                    f"The {where} {many} of {ends.messages} messages of {topic}, {when}{' on' * (where == 'last')}, do "
                    f"not give the field {key}{f'; they have {named}' if named else ''}. If it has another name there, "
                    "cut the log in two at that instant, and give each part a source with its name."
                )
        return notes


def _numbers(fields: list[_Field], at: int) -> tuple[str, ...]:
    """Return the fields of one message, by its place in the parts behind each other, that hold a number."""
    for one in fields:
        if at < one.record.size:
            content = one.payloads.buffer[one.payloads.start[at] : one.payloads.stop[at]].tobytes()
            return tuple(numbers_of(one.channel, one.schema, content))
        at -= one.record.size
    return ()
