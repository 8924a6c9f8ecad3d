"""The checks that every record of every format passes, in columns: clock, repetition, numbers, physical range.

Here the readings of a log are parted from what is refused, and both ledgers are drawn up. Whether a channel makes sense
as a whole is the doctor's question, not one of this room.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pyarrow as pa
from numpy.typing import NDArray

from kempf.pipeline.ingest.clock import Clock
from kempf.pipeline.ingest.decoded import CODE, NO_TIME, REASONS, Decoded, Reason, Values
from kempf.pipeline.ingest.readings import READING_SCHEMA, REJECTED_SCHEMA, Readings, Tally
from kempf.pipeline.ingest.spans import Index
from kempf.pipeline.ingest.text.times import days_since_1970
from kempf.pipeline.ingest.turns import Turns
from kempf.schemas.channels import CHANNELS
from kempf.schemas.units import DAY_NS

Code = NDArray[np.int8]
Flag = NDArray[np.bool_]

_YEARS, _ = days_since_1970(np.array([2000, 2100]), np.array([1, 1]), np.array([1, 1]))

#: No clock was set before the first of these instants or after the second.
CLOCK_FIRST_NS, CLOCK_LAST_NS = (int(day) * DAY_NS for day in _YEARS)


class Screen:
    """The checks of one log, which comes in one part or in several; what they find does not depend on where it is cut.

    What a record that comes later can still decide is held back, and comes out with the next part: of each source the
    last record, and those that share the latest instant, and angles beyond one turn that may be nonsense.

    Parameters
    ----------
    log_format : {"delimited", "mcap", "nmea"}
    first_ns : int, optional
        Earliest time that is taken for one, UTC nanoseconds.
    """

    def __init__(self, log_format: str, first_ns: int = CLOCK_FIRST_NS) -> None:
        self._format, self._first_ns = log_format, first_ns
        self._turns = Turns()
        self._clocks: dict[int, Clock] = {}
        self._held: Decoded | None = None
        self._settled = np.empty(0, dtype=np.bool_)

    def part(self, decoded: Decoded) -> Readings:
        """Check records and split them into readings and refusals.

        Parameters
        ----------
        decoded : Decoded
            What follows on the part before; nothing may follow on one that ends the log.

        Returns
        -------
        Readings
            With both ledgers closed: over this part, and what was held back of the one before, less what is held back
            now.
        """
        work = decoded if self._held is None else decoded.behind(self._held)
        settled = np.concatenate([self._settled, np.zeros(len(decoded), dtype=np.bool_)])
        reason = work.reason.copy()
        held, settled, sources = self._check_clocks(work, reason, settled)
        sources = _kept(sources, (reason == 0) & ~held)
        waits = self._turns.undecided(work, sources)
        if waits.any():
            held |= waits
            sources = _kept(sources, ~held)
        work = replace(work, channels=self._turns.wrapped(work, sources))
        if held.any():
            self._held, self._settled = work.take(np.flatnonzero(held)), settled[held]
            left = np.flatnonzero(~held)
            work, reason = work.take(left), reason[left]
        else:
            self._held, self._settled = None, settled[:0]
        if work.ends:
            work = replace(work, notes=[*work.notes, *self._turns.notes()])
        return _checked(work, reason, self._format)

    def _check_clocks(self, work: Decoded, reason: Code, settled: Flag) -> tuple[Flag, Flag, dict[int, Index]]:
        """Refuse what the clock forbids.

        Return which records are held back, of which the clock is settled, and what was looked at by source.
        """
        time = work.time_utc_ns
        reason[(reason == 0) & (time == NO_TIME)] = CODE[Reason.NO_TIME]
        unset = (time < self._first_ns) | (time >= CLOCK_LAST_NS)
        reason[(reason == 0) & unset] = CODE[Reason.CLOCK_UNSET]
        held = np.zeros(reason.shape, dtype=np.bool_)
        sources = {int(work.source[own[0]]): own for own in _by_source(work, reason)}
        for source, own in sources.items():
            clock = self._clocks.setdefault(source, Clock())
            fresh = own[~settled[own]]
            back = clock.goes_back(time[fresh], ends=work.ends)
            known = fresh[: back.size]
            reason[known[back]] = CODE[Reason.CLOCK_BACK]
            settled[known] = True
            if not work.ends:
                held[fresh[back.size :]] = True
                held[own[settled[own] & (reason[own] == 0) & (time[own] == clock.latest)]] = True
        return held, settled, sources


def _kept(sources: dict[int, Index], mask: Flag) -> dict[int, Index]:
    return {source: own[mask[own]] for source, own in sources.items()}


def _checked(decoded: Decoded, reason: Code, log_format: str) -> Readings:
    """Check everything but the clocks."""
    shared = _sharing_an_instant(decoded, reason)
    if shared.size:
        content = decoded.content.take(shared).binary()
        repeated = ~_first_of(decoded, shared, content)
        reason[shared[repeated]] = CODE[Reason.DUPLICATE]
        shared = shared[~repeated]
    refused = {name: _check_values(name, v, reason, shared, decoded) for name, v in decoded.channels.items()}
    _refuse_emptied(decoded, reason, refused)
    return _readings(decoded, reason, refused, log_format)


def _by_source(decoded: Decoded, reason: Code) -> list[Index]:
    """Return the good records of each source, in the order of the file."""
    good = np.flatnonzero(reason == 0)
    source = decoded.source[good]
    if len(decoded.source_names) <= np.iinfo(np.int16).max:
        # numbers of two bytes are sorted by counting them
        source = source.astype(np.int16)
    order = np.argsort(source, kind="stable")
    cuts = np.flatnonzero(np.diff(source[order])) + 1
    return [part for part in np.split(good[order], cuts) if part.size]


def _sharing_an_instant(decoded: Decoded, reason: Code) -> Index:
    """Return the good records that have their source and time in common with another, ascending."""
    records = []
    for record in _by_source(decoded, reason):
        same = np.diff(decoded.time_utc_ns[record]) == 0
        records.append(record[np.append(same, [False]) | np.append([False], same)])
    return np.sort(np.concatenate(records)) if records else np.empty(0, dtype=np.int64)


def _first_of(decoded: Decoded, record: Index, content: pl.Series | None = None) -> NDArray[np.bool_]:
    """Return which records are the first of their source and time (and content)."""
    keys = pl.DataFrame({"source": decoded.source[record], "time": decoded.time_utc_ns[record]})
    if content is not None:
        keys = keys.with_columns(content=content)
    first: NDArray[np.bool_] = keys.select(pl.struct(pl.all()).is_first_distinct()).to_series().to_numpy()
    return first


def _check_values(name: str, values: Values, reason: Code, shared: Index, decoded: Decoded) -> Code:
    """Return the code of the refusal of each value, 0 for one that is kept or not there, shape (n,)."""
    refused = np.zeros(reason.shape, dtype=np.int8)
    # of many channels each record offers few
    at = np.flatnonzero(values.present & (reason == 0))
    channel = CHANNELS[name]
    value = values.value[at]
    with np.errstate(invalid="ignore"):
        outside = (value < channel.low) | (value > channel.high)
    refused[at[~np.isfinite(value)]] = CODE[Reason.NOT_A_NUMBER]
    refused[at[outside]] = CODE[Reason.OUT_OF_RANGE]
    standing = shared[values.present[shared] & (reason[shared] == 0) & (refused[shared] == 0)]
    if standing.size:
        refused[standing[~_first_of(decoded, standing)]] = CODE[Reason.SAME_INSTANT]
    return refused


def _refuse_emptied(decoded: Decoded, reason: Code, refused: dict[str, Code]) -> None:
    """Refuse the records of which no value is left, for the reason of the first value in the order of the tables."""
    kept = np.zeros(reason.shape, dtype=np.bool_)
    why = np.zeros(reason.shape, dtype=np.int8)
    for name in CHANNELS:
        if name in refused:
            kept |= decoded.channels[name].present & (refused[name] == 0)
            why = np.where(why == 0, refused[name], why)
    emptied = (reason == 0) & ~kept
    reason[emptied] = np.where(why[emptied] == 0, CODE[Reason.VOID], why[emptied])


def _readings(decoded: Decoded, reason: Code, refused: dict[str, Code], log_format: str) -> Readings:
    kept = np.flatnonzero(reason == 0)
    # most logs have few of the channels, and all instants: one column of nothing serves all others
    nothing = pl.Series(pa.nulls(kept.size, pa.float64()))
    std_s = pl.Series([decoded.instant_std_s.get(name) for name in decoded.source_names], dtype=pl.Float64)
    columns: dict[str, pl.Series] = {
        "record": pl.Series(decoded.record[kept], dtype=pl.Int64),
        "time_utc_ns": pl.Series(decoded.time_utc_ns[kept], dtype=pl.Int64),
        "instant_std_s": _of_source(decoded, kept, std_s) if decoded.instant_std_s else nothing,
        "source": _source_names(decoded, kept),
    }
    values_read = values_kept = 0
    for channel in CHANNELS.values():
        if channel.name not in refused:
            columns[channel.column] = nothing
            continue
        offered = decoded.channels[channel.name].present[kept]
        there = offered & (refused[channel.name][kept] == 0)
        values_read += int(np.sum(offered))
        values_kept += int(np.sum(there))
        # by way of Arrow: a mask of its own spares a query of the engine a column
        columns[channel.column] = pl.Series(pa.array(decoded.channels[channel.name].value[kept], mask=~there))
    frame = pl.DataFrame(columns, schema=READING_SCHEMA)
    rejected = _rejected(decoded, reason, refused)
    counts = rejected.group_by("reason").len().sort("reason")
    records_rejected = int(np.sum(reason != 0))
    tally = Tally(
        records_read=len(decoded),
        records_kept=frame.height,
        records_rejected=records_rejected,
        values_read=values_read,
        values_kept=values_kept,
        values_rejected=rejected.height - records_rejected,
        by_reason=dict(counts.iter_rows()),
    )
    return Readings(frame, rejected, tally, tuple(decoded.notes), log_format, decoded.lost)


def _rejected(decoded: Decoded, reason: Code, refused: dict[str, Code]) -> pl.DataFrame:
    """Draw up what is refused: whole records, then values of kept records, sorted by record and channel."""
    parts: list[tuple[Index, str | None, Code]] = [(np.flatnonzero(reason != 0), None, reason)]
    for name, code in refused.items():
        parts.append((np.flatnonzero((reason == 0) & (code != 0)), name, code))
    # most channels have nothing refused
    parts = [part for part in parts if part[0].size] or parts[:1]
    record = np.concatenate([where for where, _, _ in parts])
    if len(parts) == 1:
        text = decoded.raw.take(record).text()
    else:
        named = np.zeros(len(decoded), dtype=np.bool_)
        named[record] = True
        distinct = np.flatnonzero(named)
        text = decoded.raw.take(distinct).text().gather(np.searchsorted(distinct, record))
    time = decoded.time_utc_ns[record]
    words = pl.Series([None, *(str(r) for r in REASONS)], dtype=pl.String)
    codes = np.concatenate([code[where] for where, _, code in parts])
    table = pl.DataFrame(
        {
            "record": decoded.record[record],
            "time_utc_ns": pl.Series(time).set(pl.Series(time == NO_TIME), None),
            "source": _source_names(decoded, record),
            "channel": pl.concat(
                [pl.repeat(name, where.size, dtype=pl.String, eager=True) for where, name, _ in parts]
            ),
            "reason": words.gather(codes.astype(np.int64)),
            "raw": text,
        },
        schema=REJECTED_SCHEMA,
    )
    # one part is in order already
    return table if len(parts) == 1 else table.sort("record", "channel", nulls_last=False, maintain_order=True)


def _source_names(decoded: Decoded, record: Index) -> pl.Series:
    return _of_source(decoded, record, pl.Series(decoded.source_names, dtype=pl.String))


def _of_source(decoded: Decoded, record: Index, by_source: pl.Series) -> pl.Series:
    """Return what belongs to the source of each record; null of one without."""
    code, without = decoded.source[record], len(by_source)
    return by_source.extend_constant(None, 1).gather(np.where(code < 0, without, code))
