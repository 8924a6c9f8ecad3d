"""The clocks behind the stamps of messages, compared by way of the recorder's, which saw all of them arrive.

A message is never recorded before it is made. Stamps that are ahead of log time, or a second and more behind it, come
from another clock than the recorder's; within that second nothing tells a clock from the way that messages take.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.ingest.decoded import NO_TIME, Nanoseconds
from kempf.pipeline.ingest.mcap.times.arrivals import Arrivals
from kempf.pipeline.ingest.mcap.times.corrected import Corrected
from kempf.pipeline.ingest.mcap.times.transit import EARLY_NS, least_transit
from kempf.pipeline.ingest.screen import CLOCK_FIRST_NS
from kempf.schemas.units import DAY_NS, SECOND_NS

#: Messages of a topic by which its clock is judged.
_LEAST = 20
#: The longest way to the recorder, ns, and that of messages whose clock agrees with the recorder's for certain.
_LATEST_NS, _AGREES_NS = SECOND_NS, SECOND_NS // 20
#: A way that takes longer than this, ns, is worth a note where other topics have log time; that of a topic whose clock
#: sends others faster if it is longer than the second. It has to be an even one: what waits is late for another reason.
_WORTH_NS, _WORTH_ALONE_NS, _EVEN_NS = SECOND_NS // 5, SECOND_NS // 2, SECOND_NS // 10


@dataclass(frozen=True, eq=False)
class _Stamped:
    """Messages of one topic that have stamps."""

    topic: Arrivals
    #: log_ns, stamp_ns, transit_ns: Shape (k,).
    log_ns: Nanoseconds
    stamp_ns: Nanoseconds
    transit_ns: Nanoseconds

    @property
    def comes_evenly(self) -> bool:
        """Whether the messages take about as long one as the other."""
        low, high = np.quantile(self.log_ns - self.stamp_ns - self.transit_ns, (0.025, 0.975))
        return bool(high - low <= _EVEN_NS)

    @property
    def usual_ns(self) -> int:
        """By how much log time is ahead, ns."""
        return int(np.sort(self.transit_ns)[self.transit_ns.size // 2])


def one_clock(topics: list[Arrivals], log_ns: dict[str, Nanoseconds]) -> Corrected:
    """Bring topics that have the time of their stamps, and those that have log time, onto one clock.

    That clock is the one by which most topics stamp, or the recorder's, if it agrees with any of them or they were
    never set.

    Parameters
    ----------
    topics : list of Arrivals
        All of a log whose profile takes its time from the stamps.
    log_ns : dict of str to ndarray of int64, shape (n,)
        By source, log time.
    """
    stamped, useless = _stamped(topics, log_ns)
    notes, times = [], dict[str, Nanoseconds]()
    for topic in useless:
        times[topic.source] = log_ns[topic.source].copy()
    if useless:
        notes.append(
            f"The stamps of {', '.join(topic.source for topic in useless)} stand still: these messages have log time."
        )
    clocks = _clocks([one for one in stamped if one.log_ns.size >= _LEAST])
    for one in stamped:
        if clocks and one.log_ns.size < _LEAST:
            # too few to show a clock of their own
            min(clocks, key=lambda clock: abs(clock[0].usual_ns - one.usual_ns)).append(one)
    names = {one.topic.source for one in stamped}
    by_log = [topic for topic in topics if topic.source not in names and topic.record.size >= _LEAST]
    of_recorder = [clock for clock in clocks if EARLY_NS <= clock[0].usual_ns <= _LATEST_NS]
    if not clocks or (len(clocks) == 1 and not by_log):
        return Corrected(times, tuple(notes))
    reference = None if of_recorder else _most(clocks, log_ns)
    for clock in clocks:
        if clock is reference:
            times |= _log_time_on(clock, topics, names, log_ns | times)
        elif clock not in of_recorder:
            times |= {one.topic.source: _moved(one, clock[0], log_ns[one.topic.source], reference) for one in clock}
        if clock not in of_recorder:
            notes.append(_moved_words(clock, reference, by_log))
    return Corrected(times, (*notes, *(_doubts(of_recorder, by_log) if by_log else ())))


def _stamped(topics: list[Arrivals], log_ns: Mapping[str, Nanoseconds]) -> tuple[list[_Stamped], list[Arrivals]]:
    """Return the topics whose stamps run, and those whose stamps stand still."""
    stamped, useless = [], []
    for topic in topics:
        known = topic.stamp_ns != NO_TIME
        if not known.any():
            continue
        log, stamp = log_ns[topic.source][known], topic.stamp_ns[known]
        if log.size >= _LEAST and np.ptp(stamp) == 0 and np.ptp(log) > 0:
            useless.append(topic)
        else:
            stamped.append(_Stamped(topic, log, stamp, least_transit(log, stamp)))
    return stamped, useless


def _clocks(stamped: list[_Stamped]) -> list[list[_Stamped]]:
    """Part topics by their clocks; the first of each takes the shortest way to the recorder."""
    clocks: list[list[_Stamped]] = []
    for one in sorted(stamped, key=lambda one: one.usual_ns):
        first = clocks[-1][0].usual_ns if clocks else 0
        # one that is ahead of the recorder's is none that agrees with it
        another = first < EARLY_NS <= one.usual_ns <= _AGREES_NS
        if clocks and one.usual_ns - first <= _LATEST_NS and not another:
            clocks[-1].append(one)
        else:
            clocks.append([one])
    return clocks


def _most(clocks: list[list[_Stamped]], log_ns: Mapping[str, Nanoseconds]) -> list[_Stamped] | None:
    """Return the clock by which most topics stamp, None for the recorder's where it is set and that one is not."""
    clock = max(clocks, key=len)
    recorder = max(int(log.max()) for log in log_ns.values())
    return None if int(clock[0].stamp_ns.max()) < CLOCK_FIRST_NS <= recorder else clock


def _at(one: _Stamped, log_ns: Nanoseconds) -> Nanoseconds:
    """Return by how much log time is ahead of a clock, at some log times."""
    first = int(one.transit_ns[0])
    order = np.argsort(one.log_ns, kind="stable")
    moved = np.interp(log_ns - one.log_ns[0], (one.log_ns - one.log_ns[0])[order], (one.transit_ns - first)[order])
    ahead: Nanoseconds = first + np.rint(moved).astype(np.int64)
    return ahead


def _moved(one: _Stamped, fastest: _Stamped, log_ns: Nanoseconds, reference: list[_Stamped] | None) -> Nanoseconds:
    """Return the stamps of a topic on the clock of reference; messages without one have log time there."""
    known = one.topic.stamp_ns != NO_TIME
    time = log_ns.copy()
    time[known] = one.stamp_ns + _at(fastest, one.log_ns)
    return time - _at(reference[0], log_ns) if reference is not None else time


def _log_time_on(
    clock: list[_Stamped], topics: list[Arrivals], names: set[str], log_ns: Mapping[str, Nanoseconds]
) -> dict[str, Nanoseconds]:
    """Return the times of messages without a stamp on a clock."""
    own = {one.topic.source for one in clock}
    times = {}
    for topic in topics:
        without = topic.stamp_ns == NO_TIME
        log = log_ns[topic.source]
        if topic.source not in names:
            times[topic.source] = log - _at(clock[0], log)
        elif topic.source in own and without.any():
            times[topic.source] = np.where(without, log - _at(clock[0], log), topic.stamp_ns)
    return times


def _moved_words(clock: list[_Stamped], reference: list[_Stamped] | None, by_log: list[Arrivals]) -> str:
    onto = "the recorder's clock" if reference is None else f"the clock of {reference[0].topic.source}"
    others = ", ".join(topic.source for topic in by_log) or "no topic"
    moved = (
        f"log time, which {others} has, was put right by it" if clock is reference else f"they were moved onto {onto}"
    )
    return f"The stamps of {_named(clock)} are {_words(-clock[0].usual_ns)} log time: {moved}."


def _doubts(of_recorder: list[list[_Stamped]], by_log: list[Arrivals]) -> list[str]:
    """Say of stamps that are so much behind log time that a clock may be off what to write if it is."""
    late = [
        one
        for clock in of_recorder
        for one in clock
        if one.usual_ns > (_WORTH_NS if clock[0].usual_ns > _WORTH_NS else _WORTH_ALONE_NS) and one.comes_evenly
    ]
    if not late:
        return []
    others = ", ".join(topic.source for topic in by_log)
    return [
        f"The stamps of {_named(late)} are {_words(-late[0].usual_ns)} log time, which {others} has: their clock may "
        "be off, or they take so long to the recorder. If it is the clock, write "
        f"`delay_s: {late[0].usual_ns / SECOND_NS:.3f}` at the channels of {others}."
    ]


def _named(stamped: list[_Stamped]) -> str:
    return ", ".join(one.topic.source for one in stamped)


def _words(ahead_ns: int) -> str:
    much = f"{abs(ahead_ns) / SECOND_NS:.3f} s" if abs(ahead_ns) < DAY_NS else f"{abs(ahead_ns) / DAY_NS:.2f} days"
    return f"{much} {'ahead of' if ahead_ns > 0 else 'behind'}"
