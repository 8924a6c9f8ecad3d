"""Stamps that a logger put in front of sentences: spread where they are coarse, put right where its clock is off."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.ingest.bursts import spread
from kempf.pipeline.ingest.decoded import NO_TIME, Flag, Nanoseconds
from kempf.pipeline.ingest.nmea.receiver import ARRIVES_NS
from kempf.pipeline.ingest.spans import Index
from kempf.schemas.units import DAY_NS, SECOND_NS

#: A receiver that sends so late, or a clock that is so far off or leaps so far, is worth a note, ns.
_WORTH_NS = SECOND_NS // 2
#: Fixes that can put a clock right: one may have waited.
_FEWEST = 5
#: Fixes on either side over which the lead of the stamps is a median, and fixes that are worked on at a time.
_BESIDE, _MANY = 15, 100_000


@dataclass(frozen=True, eq=False)
class LoggerTimes:
    """Times of arrival by the logger."""

    #: Shape (n,). `NO_TIME` where a line has none.
    time_utc_ns: Nanoseconds
    #: What a person should know of what was done to them.
    notes: tuple[str, ...] = ()
    #: Shape (n,). Within what time about it a line was sent, ns, see `kempf.pipeline.ingest.bursts.Spread`; None where
    #: each has its own stamp.
    share_ns: Nanoseconds | None = None
    #: Whether how far the logger's clock is ahead of the receiver's is known to the share of a fix alone.
    doubtful: bool = False


def put_evenly(stamp_ns: Nanoseconds, source: Index) -> LoggerTimes:
    """Spread the sentences that share a stamp over its time, as `kempf.pipeline.ingest.bursts.spread` does, and say so.

    Parameters
    ----------
    stamp_ns : ndarray of int64, shape (n,)
        `NO_TIME` where a line has none.
    source : ndarray of int64, shape (n,)
        Which instrument a line comes from; -1 where none is read.
    """
    found = spread(stamp_ns, source)
    if found.lasting_ns is None:
        return LoggerTimes(stamp_ns)
    if found.whole:
        note = (
            "The logger's stamps are whole seconds: sentences were spread evenly over each, and one that comes once in "
            "a second is known to half a second (1/sqrt(12) s, 1 s.e.: 0.29 s)."
        )
    else:
        note = (
            f"The log's sentences come in bursts, every {found.lasting_ns / SECOND_NS:.3g} s (median): they were "
            "spread evenly over the time since the burst before, and one that comes once in each is known to a part of "
            f"it (1 s.e.: {found.lasting_ns / SECOND_NS / 12.0**0.5:.2g} s)."
        )
    return LoggerTimes(found.time_ns, (note,), found.share_ns)


def on_utc(stamps: LoggerTimes, full_ns: Nanoseconds, fix: Flag) -> LoggerTimes:
    """Put stamps of a clock that is off on the receiver's UTC.

    How far the stamps of the fixes are ahead of the instants that the fixes give is the clock's error and the time that
    the receiver takes to send them. More than a second, or less than nothing, is the clock; it is followed through
    steps, as where it is set, and drift. A step that the receiver's time makes, while the stamps go on, is the
    receiver's: it stands still, or learns of leap seconds. Stamps that several sentences share show the lead to half of
    their time, and are put right where no part of it will do.

    Parameters
    ----------
    stamps : LoggerTimes
        As they are written, or spread.
    full_ns : ndarray of int64, shape (n,)
        What sentences say of date and time; `NO_TIME` where there is none.
    fix : ndarray of bool, shape (n,)
        Sentences that are believed.
    """
    stamp_ns = stamps.time_utc_ns
    (at,) = np.nonzero(fix & (stamp_ns != NO_TIME) & (full_ns != NO_TIME))
    if at.size == 0:
        return stamps
    own, leapt = _without_leaps(stamp_ns[at], full_ns[at])
    lead = _followed(stamp_ns[at] - own)
    usual = int(np.sort(lead)[lead.size // 2])
    ahead = "ahead of" if usual > 0 else "behind"
    much = f"{abs(usual) / SECOND_NS:.3f} s" if abs(usual) < DAY_NS else f"{abs(usual) / DAY_NS:.2f} days"
    size = f"{much} {ahead} the receiver's UTC (median)"
    notes = [f"The receiver's time leaps or stands still at {leapt} of its fixes: the stamps are kept there."] * (
        leapt > 0
    )
    notes = [*stamps.notes, *notes]
    half = 0 if stamps.share_ns is None else int(np.median(stamps.share_ns[at])) // 2
    earliest, latest = ARRIVES_NS
    doubtful = half > 0 and not (earliest <= lead.min() and lead.max() <= latest)
    earliest, latest = earliest - half, latest + half
    if at.size < _FEWEST:
        few = f"The logger's stamps are {size}, by {at.size} of its fixes: too few to put them right."
        return replace(stamps, notes=(*notes, *(() if earliest <= usual <= _WORTH_NS + half else (few,))))
    if lead.min() >= earliest and lead.max() <= latest:
        late = f"The logger's stamps are {size}: its clock may be off, or the receiver sends so late. They were kept."
        return replace(stamps, notes=(*notes, *([late] if usual > _WORTH_NS + half else [])), doubtful=doubtful)
    (record,) = np.nonzero(stamp_ns != NO_TIME)
    before = np.clip(np.searchsorted(at, record, side="right") - 1, 0, at.size - 1)
    after = np.clip(np.searchsorted(at, record), 0, at.size - 1)
    by_before, by_after = stamp_ns[record] - lead[before], stamp_ns[record] - lead[after]
    off_before, off_after = (
        np.maximum(np.maximum(own[before] - by, by - own[after]), 0) for by in (by_before, by_after)
    )
    gradual = stamp_ns[record] - lead[0] - np.rint(np.interp(record, at, lead - lead[0])).astype(np.int64)
    # where the clock is set between two fixes, a line has the lead of that fix with which it lies between them
    is_set = np.abs(lead[after] - lead[before]) > _WORTH_NS
    result = stamp_ns.copy()
    result[record] = np.where(is_set, np.where(off_before <= off_after, by_before, by_after), gradual)
    moved = int(lead.max() - lead.min())
    between = f", from {lead.min() / SECOND_NS:.3f} to {lead.max() / SECOND_NS:.3f} s" if moved > _WORTH_NS else ""
    right = f"The logger's clock is {size}{between}; its stamps were put right by it ({record.size})."
    return LoggerTimes(result, (*notes, right), stamps.share_ns, doubtful)


def _without_leaps(stamp_ns: Nanoseconds, full_ns: Nanoseconds) -> tuple[Nanoseconds, int]:
    """Return the times of fixes as if the receiver's clock had gone on evenly, and at how many fixes it did not.

    Where stamps and fixes come apart, that clock has leapt whose step is farther from the usual one.
    """
    if full_ns.size < _FEWEST:
        return full_ns, 0
    step, stamped = np.diff(full_ns), np.diff(stamp_ns)
    usual = np.median(step)
    leaps = (np.abs(stamped - step) > _WORTH_NS) & (np.abs(step - usual) > np.abs(stamped - usual))
    if not leaps.any():
        return full_ns, 0
    gone = np.concatenate(([0], np.cumsum(np.where(leaps, step - stamped, 0))))
    # what it said most of the time is right
    return full_ns - gone + np.sort(gone)[gone.size // 2], int(leaps.sum())


def _followed(lead_ns: Nanoseconds) -> Nanoseconds:
    """Return the median of each value and those beside it, reflected at the ends; of few, that of all."""
    if lead_ns.size <= 2 * _BESIDE:
        return np.full(lead_ns.size, np.sort(lead_ns)[lead_ns.size // 2])
    padded = np.concatenate([lead_ns[_BESIDE:0:-1], lead_ns, lead_ns[-2 : -_BESIDE - 2 : -1]])
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * _BESIDE + 1)
    parts = [
        np.partition(windows[first : first + _MANY], _BESIDE, axis=1)[:, _BESIDE]
        for first in range(0, lead_ns.size, _MANY)
    ]
    return np.concatenate(parts)
