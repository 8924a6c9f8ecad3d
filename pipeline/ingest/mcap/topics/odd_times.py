"""What stands in the field that a profile names as the time and is no time as it says, and what to write instead."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.ingest.decoded import Nanoseconds
from kempf.pipeline.ingest.messages.columns import Columns
from kempf.pipeline.ingest.text.times import NS_PER
from kempf.schemas.errors import UsageError
from kempf.schemas.profile import TimeColumn
from kempf.schemas.units import SECOND_NS

#: Nanoseconds since 1970 of the years in which a clock that is set may be, 2000 to 2100.
_SINCE_NS, _UNTIL_NS = 946_684_800 * SECOND_NS, 4_102_444_800 * SECOND_NS

_FORMS = "a number with `unit: s`, ms, us, ns or d, text as in ISO 8601 without a unit, or a stamp of sec and nanosec"


@dataclass(frozen=True)
class OddTime:
    """The first value of the field that is there and no time."""

    #: As it stands in the message, or what it is.
    found: str
    #: What to write into the profile instead.
    next_step: str

    def refusal(self, name: str, column: str, topic: str) -> UsageError:
        """Return the error of a log in which no message has another time.

        Parameters
        ----------
        name : str
            Name of the log.
        column : str
            The field.
        topic : str
            One whose messages have it.
        """
        return UsageError(
            "no_time_column",
            f"The source for {name} takes its time from {column!r}, which no message that it maps has as a time "
            f"that is written so; the first of {topic} has {self.found}. Read are {_FORMS}.",
            self.next_step,
            {"name": name, "column": column, "topic": topic, "found": self.found},
        )


def odd_time(columns: Columns, slot: int, time: Nanoseconds, stated: TimeColumn) -> OddTime | None:
    """Return the first value that is no time, None where there is none.

    Parameters
    ----------
    columns : Columns
        Of m messages.
    slot : int
        Which of them is the time.
    time : ndarray of int64, shape (m,)
        What was read of it, nanoseconds; negative where it is none.
    stated : TimeColumn
        How the profile says that it is written.
    """
    odd = np.flatnonzero(columns.good & columns.present[slot] & (time < 0))
    if not odd.size:
        return None
    first = int(odd[0])
    at, text = columns.text.get(slot, (np.empty(0, dtype=np.int64), None))
    if text is not None and first in at:
        quoted = repr(text[int(np.searchsorted(at, first))])
        step = "Leave out the unit: the text says it." if stated.unit else "Name another time, or leave 'time' out."
        return OddTime(quoted, step)
    value = float(columns.value[slot, first])
    if not np.isfinite(value):
        return OddTime("neither a number nor text", "Name a field below it, or leave 'time' out.")
    fitting = [unit for unit, each in NS_PER.items() if unit != "d" and _SINCE_NS <= value * each <= _UNTIL_NS]
    step = f"Write `unit: {fitting[0]}` beside the column." if fitting else "Name another time, or leave 'time' out."
    return OddTime(f"{value:.0f}" if value == np.floor(value) else f"{value:.17g}", step)
