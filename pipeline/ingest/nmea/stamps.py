"""The time that stands in front of a sentence: an ISO 8601 stamp, or the seconds or milliseconds since 1970."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl

from kempf.pipeline.ingest.decoded import Flag, Nanoseconds
from kempf.pipeline.ingest.nmea.tags import Tags
from kempf.pipeline.ingest.spans import Index, Spans, is_blank, spans_of, trimmed
from kempf.pipeline.ingest.text.times import iso_instants

_COMMA, _SEMICOLON = ord(","), ord(";")

#: Characters in front of a sentence that are searched for a time; a sentence itself has no more than 82.
_SEARCHED = 200

#: Year first, so that no day is taken for a month. Port names, levels, brackets and quotes may stand around it. An
#: offset behind a blank has four digits: one of two may be any number.
_DATE_TIME = (
    r"(?:^|[^0-9])(?P<year>[0-9]{4})[-/.]?(?P<month>[0-9]{2})[-/.]?(?P<day>[0-9]{2})(?:[Tt_]|[ \t]{1,2})"
    r"(?P<hour>[0-9]{2}):?(?P<minute>[0-9]{2}):?(?P<second>[0-9]{2})(?:[.,:](?P<part>[0-9]+))?"
    r"(?:[ \t]?(?P<zone>[Zz]|UTC|GMT|[+-][0-9]{2}:?[0-9]{2})|(?P<hours>[+-][0-9]{2}))?(?:$|[^0-9A-Za-z])"
)

#: Behind a time of day: a zone by its letters, an offset from UTC by name or in one digit, the half of the day. Read
#: as UTC they would be hours off.
_OTHER_ZONE = (
    r"[0-9] ?(?:(?:UTC|GMT) ?[+-][0-9]|[+-][0-9](?:$|[^0-9])|(?i:AM|PM)\b|(?:CES?T|EES?T|WES?T|BST|IST|MSK|[ECMP][SD]T|"
    r"JST|SGT|AES?T)\b)"
)

#: Ten digits count seconds, thirteen milliseconds: with the first digit that is asked for, the years 2001 to 2096.
_SINCE_1970 = r"(?:^|[^0-9A-Za-z.:+-])(?P<whole>[1-3](?:[0-9]{9}|[0-9]{12}))(?:\.(?P<part>[0-9]+))?(?:$|[^0-9A-Za-z.:])"

#: Digits of a time since 1970 in nanoseconds, in the years above.
_DIGITS = 19

_NONE = pl.lit("")


@dataclass(frozen=True, eq=False)
class Stamps:
    """What stands in front of the sentences of some lines, or in their TAG blocks, read as times."""

    #: Shape (n,). Zero where none is read.
    time_utc_ns: Nanoseconds
    #: Shape (n,). Where a time is read.
    good: Flag
    #: Shape (n,). Where it names its zone.
    zoned: Flag
    #: Shape (n,). Where text in front of the sentence is not read as a time.
    unread: Flag


def stamps_of(lines: Spans, first: Index, tags: Tags) -> Stamps:
    """Read the time in front of each sentence; else that of the TAG block.

    Parameters
    ----------
    lines : Spans
        Shape (n,).
    first : ndarray of int64, shape (n,)
        Where the sentence of each line begins.
    tags : Tags
        The TAG blocks of the lines.

    References
    ----------
    ISO 8601-1:2019, extended and basic form; seconds since 1970 as of POSIX.
    """
    stop = np.maximum(np.minimum(first, tags.start), lines.start)
    front = Spans(lines.buffer, lines.start, stop)
    if not bool(np.any(stop > lines.start)):
        return Stamps(tags.time_utc_ns, tags.timed, tags.timed, np.zeros(len(lines), dtype=np.bool_))
    time, good, zoned = iso_instants(_without_separators(front))
    at = np.flatnonzero(~good & (stop > lines.start))
    if at.size:
        time[at], good[at], zoned[at] = _searched(front.take(at))
    unread = ~good & ~tags.timed & (stop > lines.start)
    return Stamps(np.where(good, time, tags.time_utc_ns), good | tags.timed, zoned | (tags.timed & ~good), unread)


def _without_separators(front: Spans) -> Spans:
    """Return the texts up to the comma, the semicolon or the blanks that set them off from the sentence."""
    buffer, start, stop = front.buffer, front.start, front.stop
    # most stamps are set off by one sign, some by a sign with blanks around it
    for _ in range(2):
        end = buffer[np.maximum(stop - 1, 0)]
        cut = (stop > start) & ((end == _COMMA) | (end == _SEMICOLON) | is_blank(end))
        if not cut.any():
            break
        stop = stop - cut
    else:
        stop = trimmed(Spans(buffer, start, stop)).stop
    return Spans(buffer, start, stop)


def _searched(front: Spans) -> tuple[Nanoseconds, Flag, Flag]:
    """Search texts for an ISO 8601 stamp, those without one for a time since 1970; return what `iso_instants` does."""
    text = front.text(_SEARCHED)
    time, good, zoned = _dates_and_times(text)
    at = np.flatnonzero(~good)
    if at.size:
        time[at], good[at] = _since_1970(text[at])
        zoned[at] = good[at]
    return time, good, zoned


def _dates_and_times(text: pl.Series) -> tuple[Nanoseconds, Flag, Flag]:
    """Write what is found in each text in the one form that `iso_instants` reads."""
    part = pl.when(pl.col("part").is_null()).then(_NONE).otherwise(pl.lit(".") + pl.col("part").str.slice(0, 9))
    zone = pl.coalesce("zone", "hours", _NONE).str.replace(r"^(?:UTC|GMT)$", "Z")
    names = ("year", "month", "day", "hour", "minute", "second")
    text = pl.select(pl.when(~text.str.contains(_OTHER_ZONE)).then(text)).to_series()
    found = text.str.extract_groups(_DATE_TIME).struct.unnest()
    return iso_instants(spans_of(found.select(pl.format("{}-{}-{}T{}:{}:{}{}{}", *names, part, zone)).to_series()))


def _since_1970(text: pl.Series) -> tuple[Nanoseconds, Flag]:
    """Read seconds or milliseconds since 1970: either is so many nanoseconds when its digits are filled up."""
    digits = (pl.col("whole") + pl.coalesce("part", _NONE)).str.slice(0, _DIGITS).str.pad_end(_DIGITS, "0")
    found = text.str.extract_groups(_SINCE_1970).struct.unnest()
    time = found.select(digits.cast(pl.Int64, strict=False)).to_series()
    return time.fill_null(0).to_numpy(), time.is_not_null().to_numpy()
