"""The MCAP files of one log: mostly one, several where the parts of a split recording were put behind each other.

Names of parts sort as text, bag_10 before bag_2: files that state when they begin are read in the order of that.

Each has its own summary, and its own numbers for channels and schemas. Here they become one stream with one set of
numbers; how a file is read stands in `stream`.

References
----------
MCAP specification, https://mcap.dev/spec, "File Structure".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TypeVar

import numpy as np

from kempf.pipeline.ingest.decoded import LostStretch
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.container.batch import Batch
from kempf.pipeline.ingest.mcap.container.budget import Budget
from kempf.pipeline.ingest.mcap.container.records import McapChannel, Schema
from kempf.pipeline.ingest.mcap.container.seams import places_of_files
from kempf.pipeline.ingest.mcap.container.stream import McapStream

T = TypeVar("T", McapChannel, Schema)

#: Channels and schemas have numbers of 16 bits; those of later files that mean something else lie above.
_NUMBERS = 1 << 16


class McapFiles:
    """One pass over the MCAP files of a log.

    Parameters
    ----------
    name : str
        Name of the log, for messages.
    log : LogFile

    Attributes
    ----------
    channels, schemas : dict by number
        Complete once `batches` has come to its end. A channel that two files describe alike has one number.
    lost : list of LostStretch
        What could not be read, file by file; complete at the end, as are the notes.
    notes : list of str
    budget : Budget
        How much more the log may hold.
    """

    def __init__(self, name: str, log: LogFile) -> None:
        self.budget = Budget(name, log.size)
        self._places = places_of_files(log)
        self._files = [McapStream(name, log, place, self.budget) for place in self._places]
        order = _order([file.since_ns for file in self._files])
        self._sorted = order != sorted(order)
        self._places, self._files = [self._places[k] for k in order], [self._files[k] for k in order]
        # the numbers of the first file stay
        self.channels: dict[int, McapChannel] = self._files[0].channels
        self.schemas: dict[int, Schema] = self._files[0].schemas
        self.lost: list[LostStretch] = []
        self.notes: list[str] = []
        self._number_of_channel: dict[tuple[int, int], int] = {}
        self._number_of_schema: dict[tuple[int, int], int] = {}
        for k in range(1, len(self._files)):
            self._take_descriptions(k)

    @property
    def partial(self) -> bool:
        """Whether something of the log is lost."""
        return bool(self.lost)

    def batches(self) -> Iterator[Batch]:
        """Read the log.

        Yields
        ------
        Batch
            In the order of each file.

        Raises
        ------
        DataRejected
            ``log_too_large``, ``too_many_records``: it unpacks to far more than a log of its size holds.
        """
        for k, (file, (begin, _)) in enumerate(zip(self._files, self._places, strict=True)):
            for batch in file.batches():
                yield self._renumbered(k, batch) if k else batch
            self.lost += file.lost
            self.notes += [f"In the file from byte {begin} on: {note}" if begin else note for note in file.notes]
        if len(self._files) > 1:
            how = "in the order of their times" if self._sorted else "one after the other"
            self.notes.append(f"The log is {len(self._files)} MCAP files behind each other, which were read {how}.")

    def _renumbered(self, k: int, batch: Batch) -> Batch:
        self._take_descriptions(k)
        own, place = np.unique(batch.channel, return_inverse=True)
        ours = [self._number_of_channel.get((k, n), k * _NUMBERS + n) if n >= 0 else -1 for n in own.tolist()]
        return replace(batch, channel=np.array(ours, dtype=np.int64)[place])

    def _take_descriptions(self, k: int) -> None:
        """Give the schemas and channels of a file that are new their numbers."""
        file, above = self._files[k], k * _NUMBERS
        schemas, channels = self._number_of_schema, self._number_of_channel
        if new := [own for own in file.schemas if (k, own) not in schemas]:
            _give_numbers(self.schemas, {own: file.schemas[own] for own in new}, schemas, k)
        if new := [own for own in file.channels if (k, own) not in channels]:
            described = {}
            for own in new:
                channel = file.channels[own]
                # 0 is no schema
                schema = schemas.get((k, channel.schema), above + channel.schema) if channel.schema else 0
                described[own] = replace(channel, schema=schema)
            _pair(self.channels, described, channels, k)


def _order(since_ns: list[int | None]) -> list[int]:
    """Return the order in which files are read, given when they begin; that of the log where one does not say it."""
    stated = [since for since in since_ns if since is not None]
    order = list(range(len(since_ns)))
    return sorted(order, key=stated.__getitem__) if len(stated) == len(order) else order


def _give_numbers(known: dict[int, T], new: dict[int, T], number_of: dict[tuple[int, int], int], k: int) -> None:
    """Give what is new of the k-th file the number of what was known before and is the same, else one of its own."""
    numbers = {one: number for number, one in reversed(known.items())}
    for own, one in new.items():
        number = numbers.setdefault(one, k * _NUMBERS + own)
        known.setdefault(number, one)
        number_of[k, own] = number


def _pair(
    known: dict[int, McapChannel], new: dict[int, McapChannel], number_of: dict[tuple[int, int], int], k: int
) -> None:
    """Do so for channels, of which several may be the same: publishers of one topic, paired in their order."""
    taken = {number for (file, _), number in number_of.items() if file == k}
    for own, one in new.items():
        free = (number for number, other in known.items() if other == one and number not in taken)
        number = next(free, k * _NUMBERS + own)
        taken.add(number)
        known.setdefault(number, one)
        number_of[k, own] = number
