"""The time of each sentence of an NMEA log: its own, its stamp's, or that of the fix it came with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.ingest.bursts import are_coarse
from kempf.pipeline.ingest.decoded import CODE, NO_TIME, Flag, Nanoseconds, Reason
from kempf.pipeline.ingest.nmea.fields import Said
from kempf.pipeline.ingest.nmea.frames import Frames
from kempf.pipeline.ingest.nmea.logger_clock import LoggerTimes, on_utc, put_evenly
from kempf.pipeline.ingest.nmea.receiver import fixes_of_one, speaking
from kempf.pipeline.ingest.screen import CLOCK_FIRST_NS
from kempf.pipeline.ingest.shares import shares_of
from kempf.pipeline.ingest.spans import Index
from kempf.pipeline.ingest.text.times import date, time_of_day, year_month_day
from kempf.schemas.nmea import SATELLITES, SENTENCES
from kempf.schemas.units import DAY_NS, SECOND_NS

#: Evidence asked for before untimed sentences are given to the fix that follows them.
_LEAST_AGREEMENTS, _RATIO = 5, 2

#: A date that holds for no longer than this between two others that agree is that of a field updated late, ns.
_BRIEF_NS = 60 * SECOND_NS

#: GPS counts weeks modulo 1024: a receiver that missed the overflow is so many days late (IS-GPS-200, 20.3.3.3.1.1).
ROLLOVER_NS = 1024 * 7 * DAY_NS

#: A plain log that is longer than this is not looked at for late weeks of one of its receivers.
_LONGEST_LOG_NS = 14 * DAY_NS

#: A receiver sends what it measured within half of this time, ns, usually: so much about its instants are those of
#: others that are dated by when it was sent.
_SENDS_NS = SECOND_NS
#: Sentences are spread over so many usual distances of the fixes at most: a longer one is a pause of the log.
_PAUSE = 3


@dataclass(frozen=True, eq=False)
class NmeaClock:
    """Times of the sentences."""

    #: Shape (n,). `NO_TIME` where none can be given.
    time_utc_ns: Nanoseconds
    #: What a person should know of how they were found.
    notes: list[str]
    #: Shape (n,). Within what time about it a sentence was said, ns; 0 where its instant is known.
    share_ns: Nanoseconds


@dataclass(frozen=True, eq=False)
class _LineTimes:
    """What the sentences themselves say of time, line by line; `NO_TIME` where nothing."""

    of_day: Nanoseconds
    full: Nanoseconds  # with the date
    void: Flag  # the receiver says that it has no fix

    @property
    def timed(self) -> Flag:
        """Whether the line gives a time of day."""
        has_time: Flag = self.of_day != NO_TIME
        return has_time

    @property
    def dated(self) -> Flag:
        """Whether the line gives a date too."""
        has_date: Flag = self.full != NO_TIME
        return has_date


def clock_of(frames: Frames, said: dict[str, Said]) -> NmeaClock:
    """Give each sentence its time.

    Parameters
    ----------
    said : dict of str to Said
        What the sentences say, by type.
    """
    times, late = _line_times(frames, said)
    notes = []
    if late:
        notes.append(
            f"{late} dates were 1024 weeks or twice that too early (the overflow of GPS weeks) and were put right."
        )
    n = times.full.size
    # what a receiver without a fix says counts only where no other speaks
    fixed = times.dated & ~times.void
    dated = fixed if fixed.any() else times.dated
    if frames.stamped:
        stamps = LoggerTimes(_set_right(frames.stamp_ns, times, notes))
        # two listeners that write one file make every stamp come twice
        if are_coarse(stamps.time_utc_ns) and are_coarse(stamps.time_utc_ns[~_repeats(frames)]):
            stamps = put_evenly(stamps.time_utc_ns, _sources(frames, said, np.zeros(n, dtype=np.bool_)))
        full = _by_stamps(times, stamps.time_utc_ns)
        dated &= stamps.time_utc_ns != NO_TIME
        believed, differing = fixes_of_one(frames, dated, stamps.time_utc_ns - full)
        right = on_utc(stamps, full, believed)
        notes += [*right.notes, *differing]
        own = _nearest_day(times, right.time_utc_ns, notes)
        share = np.zeros(n, dtype=np.int64) if right.share_ns is None else right.share_ns
        # all stamps are off the receiver's time alike: to the others, its fixes are
        if not right.doubtful:
            share = np.where(own != NO_TIME, np.int64(0), share)
        return NmeaClock(np.where(own != NO_TIME, own, right.time_utc_ns), notes, share)
    speaks, differing = speaking(frames, dated, times.of_day)
    speaks, notes = speaks & times.timed, [*notes, *differing]
    own = _nearest_day(times, _by_counting_days(times, speaks), notes)
    follows = _follows(said)
    if follows:
        notes.append("VTG repeats the fix behind it: sentences without a time are given that of the next fix.")
    fix = (own != NO_TIME) & speaks
    carrier = _next(fix) if follows else _latest(fix)
    carried = np.where((carrier >= 0) & (carrier < n), own[np.clip(carrier, 0, max(n - 1, 0))], NO_TIME)
    delay, share = _delays(frames, said, own, fix, carried, follows, notes)
    return NmeaClock(np.where(own != NO_TIME, own, carried + delay), notes, share)


def _repeats(frames: Frames) -> Flag:
    """Return which lines end as the line before does and are as long: they say the same."""
    buffer, stop = frames.lines.buffer, frames.lines.stop
    # the two digits of the checksum
    tail = buffer[np.maximum(stop - 1, 0)].astype(np.int64) << 8 | buffer[np.maximum(stop - 2, 0)]
    size = frames.body.stop - frames.body.start
    repeats = np.zeros(len(frames.lines), dtype=np.bool_)
    repeats[1:] = (np.diff(frames.address) == 0) & (np.diff(size) == 0) & (np.diff(tail) == 0)
    return repeats


def _by_stamps(times: _LineTimes, stamp_ns: Nanoseconds) -> Nanoseconds:
    """Return the instants that sentences give, dates that are updated late at midnight put right."""
    both = times.dated & (stamp_ns != NO_TIME)
    leads = stamp_ns[both] - times.full[both]
    if leads.size == 0 or np.ptp(leads) < DAY_NS // 2:
        return times.full
    lead = np.sort(leads)[leads.size // 2]
    by_stamps = _nearest_day(times, np.where(stamp_ns != NO_TIME, stamp_ns - lead, NO_TIME), [])
    return np.where(times.dated, by_stamps, NO_TIME)


def _set_right(stamp_ns: Nanoseconds, times: _LineTimes, notes: list[str]) -> Nanoseconds:
    """Return the stamps, those of a clock that was never set put right by the dates of a receiver where there are any.

    Such a clock counts on from the moment at which the logger was switched on; the median of its lag is all it lacks.
    """
    unset = (stamp_ns != NO_TIME) & (stamp_ns < CLOCK_FIRST_NS)
    both = unset & times.dated & (times.full >= CLOCK_FIRST_NS)
    if not both.any():
        return stamp_ns
    lags = np.sort((times.full - stamp_ns)[both])
    lag = lags[lags.size // 2]  # exact: a mean of two would be rounded to a float's nanoseconds
    notes.append(
        f"The logger's clock was not set: {int(unset.sum())} stamps were put right by the receiver's UTC, "
        f"by {lag / SECOND_NS:.3f} s."
    )
    return np.where(unset, stamp_ns + np.where(unset, lag, 0), stamp_ns)


def _delays(
    frames: Frames,
    said: dict[str, Said],
    own: Nanoseconds,
    fix: Flag,
    carried: Nanoseconds,
    follows: bool,
    notes: list[str],
) -> tuple[Nanoseconds, Nanoseconds]:
    """Return what is added to the time of the fix for the sentences that share it with others of their source.

    Beside it, within what time about these instants sentences were said. A velocity that is said with the fix is of it.
    All others count from when it was sent, which to them makes the fix unsure.
    """
    source = _sources(frames, said, (own != NO_TIME) | (carried == NO_TIME))
    record, at = np.flatnonzero(source >= 0), np.flatnonzero(fix)
    spread = _spread(own[at], at, record, source[record], follows=follows)
    delays, shares = np.zeros((2, own.size), dtype=np.int64)
    with_fix = _with_fix(frames)[record]
    delays[record] = np.where(with_fix, 0, spread.delay_ns)
    if not with_fix.all():
        shares[own != NO_TIME] = _SENDS_NS
        shares[record] = np.where(with_fix, _SENDS_NS, spread.share_ns)
    several = np.flatnonzero(np.bincount(frames.address[record[spread.several]]))
    if several.size:
        names = ", ".join(sorted(frames.names[code] for code in several))
        notes.append(f"Sentences that come several times between two fixes were spread evenly over it: {names}.")
    return delays, shares


def _with_fix(frames: Frames) -> Flag:
    """Return which lines are velocities over ground of a receiver that says its fix in RMC."""
    talkers = {name[:2] for name in frames.names if name.endswith("RMC")}
    if talkers & SATELLITES:
        talkers |= SATELLITES
    own = np.array([name[2:] == "VTG" and name[:2] in talkers for name in (*frames.names, "")], dtype=np.bool_)
    return own[frames.address]


def _sources(frames: Frames, said: dict[str, Said], timed: Flag) -> Index:
    """Return for each line which instrument says what it says; -1 for one that is refused or has a time already."""
    source = np.full(timed.size, -1, dtype=np.int64)
    for name, sentences in said.items():
        good = (sentences.reason == 0) & ~timed[sentences.record]
        # an instrument may send roll and pitch in two sentences of one address: these are one measurement
        kinds = (
            [there.astype(np.int64) << k for k, (_, there) in enumerate(sentences.values.values())]
            if name == "XDR"
            else []
        )
        source[sentences.record] = np.where(good, frames.address[sentences.record] * 4 + sum(kinds), -1)
    return source


def _line_times(frames: Frames, said: dict[str, Said]) -> tuple[_LineTimes, int]:
    """Collect what the sentences say of time; also return how many dates were put right."""
    n = len(frames.lines)
    of_day, midnight = np.full(n, NO_TIME, dtype=np.int64), np.full(n, NO_TIME, dtype=np.int64)
    void = np.zeros(n, dtype=np.bool_)
    for name, sentences in said.items():
        sentence, fields = SENTENCES[name], sentences.fields
        if sentence.utc is None:
            continue
        of_day[sentences.record] = time_of_day(fields.at(sentence.utc))
        void[sentences.record] = sentences.reason == CODE[Reason.VOID]
        if sentence.date is not None:
            midnight[sentences.record] = date(fields.at(sentence.date))
        elif name == "ZDA":
            midnight[sentences.record] = year_month_day(fields.at(4), fields.at(3), fields.at(2))
    dated = (of_day != NO_TIME) & (midnight != NO_TIME)
    full = np.where(dated, midnight + of_day, NO_TIME)
    full, late = _correct_rollover(full, dated, frames.stamp_ns)
    return _LineTimes(of_day, full, void), late


def _by_counting_days(times: _LineTimes, speaks: Flag) -> Nanoseconds:
    """Return for each line the latest instant before it - before the first one, the first.

    Times of day are counted on from one sentence to the next, over any number of midnights; a date puts the count
    right. What a receiver without a fix says counts only where no other speaks.
    """
    fixed = speaks & ~times.void
    at = np.flatnonzero(fixed if bool(np.any(fixed & times.dated)) else speaks)
    n = times.of_day.size
    if at.size == 0:
        return np.full(n, NO_TIME)
    half = DAY_NS // 2
    step = (np.diff(times.of_day[at]) + half) % DAY_NS - half
    counted = times.of_day[at[0]] + np.concatenate((np.zeros(1, dtype=np.int64), np.cumsum(step)))
    anchor = np.flatnonzero(times.dated[at])
    offset, _ = _without_brief_dates(times.full[at[anchor]] - counted[anchor], counted[anchor])
    latest = np.searchsorted(anchor, np.arange(at.size), side="right") - 1
    instant = counted + offset[np.maximum(latest, 0)]
    place = np.searchsorted(at, np.arange(n), side="right") - 1
    near: Nanoseconds = instant[np.maximum(place, 0)]
    return near


def _without_brief_dates(offset: Nanoseconds, counted: Nanoseconds) -> tuple[Nanoseconds, int]:
    """Replace the offset of a short run between two runs that agree; return how many were replaced."""
    cuts = np.flatnonzero(np.diff(offset)) + 1
    if cuts.size < 2:
        return offset, 0
    begin, end = cuts[:-1], cuts[1:]
    brief = (offset[begin - 1] == offset[end]) & (counted[end] - counted[begin - 1] <= _BRIEF_NS)
    offset, replaced = offset.copy(), 0
    for first, last in zip(begin[brief], end[brief], strict=True):
        offset[first:last] = offset[last]
        replaced += int(last - first)
    return offset, replaced


def _nearest_day(times: _LineTimes, near: Nanoseconds, notes: list[str]) -> Nanoseconds:
    """Complete the times of day by their own date, else by the day that brings them nearest to other instants."""
    own = times.full.copy()
    known = np.flatnonzero(times.timed & (near != NO_TIME))
    half = DAY_NS // 2
    anchor, full = near[known], times.full[known]
    guess = anchor + (times.of_day[known] - anchor % DAY_NS + half) % DAY_NS - half
    dated = np.flatnonzero(full != NO_TIME)
    offset, brief = _without_brief_dates(full[dated] - guess[dated], guess[dated])
    guess[dated] += offset
    if brief:
        notes.append(f"{brief} dates that disagree with those around them were put right: sent late at midnight.")
    own[known] = guess
    return own


def _latest(mark: Flag) -> Index:
    """Return for each place the latest marked one up to it, -1 before the first."""
    return np.maximum.accumulate(np.where(mark, np.arange(mark.size), -1)) if mark.size else np.empty(0, np.int64)


def _next(mark: Flag) -> Index:
    """Return for each place the next marked one from it on, n behind the last."""
    place = np.where(mark, np.arange(mark.size), mark.size)
    return np.minimum.accumulate(place[::-1])[::-1] if mark.size else np.empty(0, np.int64)


def _follows(said: dict[str, Said]) -> bool:
    """Return whether VTG repeats the speed of the RMC behind it rather than of the one before it."""
    if "RMC" not in said or "VTG" not in said:
        return False
    at, asked = said["RMC"].record, said["VTG"].record
    speed, its = (said[name].values["speed_over_ground"][0] for name in ("RMC", "VTG"))
    behind = np.searchsorted(at, asked)
    between = (behind > 0) & (behind < at.size)
    ahead = np.abs(its - speed[np.clip(behind - 1, 0, at.size - 1)])
    after = np.abs(its - speed[np.clip(behind, 0, at.size - 1)])
    # NaN compares false: what is void does not count
    next_wins, last_wins = int(np.sum(between & (after < ahead))), int(np.sum(between & (ahead < after)))
    return next_wins >= _LEAST_AGREEMENTS and next_wins > _RATIO * last_wins


def _correct_rollover(full: Nanoseconds, dated: Flag, stamp: Nanoseconds) -> tuple[Nanoseconds, int]:
    """Put dates that are 1024 or 2048 weeks late where the log shows it.

    It shows it where the lines bear stamps of another clock, or where another receiver, or the same one at another
    instant, gives a date that is later by just that.

    Parameters
    ----------
    full : ndarray of int64, shape (n,)
        Instants that sentences give with their date.
    dated : ndarray of bool, shape (n,)
        Which sentences do.
    stamp : ndarray of int64, shape (n,)
        Time of arrival, `NO_TIME` where there is none.

    Returns
    -------
    full : ndarray of int64, shape (n,)
    corrected : int
        Number of sentences whose date was put right.
    """
    at = np.flatnonzero(dated)
    if at.size == 0:
        return full, 0
    own = full[at]
    known = stamp[at] != NO_TIME
    latest = own.max()
    reference = np.where(known, stamp[at], latest)
    # the stamps are minutes off at most; another receiver may send its date at the other end of the log
    slack = np.where(known, DAY_NS, _LONGEST_LOG_NS)
    weeks = (reference - own + ROLLOVER_NS // 2) // ROLLOVER_NS
    late = (weeks > 0) & (np.abs(reference - own - weeks * ROLLOVER_NS) <= slack)
    if not late.any():
        return full, 0
    full = full.copy()
    full[at[late]] += weeks[late] * ROLLOVER_NS
    return full, int(np.sum(late))


@dataclass(frozen=True, eq=False)
class _Behind:
    """How far behind their fix sentences were said."""

    #: Shape (n,). To be added to the time of the fix; below zero where this follows them.
    delay_ns: Nanoseconds
    #: Shape (n,). Within what time about that they were said.
    share_ns: Nanoseconds
    #: Shape (n,). Where more than one does.
    several: Flag


def _spread(fix_ns: Nanoseconds, fix: Index, record: Index, source: Index, *, follows: bool) -> _Behind:
    """Return how far behind their fix sentences were said.

    A receiver sends its fix once a second, a compass its heading ten times: the ten would all have the time of the fix.
    Those of one source that come between two fixes are taken for evenly spaced, each in the middle of its share of the
    time. One that comes alone may be of the fix itself, as where a logger asks all instruments in turn, or not.

    Parameters
    ----------
    fix_ns, fix : ndarray of int64, shape (m,)
        Instants of the fixes and their records, ascending; several may have one instant.
    record, source : ndarray of int64, shape (n,)
        Records, ascending, of the sentences that were given the time of a fix, and which source they come from.
    follows : bool
        Whether they were given that of the fix behind them.
    """
    zero = np.zeros(record.size, dtype=np.int64)
    none = _Behind(zero, zero, np.zeros(record.size, dtype=np.bool_))
    if fix.size == 0 or record.size == 0:
        return none
    opens = np.concatenate(([True], fix_ns[1:] != fix_ns[:-1]))
    epoch_of_fix = np.cumsum(opens) - 1
    instant = fix_ns[opens]
    distance = np.diff(instant)
    if not bool(np.any(distance > 0)):
        return none
    usual = int(np.median(distance[distance > 0]))
    # what comes before the first fix or behind the last is taken to be as long as usual
    distance = np.append(usual, distance) if follows else np.append(distance, usual)
    distance = np.clip(distance, 0, _PAUSE * usual)
    at = np.searchsorted(fix, record) if follows else np.searchsorted(fix, record) - 1
    epoch = epoch_of_fix[np.clip(at, 0, fix.size - 1)]
    shares = shares_of(source, epoch)
    shared, place = shares.shared, shares.place
    step = distance[epoch[shares.order]] // shared
    delay, share, several = np.empty_like(record), np.empty_like(record), np.empty(record.size, dtype=np.bool_)
    middle = (2 * (place - shared) + 1 if follows else 2 * place + 1) * step // 2
    delay[shares.order] = np.where(shared > 1, middle, 0)
    share[shares.order], several[shares.order] = np.where(shared > 1, step, 2 * step), shared > 1
    return _Behind(delay, share, several)
