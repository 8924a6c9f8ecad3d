"""Which other runs of a ship without a log tell most of her speed: soon before or after, on other headings.

Between two runs on headings that differ by D a stream along the course moves the speed over ground by up to
2 sin(D / 2) times itself, while the stream wanders by the root of the time between them. The runs that make most of the
first and least of the second come first. Nothing is read here but bounds and headings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.instruments import Instruments
from kempf.schemas.errors import DataRejected
from kempf.schemas.units import SECOND_NS

#: a run farther away in time is of another day: the stream, the load and the engine are others
_SAME_DAY_S = 12 * 3600.0
#: below this angle between the headings a run adds hardly more than one on the same heading
_LEAST_TURN_DEG = 60.0
#: relative difference of the shaft speeds up to which the engine setting counts as the same
_SAME_SHAFT_SPEED = 0.03
#: range of the shaft speed within a run, relative to its median, up to which it is one engine setting: a diesel slows
#: in a turn. Taken from the fifth to the ninety-fifth percentile
_ONE_SETTING, _RANGE = 0.2, (5.0, 95.0)
#: each run more costs as much time as the first, and adds less than the one before
_MOST = 2
#: the log counts for a segment from so many readings on, within so much more at either end, as `make_record` has it
_FEWEST_READINGS, _MARGIN_NS = 20, 5 * SECOND_NS


@dataclass(frozen=True)
class Passage:
    """What is known of a zigzag before it is identified."""

    #: start_utc_ns, end_utc_ns: Bounds, UTC ns.
    start_utc_ns: int
    end_utc_ns: int
    #: Base heading.
    heading_deg: float
    #: Median over the run; None where it was not logged.
    shaft_speed_per_s: float | None = None

    @property
    def middle_s(self) -> float:
        """Middle of the run, UTC s."""
        return 0.5e-9 * (self.start_utc_ns + self.end_utc_ns)


def has_log(instruments: Instruments, start_utc_ns: int, end_utc_ns: int) -> bool:
    """Return whether `kempf.pipeline.estimate.record.cut.make_record` takes the speed of a segment from a log.

    Parameters
    ----------
    instruments : Instruments
        Series of the log.
    start_utc_ns, end_utc_ns : int
        Bounds of the segment, UTC ns.
    """
    log = instruments.get("speed_through_water")
    return log is not None and len(log.between(start_utc_ns - _MARGIN_NS, end_utc_ns + _MARGIN_NS)) >= _FEWEST_READINGS


def shaft_speed(instruments: Instruments, start_utc_ns: int, end_utc_ns: int) -> float | None:
    """Return the median shaft speed of a segment, 1/s, or None where it was not logged."""
    shaft = instruments.get("shaft_speed")
    if shaft is None or not len(part := shaft.between(start_utc_ns, end_utc_ns)):
        return None
    median = float(np.median(part.value))
    return median if np.isfinite(median) else None


def check_engine(instruments: Instruments, start_utc_ns: int, end_utc_ns: int) -> None:
    """Refuse a segment in which the engine was set anew: its speed on a straight course is no longer one.

    Where the shaft speed was not logged, nothing is known of it.

    Raises
    ------
    DataRejected
        ``engine_changed``.
    """
    shaft, median = instruments.get("shaft_speed"), shaft_speed(instruments, start_utc_ns, end_utc_ns)
    if shaft is None or median is None:
        return
    low, high = np.percentile(shaft.between(start_utc_ns, end_utc_ns).value, _RANGE)
    if high - low > _ONE_SETTING * abs(median):
        raise DataRejected(
            "engine_changed",
            f"There is no speed through the water, and the shaft goes from {60.0 * low:.0f} to {60.0 * high:.0f} rpm: "
            "what is estimated in place of a log holds for one engine setting.",
            "Log the speed through the water, or sail the manoeuvre at one engine setting.",
            {"shaft_speed_per_s": [float(low), float(high)]},
        )


def companions_of(run: Passage, others: Sequence[Passage]) -> tuple[int, ...]:
    """Return the indices of the runs to identify beside one, at most two, the most telling first.

    Parameters
    ----------
    others : sequence of Passage
        Of the same ship, none with a log; ``run`` itself may be among them.

    Returns
    -------
    tuple of int
        Zigzags within twelve hours, at the same shaft speed where both have it, on a heading at least
        60 degrees off, that overlap neither the run nor each other.
    """
    ranked = sorted(
        (_wander_over_leverage(run, other), other.start_utc_ns, i)
        for i, other in enumerate(others)
        if _comparable(run, other)
    )
    chosen: list[int] = []
    for _, _, i in ranked:
        if len(chosen) < _MOST and all(_apart(others[i], others[j]) for j in chosen):
            chosen.append(i)
    return tuple(chosen)


def _turn_deg(a: Passage, b: Passage) -> float:
    """Angle between the base headings, 0 to 180 degrees."""
    return abs((a.heading_deg - b.heading_deg + 180.0) % 360.0 - 180.0)


def _apart(a: Passage, b: Passage) -> bool:
    return a.end_utc_ns <= b.start_utc_ns or b.end_utc_ns <= a.start_utc_ns


def _comparable(run: Passage, other: Passage) -> bool:
    shafts = (run.shaft_speed_per_s, other.shaft_speed_per_s)
    same_engine = (
        shafts[0] is None or shafts[1] is None or abs(shafts[0] - shafts[1]) <= _SAME_SHAFT_SPEED * abs(shafts[0])
    )
    return (
        same_engine
        and _apart(run, other)
        and abs(run.middle_s - other.middle_s) <= _SAME_DAY_S
        and _turn_deg(run, other) >= _LEAST_TURN_DEG
    )


def _wander_over_leverage(run: Passage, other: Passage) -> float:
    return float(np.sqrt(abs(run.middle_s - other.middle_s)) / np.sin(np.deg2rad(_turn_deg(run, other) / 2.0)))
