"""Messages that reach the recorder unevenly: in bursts, or after waiting in a queue.

Where they carry stamps that run evenly, these say when they were made; a burst of messages without is spread.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kempf.pipeline.ingest.bursts import TOGETHER_NS, are_whole, spread, unsure_s
from kempf.pipeline.ingest.decoded import NO_TIME, Flag, Float, Nanoseconds
from kempf.pipeline.ingest.mcap.times.arrivals import Arrivals
from kempf.pipeline.ingest.mcap.times.corrected import Corrected
from kempf.pipeline.ingest.mcap.times.transit import EARLY_NS, least_transit
from kempf.pipeline.ingest.spans import Index
from kempf.schemas.units import SECOND_NS

#: Messages of a topic by which it is judged, and share of them that have to carry a stamp.
_LEAST, _STAMPED = 20, 0.99
#: Messages that wait longer than this, ns, are late for the fit of a hull; so are bursts that are as far apart.
_WORTH_NS = SECOND_NS // 10
#: Steps of the stamps are even if they vary by less than this share of their median, or of what those of log time do.
_EVEN = 0.25
#: Clocks of two computers part by less than this share of the time, and what waits changes by less than this, ns.
_RATE, _PARTED_NS = 1e-3, SECOND_NS // 5
#: Share of the messages that follow another at once, where they come in bursts.
_CLOSE = 0.3
#: A burst lasts less than this share of the time since the one before.
_BRIEF = 0.1
#: Messages of a burst come within this of each other, ns, and bursts as regularly as by this share of their distance.
_AT_ONCE_NS, _REGULAR = SECOND_NS // 200, 0.5
#: Two readings of one burst repeat each other, or come from two devices, where so much more of them are equal than of
#: those in two bursts, where they differ by less than this share of what those in two bursts do, or where they step
#: back so often.
_REPEATS, _NEAR, _ALTERNATES = 0.3, 0.5, -0.6
#: Share of the messages of a topic that come with the bursts of others where it comes by the same way, and share of the
#: time that these bursts take at most.
_WITH, _OF_TIME = 0.9, 0.3


def by_stamps(topics: list[Arrivals]) -> Corrected:
    """Put messages that waited at the instants of their stamps, on the recorder's clock.

    Parameters
    ----------
    topics : list of Arrivals

    Returns
    -------
    Corrected
        Sources whose stamps run evenly while log time does not.
    """
    times: dict[str, Nanoseconds] = {}
    late: list[str] = []
    for topic in topics:
        known = topic.stamp_ns != NO_TIME
        if topic.record.size < _LEAST or known.mean() < _STAMPED:
            continue
        log, stamp = topic.log_ns[known], topic.stamp_ns[known]
        if not _runs_evenly(stamp, log) or not _at_one_rate(stamp, log):
            continue
        transit = least_transit(log, stamp)
        waited = log - stamp - transit
        low, high = np.quantile(waited, (0.025, 0.975))
        if high - low <= _WORTH_NS:
            continue
        # within one step of the stamps, a message that waits is likelier than a clock that is off
        agree = EARLY_NS <= np.median(transit) <= np.median(np.diff(np.sort(stamp)))
        times[topic.source] = topic.log_ns.copy()
        times[topic.source][known] = stamp if agree else stamp + transit
        late.append(f"{topic.source} (up to {high / SECOND_NS:.2g} s)")
    if not late:
        return Corrected({})
    return Corrected(
        times,
        (
            f"Messages waited unevenly before they were recorded, while the stamps in them run evenly: "
            f"{', '.join(late)}. They were read at the instants of their stamps.",
        ),
    )


def _runs_evenly(stamp_ns: Nanoseconds, log_ns: Nanoseconds) -> bool:
    """Return whether stamps are finer and more even than log time, whatever the order in which messages came."""
    if are_whole(stamp_ns):
        return False
    step, came = np.diff(np.sort(stamp_ns)), np.diff(np.sort(log_ns))
    if np.mean(step > 0) < _STAMPED:
        return False
    (low, middle, high), (first, last) = np.quantile(step, (0.1, 0.5, 0.9)), np.quantile(came, (0.1, 0.9))
    return bool(high - low <= _EVEN * max(middle, last - first))


def _at_one_rate(stamp_ns: Nanoseconds, log_ns: Nanoseconds) -> bool:
    """Return whether stamps and log time pass alike: else a stamp is of a simulation, or a number of another unit."""
    third = max(log_ns.size // 3, 1)
    lead = log_ns - stamp_ns
    apart = abs(float(np.median(lead[-third:]) - np.median(lead[:third])))
    return apart <= _RATE * float(np.ptp(log_ns)) + _PARTED_NS


def bursts(topics: list[Arrivals], log_ns: Mapping[str, Nanoseconds]) -> Corrected:
    """Spread messages that were recorded in bursts, or at whole seconds, over the time for which they stand.

    Parameters
    ----------
    topics : list of Arrivals
        Those that have log time.
    log_ns : mapping of str to ndarray of int64, shape (n,)
        By source, log time.
    """
    topics = [topic for topic in topics if topic.record.size >= _LEAST]
    whole = all(are_whole(log_ns[topic.source]) for topic in topics) and any(
        _several_a_second(log_ns[topic.source], topic.value) for topic in topics
    )
    found = topics if whole else _delivered_together(topics, log_ns)
    if not found:
        return Corrected({})
    record = np.concatenate([topic.record for topic in found])
    source = np.repeat(np.arange(len(found)), [topic.record.size for topic in found])
    order = np.argsort(record, kind="stable")
    came = np.concatenate([log_ns[topic.source] for topic in found])[order]
    result = spread(came, source[order])
    if result.lasting_ns is None:
        return Corrected({})
    time = np.empty_like(came)
    time[order] = result.time_ns
    cuts = np.cumsum([topic.record.size for topic in found])[:-1]
    times = {topic.source: own for topic, own in zip(found, np.split(time, cuts), strict=True)}
    share = np.empty_like(came)
    share[order] = result.share_ns
    shares = np.split(share, cuts)
    std_s = {topic.source: unsure_s(own) for topic, own in zip(found, shares, strict=True)}
    named = ", ".join(f"{name} ({own_s:.2g} s)" for name, own_s in std_s.items())
    how = "whole seconds" if result.whole else f"those of bursts, every {result.lasting_ns / SECOND_NS:.3g} s (median)"
    since = "each second" if result.whole else "the time since the burst before"
    return Corrected(
        times,
        (
            f"The log times are {how}: messages were spread evenly over {since}, and when each was made is known to a "
            f"part of it (1 s.e.): {named}. Where the log has finer times, such as the `publish_time` or a field of "
            "the messages, name them as the column of `time`.",
        ),
        std_s,
    )


def _several_a_second(log_ns: Nanoseconds, value: Float) -> bool:
    """Return whether whole seconds are coarser than what comes: a topic of one a second may be meant so."""
    same = np.diff(log_ns) == 0
    enough = same.mean() >= _CLOSE and np.count_nonzero(~same) >= _LEAST // 4
    return bool(enough) and not _at_one_instant(value, same)


def _delivered_together(topics: list[Arrivals], log_ns: Mapping[str, Nanoseconds]) -> list[Arrivals]:
    """Return the topics that come in bursts, and those that come with these by the same way."""
    by_themselves = [topic for topic in topics if _in_bursts(log_ns[topic.source], topic.value)]
    names = {topic.source for topic in by_themselves}
    for topic in topics:
        if topic.source not in names and any(
            _comes_with(log_ns[topic.source], log_ns[other.source]) for other in by_themselves
        ):
            names.add(topic.source)
    return [topic for topic in topics if topic.source in names]


def _ends(log_ns: Nanoseconds) -> tuple[Index, Index]:
    """Return the first and the last message of every burst."""
    first = np.flatnonzero(np.concatenate(([True], ~_close(log_ns))))
    return first, np.append(first[1:], log_ns.size) - 1


def _close(log_ns: Nanoseconds) -> Flag:
    since = np.diff(log_ns)
    return (since >= 0) & (since < TOGETHER_NS)


def _in_bursts(log_ns: Nanoseconds, value: Float) -> bool:
    """Return whether messages come in bursts, of which each brings what was made since the one before."""
    close = _close(log_ns)
    if close.mean() < _CLOSE:
        return False
    first, last = _ends(log_ns)
    if first.size < _LEAST // 2:
        return False
    low, between, high = np.quantile(np.diff(log_ns[first]), (0.1, 0.5, 0.9))
    lasting = np.median(log_ns[last] - log_ns[first])
    # a topic that speaks when something moves has bursts too, but neither at once nor by a clock
    at_once = np.median(np.diff(log_ns)[close]) <= _AT_ONCE_NS
    if between < _WORTH_NS or lasting > _BRIEF * between or high - low > _REGULAR * between or not at_once:
        return False
    return not _at_one_instant(value, close)


def _at_one_instant(value: Float, close: Flag) -> bool:
    """Return whether readings that come together repeat each other, or are those of two devices.

    Parameters
    ----------
    value : ndarray, shape (n,)
    close : ndarray of bool, shape (n - 1,)
        Which follow the one before at once.
    """
    step = np.diff(value)
    here, there = step[close & np.isfinite(step)], step[~close & np.isfinite(step)]
    if there.size == 0 or not here.any():
        return True
    if np.mean(here == 0.0) > np.mean(there == 0.0) + _REPEATS:
        return True
    if np.mean(np.abs(here)) < _NEAR * np.mean(np.abs(there)):
        return True
    turn = (np.sign(step[:-1]) * np.sign(step[1:]))[close[:-1] != close[1:]]
    turn = turn[np.isfinite(turn) & (turn != 0.0)]
    return turn.size >= _LEAST and bool(turn.mean() < _ALTERNATES)


def _comes_with(log_ns: Nanoseconds, other_ns: Nanoseconds) -> bool:
    """Return whether messages come with the bursts of another topic."""
    first, last = _ends(other_ns)
    begin, end = other_ns[first] - TOGETHER_NS, other_ns[last] + TOGETHER_NS
    if np.sum(end - begin) > _OF_TIME * np.ptp(other_ns):
        return False
    at = np.clip(np.searchsorted(begin, log_ns, side="right") - 1, 0, begin.size - 1)
    return bool(np.mean((log_ns >= begin[at]) & (log_ns <= end[at])) >= _WITH)
