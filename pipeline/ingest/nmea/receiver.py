"""The one receiver of an NMEA log by whose clock its sentences are dated: two clocks would pull them to and fro."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from kempf.pipeline.ingest.decoded import NO_TIME, Flag, Nanoseconds
from kempf.pipeline.ingest.nmea.frames import Frames
from kempf.pipeline.ingest.spans import Index
from kempf.schemas.nmea import SATELLITES
from kempf.schemas.units import DAY_NS, SECOND_NS

#: A receiver is silent where its sentences are farther apart than so many of their usual distances, in lines.
_SILENT = 3
#: A clock that differs by more than this from the one that counts is another one, ns.
_DIFFERS_NS = SECOND_NS // 2
#: How long after its instant a fix arrives by a clock that is set, ns: up to a second, and never before it but for what
#: rounding leaves.
ARRIVES_NS = (-SECOND_NS // 10, SECOND_NS)
#: The sentence that brings position, velocity, time and date together.
_FIX = "RMC"


def speaking(frames: Frames, dated: Flag, of_day_ns: Nanoseconds) -> tuple[Flag, list[str]]:
    """Return which sentences may give their time to those without one, shape (n,), and notes on other clocks.

    Those of the receiver that gives most dates, RMC before ZDA; of another one whose clock agrees only while it is
    silent. A display that repeats a receiver's position without the date repeats it late: it gives its own sentences
    their time, but carries none to others.

    Parameters
    ----------
    dated : ndarray of bool, shape (n,)
        Sentences with a date that counts.
    of_day_ns : ndarray of int64, shape (n,)
        Time of day that a sentence gives, `NO_TIME` where it gives none.
    """
    often = _frequent(frames, dated)
    if not often:
        return np.zeros(dated.size, dtype=np.bool_), []
    timed = of_day_ns != NO_TIME
    of = {name: np.flatnonzero(timed & _of_address(frames, [name])) for name in _addresses(frames, timed)}
    first = often[0]
    for other in often[1:]:
        # of two that are as frequent, the one that is behind repeats the other
        if _ahead(of[first], of[other], of_day_ns)[0] > _DIFFERS_NS:
            first = other
    talkers = {name[:2] for name in _addresses(frames, dated)}
    satellites = bool(talkers & SATELLITES)
    own, others, notes = [first], [], []
    for name, record in of.items():
        talker = name[:2]
        dates = talker in talkers or (satellites and talker in SATELLITES)
        if name == first or not dates:
            continue
        ahead, usual = _ahead(of[first], record, of_day_ns)
        if not -_DIFFERS_NS <= ahead <= usual + _DIFFERS_NS:
            notes.append(f"{_differing(name, first, ahead)}: sentences without a time are dated by {first}.")
        elif talker == first[:2] or {talker, first[:2]} <= SATELLITES:
            own.append(name)
        else:
            others.append(name)
    speaks = _of_address(frames, own)
    return speaks | (_of_address(frames, others) & _silent(speaks & timed)), notes


def fixes_of_one(frames: Frames, dated: Flag, late_ns: Nanoseconds) -> tuple[Flag, list[str]]:
    """Return the dated sentences of the receiver that a logger's clock is compared with, shape (n,), and notes.

    Of several that are about as frequent the one whose fixes arrive first, if they do not arrive before their instants:
    a display repeats them late, and a clock of its own may be ahead.

    Parameters
    ----------
    late_ns : ndarray of int64, shape (n,)
        How long after its instant each dated sentence arrived by the logger's clock.
    """
    lates = {name: float(np.median(late_ns[dated & _of_address(frames, [name])])) for name in _frequent(frames, dated)}
    if not lates:
        return np.zeros(dated.size, dtype=np.bool_), []
    low, high = ARRIVES_NS
    set_by_it = {name: late for name, late in lates.items() if low <= late <= high}
    first = min(set_by_it or lates, key=lambda name: (lates[name], name))
    notes = [
        f"{_differing(name, first, lates[first] - late)}."
        for name, late in sorted(lates.items())
        if abs(lates[first] - late) > _DIFFERS_NS
    ]
    return dated & _of_address(frames, [first]), notes


def _differing(name: str, first: str, ahead_ns: float) -> str:
    how = "ahead of" if ahead_ns > 0 else "behind"
    return f"The clock of {name} is {abs(ahead_ns) / SECOND_NS:.1f} s {how} that of {first} (median)"


def _frequent(frames: Frames, dated: Flag) -> list[str]:
    """Return the addresses that give dates about as often as any other, the most frequent first; RMC where there is."""
    address = frames.address[dated]
    counted = np.bincount(address[address >= 0], minlength=len(frames.names)).tolist()
    counts = {name: many for name, many in zip(frames.names, counted, strict=True) if many}
    counts = {name: many for name, many in counts.items() if name[2:] == _FIX} or counts
    most = max(counts.values(), default=0)
    return sorted((name for name in counts if 2 * counts[name] >= most), key=lambda name: (-counts[name], name))


def _addresses(frames: Frames, mark: Flag) -> list[str]:
    """Return the addresses of marked sentences; damaged lines have many that say nothing."""
    return [frames.names[code] for code in np.unique(frames.address[mark & (frames.address >= 0)]).tolist()]


def _ahead(at: Index, record: Index, of_day_ns: Nanoseconds) -> tuple[float, float]:
    """Return by how much the times of some lines are ahead of the latest of others, and usual distances of these, ns.

    Up to one distance later is said within it; 0 where either says nothing.

    Parameters
    ----------
    at, record : ndarray of int64
        The others and the lines, ascending.
    """
    place = np.searchsorted(at, record) - 1
    record, place = record[place >= 0], place[place >= 0]
    if at.size < 2 or record.size == 0:
        return 0.0, 0.0
    usual = float(np.median(_apart(of_day_ns, at[1:], at[:-1])))
    return float(np.median(_apart(of_day_ns, record, at[place]))), max(usual, 0.0)


def _apart(of_day_ns: Nanoseconds, later: Index, earlier: Index) -> Nanoseconds:
    half = DAY_NS // 2
    difference: Nanoseconds = (of_day_ns[later] - of_day_ns[earlier] + half) % DAY_NS - half
    return difference


def _of_address(frames: Frames, names: Collection[str]) -> Flag:
    wanted = np.zeros(len(frames.names) + 1, dtype=np.bool_)
    wanted[[frames.names.index(name) for name in names]] = True
    of_it: Flag = wanted[frames.address]
    return of_it


def _silent(speaks: Flag) -> Flag:
    """Return which lines are between two sentences of a receiver that are far apart, counted in lines."""
    (at,) = np.nonzero(speaks)
    n = speaks.size
    if at.size == 0:
        return np.ones(n, dtype=np.bool_)
    usual = float(np.median(np.diff(at))) if at.size > 1 else float(n)
    lasts = np.diff(np.concatenate(([-1], at, [n])))
    silent: Flag = np.repeat(lasts > _SILENT * usual, lasts)[:n]
    return silent
