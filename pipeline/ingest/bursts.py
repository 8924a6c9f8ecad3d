"""Stamps that stand for a stretch of time: whole seconds, and those of records that were delivered together in bursts.

What shares a stamp is spread evenly over the time that the stamp stands for. Loggers of NMEA sentences and recorders of
MCAP messages write such stamps alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.ingest.decoded import NO_TIME, Nanoseconds
from kempf.pipeline.ingest.shares import shares_of
from kempf.pipeline.ingest.spans import Index
from kempf.schemas.units import SECOND_NS

#: Stamps of one source, by which it is judged whether several of its records come together.
_LEAST = 20
#: Share of the stamps that are whole seconds where all are meant to be, and of the bursts of a source in which it says
#: several records where that is no accident.
_WHOLE, _SHARED = 0.99, 0.1
#: Records of one burst follow each other within this, ns, and at least this share of all records follow another so.
TOGETHER_NS, _IN_BURSTS = SECOND_NS // 50, 0.5
#: Records by which it is judged whether a log comes in bursts.
_SAMPLE = 20_000
#: A burst brings what came since the one before, if that is no longer ago than so many usual distances.
_USUAL = 1.5


@dataclass(frozen=True, eq=False)
class Spread:
    """Records at times of their own."""

    #: Shape (n,). `NO_TIME` where a record has none.
    time_ns: Nanoseconds
    #: Shape (n,). Within what time about it a record was made, ns; 0 where it was not moved.
    share_ns: Nanoseconds
    #: What a stamp stands for, usually, ns; None where nothing was spread.
    lasting_ns: int | None = None
    #: Whether the stamps were whole seconds, and not those of bursts.
    whole: bool = False


def are_coarse(stamp_ns: Nanoseconds) -> bool:
    """Return whether stamps may be whole seconds, or those of a logger that looks for records now and then.

    Parameters
    ----------
    stamp_ns : ndarray of int64, shape (n,)
        `NO_TIME` where a line has none.
    """
    known = stamp_ns[stamp_ns != NO_TIME]
    if known.size < _LEAST:
        return False
    since = np.diff(known)
    return are_whole(known) or bool(np.mean((since >= 0) & (since < TOGETHER_NS)) >= _IN_BURSTS)


def are_whole(stamp_ns: Nanoseconds) -> bool:
    """Return whether stamps, shape (n,), are whole seconds.

    Parameters
    ----------
    stamp_ns : ndarray of int64, shape (n,)
        All of them known.
    """
    # most logs are answered by their first lines
    few = stamp_ns[:_LEAST]
    return bool(np.mean(few % SECOND_NS == 0) >= 0.5 and np.mean(stamp_ns % SECOND_NS == 0) >= _WHOLE)


def spread(stamp_ns: Nanoseconds, source: Index) -> Spread:
    """Spread the records that share a stamp over the time that it stands for.

    A stamp of whole seconds stands for the second that begins with it. What comes in bursts, as from a serial server or
    a logger that looks once a second, came since the burst before.

    Parameters
    ----------
    stamp_ns : ndarray of int64, shape (n,)
        In the order of the log; `NO_TIME` where a record has none.
    source : ndarray of int64, shape (n,)
        Which instrument a record comes from; -1 where none is read.
    """
    (record,) = np.nonzero((stamp_ns != NO_TIME) & (source >= 0))
    as_they_are = Spread(stamp_ns, np.zeros_like(stamp_ns))
    if record.size == 0:
        return as_they_are
    stamp, own = stamp_ns[record], source[record]
    whole = are_whole(stamp)
    # records that follow each other, and no others: a log may hold one stretch twice
    begins = np.concatenate(([True], np.abs(np.diff(stamp)) >= (1 if whole else TOGETHER_NS)))
    burst, first = np.cumsum(begins), np.flatnonzero(begins)
    begun = stamp[first][burst - 1]
    # most logs have none, which their first records show
    if not whole and _usual(own[:_SAMPLE], burst[:_SAMPLE], begun[:_SAMPLE]) is None:
        return as_they_are
    shares = shares_of(own, burst)
    shared, came = shares.shared, begun[shares.order]
    if whole:
        usual: int | None = SECOND_NS
        lasting, ends = np.full(record.size, SECOND_NS), came + SECOND_NS
    else:
        usual = _usual(own, burst, begun)
        if usual is None:
            return as_they_are
        since = np.concatenate(([usual], np.diff(came[shares.heads])))
        since[(since <= 0) | (since > _USUAL * usual)] = usual  # another source, a pause, one that speaks seldom
        lasting, ends = np.repeat(since, shares.count), came
    result, share = stamp_ns.copy(), np.zeros_like(stamp_ns)
    # each in the middle of its share of the time
    result[record[shares.order]] = ends - (2 * (shared - shares.place) - 1) * lasting // (2 * shared)
    share[record[shares.order]] = lasting // shared
    return Spread(result, share, usual, whole)


def unsure_s(share_ns: Nanoseconds) -> float:
    """Return the standard error of instants that lie anywhere within their shares of the time, s; 0 of none.

    Parameters
    ----------
    share_ns : ndarray of int64, shape (m,)
        Of the records of one source; the median counts.
    """
    return float(np.median(share_ns)) / SECOND_NS / 12.0**0.5 if share_ns.size else 0.0


def _usual(source: Index, burst: Index, came_ns: Nanoseconds) -> int | None:
    """Return the usual distance of bursts, ns; None where no source often has several records in one.

    Parameters
    ----------
    source, burst, came_ns : ndarray of int64, shape (m,)
        Of every record: where it comes from, in which burst, and when that began.
    """
    shares = shares_of(source, burst)
    first, count = shares.order[shares.heads], shares.count
    source, came_ns = source[first], came_ns[first]
    distances = []
    for one in np.unique(source):
        of_it = source == one
        if count[of_it].sum() >= _LEAST and np.mean(count[of_it] >= 2) >= _SHARED:
            distances.append(np.diff(came_ns[of_it]))
    between = np.concatenate(distances) if distances else np.zeros(0, dtype=np.int64)
    between = between[between > 0]
    return int(np.sort(between)[between.size // 2]) if between.size else None
