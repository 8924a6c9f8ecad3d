"""Publishers of one topic: MCAP channels that speak at the same time are sources of their own."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from kempf.pipeline.ingest.mcap.times.arrivals import Arrived
from kempf.pipeline.ingest.spans import Index

#: Messages of each channel, and turns from one to the other, from which two of them speak at the same time. A recorder
#: that is started again, or a bag that is added to another, gives a topic a new channel that follows on the old one.
_LEAST, _TURNS = 20, 4


class Publishers:
    """Which source each channel of a file belongs to; what is decided of a channel stays so."""

    def __init__(self) -> None:
        self._source: dict[int, str] = {}
        #: By topic and source, in the order in which they came.
        self._channels: dict[str, dict[str, list[int]]] = {}

    def decide(self, arrived: Iterable[Arrived]) -> None:
        """Give the channels that are new a source.

        Parameters
        ----------
        arrived : iterable of Arrived
            Messages that follow each other in the file, among them those of the new channels.
        """
        parts: dict[int, list[Index]] = {}
        topics: dict[int, str] = {}
        for one in arrived:
            if one.record.size:
                parts.setdefault(one.channel, []).append(one.record)
                topics[one.channel] = one.topic
        records = {channel: np.concatenate(own) for channel, own in parts.items()}
        for channel in sorted(records.keys() - self._source.keys(), key=lambda channel: int(records[channel].min())):
            topic = topics[channel]
            sources = self._channels.setdefault(topic, {})
            name = topic if not sources else f"{topic}#{len(sources) + 1}"
            for source, others in sources.items():
                if not any(_at_once(records[channel], records[other]) for other in others if other in records):
                    name = source
                    break
            sources.setdefault(name, []).append(channel)
            self._source[channel] = name

    def source(self, channel: int, topic: str) -> str:
        """Return the source of a channel, ``<topic>#2`` and so on for the second publisher of a topic."""
        return self._source.get(channel, topic)

    def notes(self) -> list[str]:
        """Name the topics that have several publishers."""
        return [
            f"Topic {topic} has {len(sources)} publishers that speak at the same time (MCAP channels "
            f"{', '.join(str(own[0]) for own in sources.values())}): each is a source of its own, {', '.join(sources)}."
            for topic, sources in sorted(self._channels.items())
            if len(sources) > 1
        ]


def _at_once(a: Index, b: Index) -> bool:
    """Return whether two channels, given by the numbers of their messages, speak in turns."""
    if min(a.size, b.size) < _LEAST:
        return False
    of_b = np.repeat([False, True], [a.size, b.size])[np.argsort(np.concatenate((a, b)), kind="stable")]
    return int(np.count_nonzero(np.diff(of_b))) >= _TURNS
