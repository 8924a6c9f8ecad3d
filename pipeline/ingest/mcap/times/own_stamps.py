"""Stamps that messages carry although the profile asks for log time: by them it is seen whether log time is even."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.ingest.decoded import NO_TIME, Nanoseconds
from kempf.pipeline.ingest.mcap.container.records import McapChannel, Schema
from kempf.pipeline.ingest.mcap.topics.topics import Route
from kempf.pipeline.ingest.messages.columns import NoReaderError
from kempf.pipeline.ingest.spans import Spans
from kempf.schemas.profile import TimeColumn

#: Where drivers put them: ROS, messages of one's own, Foxglove.
_FIELDS = ("header.stamp", "stamp", "timestamp")
#: Share of a channel's first messages that have to carry one.
_MOST = 0.99


class OwnStamps:
    """Reads the stamps of every channel that has some; its first messages say where they are, if anywhere."""

    def __init__(self) -> None:
        self._routes: dict[McapChannel, Route | None] = {}

    def read(self, channel: McapChannel, schema: Schema | None, payloads: Spans) -> Nanoseconds:
        """Return what messages say of when they were made.

        Parameters
        ----------
        channel : McapChannel
        schema : Schema or None
        payloads : Spans
            Shape (m,).

        Returns
        -------
        ndarray of int64, shape (m,)
            `NO_TIME` where they do not.
        """
        if channel not in self._routes:
            self._routes[channel] = self._found(channel, schema, payloads)
        route = self._routes[channel]
        return np.full(len(payloads), NO_TIME) if route is None else _stamps(route, payloads)

    def _found(self, channel: McapChannel, schema: Schema | None, payloads: Spans) -> Route | None:
        for field in _FIELDS:
            try:
                route = Route(channel, schema, {}, TimeColumn(column=field))
            except NoReaderError:
                continue
            if np.mean(_stamps(route, payloads) != NO_TIME) >= _MOST:
                return route
        return None


def _stamps(route: Route, payloads: Spans) -> Nanoseconds:
    time = route.read(payloads).time_ns
    assert time is not None
    # a driver that fills in no time leaves zeros
    return np.where(time > 0, time, NO_TIME)
