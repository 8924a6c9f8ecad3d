"""A recorder whose clock is set on the way: all topics go back at one place of the file, or are silent there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.ingest.decoded import NO_TIME, Nanoseconds
from kempf.pipeline.ingest.mcap.times.arrivals import Arrivals
from kempf.schemas.instants import iso_cut
from kempf.schemas.units import SECOND_NS

#: A step of less than this, ns, is that of messages written in another order.
_LEAST_NS = SECOND_NS // 4
#: More steps than this, back or forward, are no clock that is set.
_MOST = 5
#: Share of the messages that are due in the stretch that a clock goes back over, which came before, and after.
_COVERED = 0.6
#: So many have to be due, and this share of those after the step may be those before it once more.
_DUE, _COPIED = 4, 0.5
#: Messages of a topic that have to be there on either side.
_FEWEST = 10
#: All topics are silent if nothing comes for so long, ns, and so many times as long as usual.
_SILENT_NS, _UNUSUAL = SECOND_NS, 8
#: Longer ones are noted as gaps of the log, ns.
_GAP_NS = 10 * SECOND_NS
#: How often topics come that come twice as often as usual, seconds for which they do so at the least, and of a log in
#: which that is looked for.
_TWICE, _LASTING, _OFTEN = (1.5, 2.5), 2, 30
#: The clocks are compared over so long before a step and behind it, ns, and as long as it is itself.
_AROUND_NS = 5 * SECOND_NS
#: Stamps of two topics show the same step within this, ns.
_AGREE_NS = SECOND_NS // 10


@dataclass(frozen=True, eq=False)
class Stepped:
    """Log times with the steps of the recorder's clock taken out."""

    #: By source, shapes (n,).
    log_ns: dict[str, Nanoseconds]
    #: Whether anything was.
    moved: bool
    #: What a person should know.
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _ClockStep:
    """Where the clock may have been set."""

    #: Number of the first message behind it.
    record: int
    #: How far log time goes there, ns; less than nothing where it goes back.
    step_ns: int
    #: before_ns, after_ns: Latest log time before it, and the first behind it.
    before_ns: int
    after_ns: int


def without_steps(topics: list[Arrivals]) -> Stepped:
    """Take out of log time what the recorder's clock was set by, as far as the log shows it.

    A clock was set back where log time goes back over a stretch that the same topics have filled already, in the order
    of the file. Stamps of the messages show a step in either direction. The clock is right behind its last step: what
    came before is moved.

    Parameters
    ----------
    topics : list of Arrivals
    """
    log = {topic.source: topic.log_ns for topic in topics}
    frequent = [topic for topic in topics if topic.record.size >= 2 * _FEWEST]
    places = _places(frequent) if frequent else []
    if not places:
        return Stepped(log, moved=False, notes=_doubled(frequent))
    notes, moved = [], False
    for place in places:
        by_stamps = _shown_by_stamps(frequent, place)
        size = by_stamps
        if size is None and place.step_ns < 0 and _gone_over_twice(frequent, place):
            size = _continued(frequent, place)
        at = iso_cut(place.before_ns)
        if size is not None and abs(size) >= _LEAST_NS:
            moved = True
            for topic in topics:
                before = topic.record < place.record
                log[topic.source] = np.where(before, log[topic.source] + size, log[topic.source])
            how = "back" if size < 0 else "forward"
            notes.append(
                f"The recorder's clock was set {how} by {abs(size) / SECOND_NS:.2f} s at {at}, on all topics: what "
                "came before was put right by it."
            )
        elif by_stamps is None and _SILENT_NS <= place.step_ns < _GAP_NS:
            notes.append(
                f"All topics are silent for {place.step_ns / SECOND_NS:.1f} s at {at}: nothing was recorded, or the "
                "recorder's clock was set forward there, which the log cannot show. If it was, give what comes before "
                "and what comes behind as two logs."
            )
    return Stepped(log, moved, tuple(notes))


def _doubled(topics: list[Arrivals]) -> tuple[str, ...]:
    """Name a stretch in which every topic comes twice as often: a clock was set back, and the file sorted by it."""
    if not topics or any(np.any(np.diff(topic.log_ns) < 0) for topic in topics):
        return ()
    start = min(int(topic.log_ns.min()) for topic in topics)
    seconds = (max(int(topic.log_ns.max()) for topic in topics) - start) // SECOND_NS + 1
    # topics of one in some seconds say little of a second
    many = [topic for topic in topics if topic.record.size >= seconds]
    if not many or not _OFTEN <= seconds <= sum(topic.record.size for topic in many):
        return ()
    counts = np.stack([np.bincount((topic.log_ns - start) // SECOND_NS, minlength=seconds) for topic in many])
    ratio = counts / np.maximum(np.median(counts, axis=1, keepdims=True), 1)
    twice = (ratio.min(axis=0) >= _TWICE[0]) & (ratio.mean(axis=0) <= _TWICE[1])
    edges = np.flatnonzero(np.diff(np.concatenate(([False], twice, [False]))))
    if edges.size != 2 or edges[1] - edges[0] < _LASTING:
        return ()
    first, behind = edges.tolist()
    around = ratio[:, [max(first - 2, 0), min(behind + 1, seconds - 1)]].mean(axis=0)
    # after a silence they are those that waited
    if np.any(around < _COVERED) or np.any(around > _TWICE[0]):
        return ()
    at = iso_cut(start + first * SECOND_NS, "s")
    return (
        f"For {behind - first} s from {at} on every topic comes twice as often: the recorder's clock was set back "
        "there and the file sorted by its times since, so that what was measured before and behind is mixed. Give the "
        "file as it was recorded, or what comes before and what comes behind as two logs.",
    )


def _places(topics: list[Arrivals]) -> list[_ClockStep]:
    """Return where log time of all topics together goes back, or leaps."""
    record = np.concatenate([topic.record for topic in topics])
    order = np.argsort(record, kind="stable")
    record, log = record[order], np.concatenate([topic.log_ns for topic in topics])[order]
    step = np.diff(log)
    latest = np.maximum.accumulate(log)
    usual = float(np.quantile(step, 0.99))
    back = step < -_LEAST_NS
    leaps = (step >= max(_SILENT_NS // 2, _UNUSUAL * usual)) & (log[1:] > latest[:-1])
    few = [np.flatnonzero(kind) for kind in (back, leaps) if np.count_nonzero(kind) <= _MOST]
    places = np.sort(np.concatenate([np.zeros(0, dtype=np.int64), *few]))
    return [
        _ClockStep(int(record[i + 1]), int(step[i]), int(latest[i] if back[i] else log[i]), int(log[i + 1]))
        for i in places.tolist()
    ]


def _shown_by_stamps(topics: list[Arrivals], place: _ClockStep) -> int | None:
    """Return by how much log time steps against the stamps, ns, zero for not at all; None where no stamps show it."""
    steps = []
    for topic in topics:
        known = topic.stamp_ns != NO_TIME
        log, behind = topic.log_ns[known], topic.record[known] >= place.record
        lead = log - topic.stamp_ns[known]
        # as long as the queue of a stall needs, and more
        around = abs(place.step_ns) + _AROUND_NS
        before, after = (
            lead[~behind & (log >= place.before_ns - around)],
            lead[behind & (log <= place.after_ns + around)],
        )
        if min(before.size, after.size) >= _FEWEST:
            # the least of each: messages wait, and none comes early
            steps.append(int(after.min() - before.min()))
    if not steps or max(steps) - min(steps) > _AGREE_NS:
        return None
    return int(np.sort(steps)[len(steps) // 2])


def _gone_over_twice(topics: list[Arrivals], place: _ClockStep) -> bool:
    """Return whether the stretch that log time goes back over is filled before the step and, with others, after it."""
    due = before = after = copied = 0.0
    for topic in topics:
        behind = topic.record >= place.record
        within = (topic.log_ns >= place.after_ns) & (topic.log_ns <= place.before_ns)
        due += (place.before_ns - place.after_ns) / max(_period(topic), 1)
        before, after = before + np.sum(within & ~behind), after + np.sum(within & behind)
        # the same messages once more are a copy, such as that of a chunk or of a second recorder
        (first, once), (second, again) = (
            (topic.log_ns[own], topic.value[own]) for own in (within & ~behind, within & behind)
        )
        if first.size:
            # a second recorder has the same message some milliseconds later
            at = np.clip(np.searchsorted(first, second - _period(topic) // 2), 0, first.size - 1)
            copied += np.sum(once[at] == again)
    return due >= _DUE and min(before, after) >= _COVERED * due and copied < _COPIED * after


def _continued(topics: list[Arrivals], place: _ClockStep) -> int | None:
    """Return the step with which the topics go on as they came, ns; the even and frequent ones count most."""
    sizes, weights = [], []
    for topic in topics:
        behind = topic.record >= place.record
        before, after = topic.log_ns[~behind], topic.log_ns[behind]
        if before.size and after.size:
            period = _period(topic)
            scatter = float(np.median(np.abs(np.diff(topic.log_ns) - period)))
            sizes.append(float(after[0] - before[-1] - period))
            weights.append(1.0 / (scatter + 0.01 * period + 1.0) ** 2)
    return round(float(np.average(sizes, weights=weights))) if sizes else None


def _period(topic: Arrivals) -> int:
    step = np.diff(topic.log_ns)
    return int(np.sort(step)[step.size // 2])
