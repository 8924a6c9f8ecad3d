"""The time of each sentence of an NMEA log: its own, its stamp's, or that of the fix it came with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl
from numpy.typing import NDArray

from pipeline.ingest.decoded import NO_TIME, Nanoseconds
from pipeline.ingest.iso_time import DAY_NS, SECOND_NS, days_since_1970
from pipeline.ingest.nmea_fields import Said
from pipeline.ingest.nmea_frames import Frames
from pipeline.ingest.numerals import number
from schemas.nmea import SENTENCES

#: Two-digit years from here on are of the last century.
_CENTURY = 70

#: Evidence asked for before untimed sentences are given to the fix that follows them.
_LEAST_AGREEMENTS, _RATIO = 5, 2


@dataclass(frozen=True, eq=False)
class Clock:
    """Times of the sentences.

    Attributes
    ----------
    time_utc_ns : ndarray of int64, shape (n,)
        `NO_TIME` where none can be given.
    follows : bool
        Whether untimed sentences of a plain log belong to the fix behind them.
    stamp_lead_s : float
        Median of stamp minus own time of the dated sentences, s; NaN where there is none.
    """

    time_utc_ns: Nanoseconds
    follows: bool
    stamp_lead_s: float


def clock_of(frames: Frames, said: dict[str, Said]) -> Clock:
    """Give each sentence its time.

    Parameters
    ----------
    frames : Frames
    said : dict of str to Said
        What the sentences say, by type.

    Returns
    -------
    Clock
    """
    n = len(frames.lines)
    of_day = np.full(n, NO_TIME, dtype=np.int64)
    midnight = np.full(n, NO_TIME, dtype=np.int64)
    for name, what in said.items():
        utc, date = SENTENCES[name].utc, SENTENCES[name].date
        if utc is None:
            continue
        of_day[what.record] = _time_of_day(what.text[f"f{utc}"])
        if date is not None:
            midnight[what.record] = _date(what.text[f"f{date}"])
        elif name == "ZDA":
            midnight[what.record] = _ymd(*(number(what.text[f"f{k}"]) for k in (4, 3, 2)))
    timed = of_day != NO_TIME
    dated = timed & (midnight != NO_TIME)
    own = _with_date(of_day, np.where(dated, midnight + of_day, NO_TIME), frames.stamp_ns)
    if frames.stamped:
        both = dated & (frames.stamp_ns != NO_TIME)
        lead = float(np.median((frames.stamp_ns - own)[both])) / SECOND_NS if both.any() else float("nan")
        return Clock(np.where(own != NO_TIME, own, frames.stamp_ns), follows=False, stamp_lead_s=lead)
    follows = _follows(said)
    fix = (own != NO_TIME) & _of_a_dated_talker(frames, dated)
    carrier = _next(fix) if follows else _latest(fix)
    carried = np.where((carrier >= 0) & (carrier < n), own[np.clip(carrier, 0, max(n - 1, 0))], NO_TIME)
    return Clock(np.where(own != NO_TIME, own, carried), follows, float("nan"))


def _of_a_dated_talker(frames: Frames, dated: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Tell which sentences come from a talker that also tells the date.

    A display that repeats a receiver's position without the date repeats it late, too: it gives its own sentences
    their time, but carries none to others.
    """
    talkers = {frames.names[code][:2] for code in np.unique(frames.address[dated]) if code >= 0}
    of_name = [name[:2] in talkers for name in frames.names]
    return np.array([*of_name, False], dtype=np.bool_)[frames.address]


def _with_date(of_day: Nanoseconds, full: Nanoseconds, stamp: Nanoseconds) -> Nanoseconds:
    """Complete times of day by the nearest day: to the latest dated sentence, else the first one, else the stamp."""
    dated = full != NO_TIME
    if dated.any():
        latest = _latest(dated)
        anchor = full[np.where(latest >= 0, latest, int(np.flatnonzero(dated)[0]))]
    else:
        anchor = stamp
    known = (of_day != NO_TIME) & (anchor != NO_TIME)
    safe_anchor, safe_day = np.where(known, anchor, 0), np.where(known, of_day, 0)
    guess = safe_anchor // DAY_NS * DAY_NS + safe_day
    half = DAY_NS // 2
    guess += DAY_NS * ((safe_anchor - guess > half).astype(np.int64) - (guess - safe_anchor > half))
    return np.where(dated, full, np.where(known, guess, NO_TIME))


def _latest(mark: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return for each place the latest marked one up to it, -1 before the first."""
    return np.maximum.accumulate(np.where(mark, np.arange(mark.size), -1)) if mark.size else np.empty(0, np.int64)


def _next(mark: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return for each place the next marked one from it on, n behind the last."""
    place = np.where(mark, np.arange(mark.size), mark.size)
    return np.minimum.accumulate(place[::-1])[::-1] if mark.size else np.empty(0, np.int64)


def _follows(said: dict[str, Said]) -> bool:
    """Tell whether VTG repeats the speed of the RMC behind it rather than of the one before it."""
    if "RMC" not in said or "VTG" not in said:
        return False
    rmc, vtg = said["RMC"], said["VTG"]
    at, speed = rmc.record, number(rmc.text["f7"])
    asked, its = vtg.record, number(vtg.text["f5"])
    if at.size == 0:
        return False
    behind = np.searchsorted(at, asked)
    between = (behind > 0) & (behind < at.size)
    ahead = np.abs(its - speed[np.clip(behind - 1, 0, at.size - 1)])
    after = np.abs(its - speed[np.clip(behind, 0, at.size - 1)])
    # NaN compares false: what is void bears no witness
    next_wins, last_wins = int(np.sum(between & (after < ahead))), int(np.sum(between & (ahead < after)))
    return next_wins >= _LEAST_AGREEMENTS and next_wins > _RATIO * last_wins


def _time_of_day(text: pl.Series) -> Nanoseconds:
    """Read hhmmss.ss as nanoseconds of the day; `NO_TIME` where it is none."""
    text = text.fill_null("")
    good = text.str.contains(r"^\d{6}(\.\d*)?$").to_numpy().copy()
    hours, minutes, seconds = (_digits(text.str.slice(k, 2)) for k in (0, 2, 4))
    fraction = _digits(text.str.slice(7, 9).str.pad_end(9, "0"))
    good &= (hours < 24) & (minutes < 60) & (seconds <= 60)
    return np.where(good, (hours * 3_600 + minutes * 60 + seconds) * SECOND_NS + fraction, NO_TIME)


def _date(text: pl.Series) -> Nanoseconds:
    """Read ddmmyy as nanoseconds of its midnight; `NO_TIME` where it is none."""
    text = text.fill_null("")
    six = text.str.contains(r"^\d{6}$").to_numpy()
    day, month, year = (_digits(text.str.slice(k, 2)) for k in (0, 2, 4))
    days, exists = days_since_1970(year + np.where(year >= _CENTURY, 1900, 2000), month, day)
    return np.where(six & exists, days * DAY_NS, NO_TIME)


def _ymd(year: NDArray[np.float64], month: NDArray[np.float64], day: NDArray[np.float64]) -> Nanoseconds:
    known = np.isfinite(year) & np.isfinite(month) & np.isfinite(day) & (year > 1900) & (year < 2200)
    y, m, d = (np.where(known, np.nan_to_num(v, posinf=0, neginf=0), 1).astype(np.int64) for v in (year, month, day))
    days, exists = days_since_1970(y, m, d)
    return np.where(known & exists, days * DAY_NS, NO_TIME)


def _digits(text: pl.Series) -> NDArray[np.int64]:
    return text.cast(pl.Int64, strict=False).fill_null(0).to_numpy()
