"""The recorder's times of MCAP messages: which of the two that each has, and in which unit it was written."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.ingest.decoded import Nanoseconds
from kempf.pipeline.ingest.mcap.container.batch import Batch
from kempf.pipeline.ingest.screen import CLOCK_FIRST_NS, CLOCK_LAST_NS
from kempf.pipeline.ingest.text.times import NS_PER
from kempf.schemas.profile import TimeColumn

#: The times that every message has.
TIMES = ("log_time", "publish_time")


class RecorderTime:
    """Reads the time of messages from their heads; the first messages decide how.

    Parameters
    ----------
    time : TimeColumn or None
        Of the profile.
    """

    def __init__(self, time: TimeColumn | None) -> None:
        self._named = time.column if time is not None and time.column in TIMES else None
        self._clock = self._named or TIMES[0]
        self._unit = (time.unit if time is not None and self._named else None) or "ns"
        self._factor: int | None = None
        #: What a person should know.
        self.notes: list[str] = []

    def of(self, batch: Batch) -> Nanoseconds:
        """Return the times of messages, a copy, shape (m,), UTC nanoseconds."""
        if self._factor is None and batch.log_time.size and not batch.lost:
            self._decide(batch)
        time = batch.log_time if self._clock == TIMES[0] else batch.publish_time
        factor = self._factor or 1
        if factor == 1:
            return time.copy()
        most = np.iinfo(np.int64).max // factor
        return np.where(time <= most, np.minimum(time, most) * factor, np.iinfo(np.int64).max)

    def _decide(self, batch: Batch) -> None:
        if self._clock == TIMES[0] and not batch.log_time.any() and _is_set(batch.publish_time):
            self._clock = TIMES[1]
            self.notes.append("The log times are all 0: the messages have their publish_time.")
        time = batch.log_time if self._clock == TIMES[0] else batch.publish_time
        factor = NS_PER[self._unit]
        # MCAP counts nanoseconds, and a writer that does is believed before the profile
        if factor > 1 and _is_set(time):
            self.notes.append(
                f"The {self._clock} is in nanoseconds, as MCAP has it, and not in {self._unit}, as the profile says: "
                "take `unit` out."
            )
            factor = 1
        self._factor = factor


def _is_set(time_ns: Nanoseconds) -> bool:
    """Return whether most times are those of a clock that was set."""
    return bool(np.mean((time_ns >= CLOCK_FIRST_NS) & (time_ns < CLOCK_LAST_NS)) > 0.5)
