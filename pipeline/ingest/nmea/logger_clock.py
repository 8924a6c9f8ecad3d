"""Stamps that a logger put in front of sentences: spread where they are coarse, put right where its clock is off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.ingest.decoded import NO_TIME, Flag, Nanoseconds
from kempf.pipeline.ingest.spans import Index
from kempf.pipeline.ingest.text.times import DAY_NS, SECOND_NS

#: Stamps of one source, by which it is judged whether several of its sentences share one.
_LEAST = 20
#: Share of the stamps that are whole seconds where all are meant to be, and of those that several sentences of a
#: source share where it is no accident.
_WHOLE, _SHARED = 0.99, 0.1
#: Share of the lines that have the stamp of the line before where they come in bursts; several instruments may speak
#: in one millisecond.
_BESIDE_EACH_OTHER = 0.5
#: A stamp waits for so many usual distances of the stamps at most: a longer one is a pause of the log.
_PAUSE = 3
#: Receivers send a fix up to a second after its instant, and never before; what rounding leaves before it, ns.
_LATEST_NS, _EARLIEST_NS = SECOND_NS, -SECOND_NS // 10
#: A receiver that sends so late, or a clock that is so far off, is worth a note, ns.
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


def are_coarse(stamp_ns: Nanoseconds) -> bool:
    """Return whether stamps may be whole seconds or shared by lines that did not come at one instant.

    Parameters
    ----------
    stamp_ns : ndarray of int64, shape (n,)
        `NO_TIME` where a line has none.
    """
    known = stamp_ns[stamp_ns != NO_TIME]
    if known.size < _LEAST:
        return False
    return bool(np.mean(known[1:] == known[:-1]) >= _BESIDE_EACH_OTHER) or _whole(known)


def _whole(stamp_ns: Nanoseconds) -> bool:
    # most logs are answered by their first lines
    few = stamp_ns[:_LEAST]
    return bool(np.mean(few % SECOND_NS == 0) >= 0.5 and np.mean(stamp_ns % SECOND_NS == 0) >= _WHOLE)


def spread(stamp_ns: Nanoseconds, source: Index) -> LoggerTimes:
    """Spread the sentences that share a stamp over the time that it stands for.

    A stamp of whole seconds stands for the second that begins with it. One that several sentences of an instrument
    share, as behind a serial server or a logger that looks once a second, stands for the time since the one before.

    Parameters
    ----------
    stamp_ns : ndarray of int64, shape (n,)
        `NO_TIME` where a line has none.
    source : ndarray of int64, shape (n,)
        Which instrument a line comes from; -1 where none is read.
    """
    (record,) = np.nonzero((stamp_ns != NO_TIME) & (source >= 0))
    if record.size == 0:
        return LoggerTimes(stamp_ns)
    stamp, own = stamp_ns[record], source[record]
    whole = _whole(stamp)
    order = np.lexsort((record, stamp, own))
    opens = np.concatenate(([True], (np.diff(own[order]) != 0) | (np.diff(stamp[order]) != 0)))
    heads = np.flatnonzero(opens)
    count = np.diff(heads, append=record.size)
    if not whole and not _in_bursts(own[order][heads], count):
        return LoggerTimes(stamp_ns)
    shared, place = np.repeat(count, count), np.arange(record.size) - np.repeat(heads, count)
    instants = np.unique(stamp)
    if whole:
        begins, lasting = stamp[order], np.full(record.size, SECOND_NS)
        note = "The logger's stamps are whole seconds: sentences were spread evenly over each, and one that comes once"
        note += " in a second is known to half a second (1/sqrt(12) s, 1 s.e.: 0.29 s)."
    else:
        distance = np.diff(instants)
        usual = int(np.median(distance)) if distance.size else 0
        since = np.minimum(np.concatenate(([usual], distance)), _PAUSE * usual)
        lasting = since[np.searchsorted(instants, stamp[order])]
        begins = stamp[order] - lasting
        note = (
            f"Sentences of one instrument share stamps, which come every {usual / SECOND_NS:.3g} s (median): they were"
        )
        note += " spread evenly over the time since the stamp before."
    result = stamp_ns.copy()
    # the middle of its share of the time: half a step later than it may have come, and half a step earlier
    result[record[order]] = begins + (2 * place + 1) * lasting // (2 * shared)
    return LoggerTimes(result, (note,))


def _in_bursts(source: Index, count: Index) -> bool:
    """Whether sentences of some source often share their stamp with others of it."""
    for one in np.unique(source):
        of_it = count[source == one]
        if of_it.sum() >= _LEAST and np.mean(of_it >= 2) >= _SHARED:
            return True
    return False


def on_utc(stamp_ns: Nanoseconds, full_ns: Nanoseconds, fix: Flag) -> LoggerTimes:
    """Put stamps of a clock that is off on the receiver's UTC.

    How far the stamps of the fixes are ahead of the instants that the fixes give is the clock's error and the time that
    the receiver takes to send them. More than a second, or less than nothing, is the clock; it is followed through
    steps, as where it is set, and drift.

    Parameters
    ----------
    stamp_ns, full_ns : ndarray of int64, shape (n,)
        Stamps, and what sentences say of date and time; `NO_TIME` where there is none.
    fix : ndarray of bool, shape (n,)
        Sentences that are believed.
    """
    (at,) = np.nonzero(fix & (stamp_ns != NO_TIME) & (full_ns != NO_TIME))
    if at.size == 0:
        return LoggerTimes(stamp_ns)
    own = full_ns[at]
    lead = _running_median(stamp_ns[at] - own)
    usual = int(np.sort(lead)[lead.size // 2])
    ahead = "ahead of" if usual > 0 else "behind"
    much = f"{abs(usual) / SECOND_NS:.3f} s" if abs(usual) < DAY_NS else f"{abs(usual) / DAY_NS:.2f} days"
    size = f"{much} {ahead} the receiver's UTC (median)"
    if at.size < _FEWEST:
        few = f"The logger's stamps are {size}, by {at.size} of its fixes: too few to put them right."
        return LoggerTimes(stamp_ns, () if _EARLIEST_NS <= usual <= _WORTH_NS else (few,))
    if lead.min() >= _EARLIEST_NS and lead.max() <= _LATEST_NS:
        late = f"The logger's stamps are {size}: its clock may be off, or the receiver sends so late. They were kept."
        return LoggerTimes(stamp_ns, (late,) if usual > _WORTH_NS else ())
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
    return LoggerTimes(result, (f"The logger's clock is {size}{between}: {record.size} stamps were put right by it.",))


def _running_median(value: Nanoseconds) -> Nanoseconds:
    """Return the median of each value and those beside it, reflected at the ends; of few, that of all."""
    if value.size <= 2 * _BESIDE:
        return np.full(value.size, np.sort(value)[value.size // 2])
    padded = np.concatenate([value[_BESIDE:0:-1], value, value[-2 : -_BESIDE - 2 : -1]])
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * _BESIDE + 1)
    parts = [
        np.partition(windows[first : first + _MANY], _BESIDE, axis=1)[:, _BESIDE]
        for first in range(0, value.size, _MANY)
    ]
    return np.concatenate(parts)
