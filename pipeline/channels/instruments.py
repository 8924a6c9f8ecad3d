"""From the readings of a log to one series a channel: one instrument each, at its instants of measurement.

Which of several instruments serves a channel is decided here, and said; earth-fixed velocities become speed and course
here, so that later rooms know one form only.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import hypot, inf

import numpy as np
import polars as pl

from kempf.pipeline.channels.found_instants import AS_TAKEN, OTHERS, VELOCITY, FoundInstants
from kempf.pipeline.channels.gaps import named_gaps
from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.holds import WITHIN, Held, find_held
from kempf.pipeline.channels.second_instrument import difference
from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.pipeline.channels.there_and_back import LEAPING, leaps, said
from kempf.schemas.channels import CHANNELS, ROW
from kempf.schemas.enumeration import listed
from kempf.schemas.nmea import SENTENCES
from kempf.schemas.units import SECOND_NS

#: channels that one instrument measures at one instant, so that they share their rows
_TOGETHER: tuple[tuple[str, ...], ...] = (
    ("latitude", "longitude"),
    ("speed_over_ground", "course_over_ground"),
    ("velocity_north", "velocity_east"),
    ("velocity_forward", "velocity_starboard"),
    ("wind_speed", "wind_angle"),
)
#: readings that are held whole: asking the tables for the columns of one instrument after the other costs a short log
#: more than its readings take
_SHORT = 1 << 16
#: sentences that carry the receiver's own time of the fix, and those of a compass that deviates
_OWN_CLOCK, _MAGNETIC = ("RMC", "GGA", "GLL"), ("HDG", "HDM")
#: talkers of displays and integrated systems, which repeat late and rounded what an instrument says
_REPEATS = ("II", "IN")
#: share of the most frequent source's readings from which a better one is taken, and from which one is as frequent
_ENOUGH, _AS_MANY = 0.25, 0.9
#: table rows so far apart, s, do not show that they repeat a receiver of one fix a second; share of the rows of a table
#: that an instrument fills whose values are sampled, and not written as they come
_SLOW_S, _FILLED = 0.65, 0.9


@dataclass(frozen=True, eq=False)
class Instruments:
    """The series of one log."""

    #: By canonical channel name; only channels that the log has.
    series: dict[str, Series]
    #: The log's source that serves each channel.
    sources: dict[str, str]
    #: Choices made, one sentence each.
    notes: tuple[str, ...]
    #: Channels that the log does not have and that were computed from others.
    derived: frozenset[str] = frozenset()
    #: Standard error, s, of the instants of a channel in rows that were written at a rate of their own (decision 0109),
    #: or behind stamps that several readings share (decision 0114).
    instant_std_s: dict[str, float] = field(default_factory=dict)
    #: Instants, UTC ns, of the readings of a channel that were left out, see
    #: `kempf.pipeline.channels.there_and_back.leaps`.
    left_out: dict[str, Nanoseconds] = field(default_factory=dict)
    #: Time between rows, s, of a table that has all channels and of which nothing shows whether its rows hold the last
    #: readings; 0 of any other log.
    row_s: float = 0.0
    #: What was taken out of the instants of the log.
    found: FoundInstants = AS_TAKEN

    def get(self, channel: str) -> Series | None:
        """Return the series of a channel, or None where the log lacks it."""
        return self.series.get(channel)

    def moved(self, found: FoundInstants) -> Instruments:
        """Return the log with each of its channels at the instants that were found.

        What was found before is replaced. Velocities that were turned out of the ship's frame are turned again, by
        the heading of their own instants.
        """
        if found == self.found:
            return self
        before, back = self.found.by_channel(), found.by_channel()
        series = {name: one.earlier(back.get(name, 0) - before.get(name, 0)) for name, one in self.series.items()}
        if "course_over_ground" in self.derived and "velocity_north" not in series:
            turned = {name: one for name, one in series.items() if name not in self.derived}
            _add_from_the_bow(turned, dict(self.sources), [])
            series |= turned
        return replace(self, series=series, found=found)


def from_readings(readings: pl.DataFrame | pl.LazyFrame) -> Instruments:
    """Build the series of every channel from the readings of one log.

    Parameters
    ----------
    readings : polars.DataFrame or polars.LazyFrame
        Of one log, sorted by record, schema `pipeline.ingest.readings.READING_SCHEMA`; of a long lazy one the columns
        of one instrument are held at a time.
    """
    frame = readings.lazy()
    there = set(frame.collect_schema().names())
    grouped = {name for group in _TOGETHER for name in group}
    groups = [*_TOGETHER, *((name,) for name in CHANNELS if name not in grouped)]
    groups = [group for group in groups if there.issuperset(_columns(group))]
    counts = _counts(frame, [*groups, *((name,) for group in groups if len(group) > 1 for name in group)])
    of_stamps = dict(counts.select("source", "instant_std_s").iter_rows())
    if counts["readings"].sum() <= _SHORT:
        frame = frame.collect().lazy()
    series: dict[str, Series] = {}
    sources: dict[str, str] = {}
    notes: list[str] = []
    unsure: dict[str, float] = {}
    table = _Table.of(frame) if ROW in of_stamps else _Table(0, inf)
    for group in groups:
        offered = counts.filter(pl.col(_name(group)) > 0)
        if offered.is_empty():
            # messages of their own, such as a topic for the speed and one for the course
            groups += [(name,) for name in group if len(group) > 1]
            continue
        source, others = _choose(dict(offered.select("source", _name(group)).iter_rows()))
        own_notes: list[str] = []
        channels, held = _at_instants(group, *_of_one(frame, source, group), source, own_notes)
        if others:
            also = (_also(frame, other, group, channels) for other in others)
            notes.append(f"{' and '.join(group)} from {source}; also in {', '.join(also)}, not used")
        notes += own_notes
        series |= channels
        sources |= dict.fromkeys(channels, source)
        if (std_s := hypot(held.std_s, of_stamps[source])) > 0.0:
            unsure |= dict.fromkeys(channels, std_s)
        if held.rows_per_value > 1:
            table.repeats = table.repeats or source == ROW
        elif source == ROW and held.time_utc_ns.size >= _FILLED * table.rows:
            table.fresh += channels
    gaps, leaping = named_gaps(series), list[str]()
    left_out = _leave_out_leaps(series, leaping)
    if table.sampled and table.fresh:
        # behind the leaps, which are named by their rows
        _put_in_the_middle(table, series, notes)
        unsure |= dict.fromkeys(table.fresh, table.apart_s * WITHIN)
    notes = [*gaps, *leaping, *notes]
    own = set(series)
    _add_speed_and_course(series, sources, notes)
    _add_from_the_bow(series, sources, notes)
    served = {sources.get(name) for name in (*VELOCITY, *OTHERS)} - {None}
    row_s = table.apart_s if served == {ROW} and not table.sampled and table.apart_s < inf else 0.0
    return Instruments(series, sources, tuple(notes), frozenset(set(series) - own), unsure, left_out, row_s)


@dataclass
class _Table:
    """The rows of a table, with what its instruments show of them; a log of messages has none."""

    #: How many there are, and how far apart they are, s.
    rows: int
    apart_s: float
    #: Whether they repeat the last value of an instrument.
    repeats: bool = False
    #: Channels that fill them and are not repeated.
    fresh: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, frame: pl.LazyFrame) -> _Table:
        """Count the rows; where several share a coarse time, they are so much closer."""
        time = frame.filter(pl.col("source") == ROW).select("time_utc_ns").drop_nulls().collect()["time_utc_ns"]
        own = time.unique().sort()
        apart_s = float(np.median(np.diff(own.to_numpy()))) / SECOND_NS if own.len() > 1 else inf
        return cls(time.len(), apart_s * own.len() / max(time.len(), 1))

    @property
    def sampled(self) -> bool:
        """Whether rows have instants of their own, and not those of their instruments (decision 0109)."""
        return self.repeats or _SLOW_S <= self.apart_s < inf


def _put_in_the_middle(table: _Table, series: dict[str, Series], notes: list[str]) -> None:
    """Take what was measured at some time since the row before at the middle of that time."""
    for name in table.fresh:
        series[name] = series[name].earlier(round(0.5 * table.apart_s * SECOND_NS))
    why = "that repeat other instruments" if table.repeats else "as slow as instruments measure"
    notes.append(
        f"{listed(table.fresh)}: in rows of {table.apart_s:.2g} s, {why}: measured at some time since the row before, "
        "of which the middle is taken"
    )


def _leave_out_leaps(series: dict[str, Series], notes: list[str]) -> dict[str, Nanoseconds]:
    """Take the readings that leap away and back out of the channels, and return their instants."""
    left_out = {}
    for name in LEAPING:
        whole = series.get(name)
        if whole is None or not (found := leaps(whole, name)).any():
            continue
        notes.append(said(name, whole, found))
        left_out[name] = whole.time_utc_ns[found]
        rest = Series(whole.time_utc_ns[~found], whole.value[~found])
        # a rudder is known between its readings, and two that are missing would count as a gap
        bridged = name == "rudder_angle"
        series[name] = rest.with_points(left_out[name], rest.at(left_out[name], inf)) if bridged else rest
    return left_out


def _columns(group: tuple[str, ...]) -> list[str]:
    return [CHANNELS[name].column for name in group]


def _name(group: tuple[str, ...]) -> str:
    return " ".join(group)


def _counts(frame: pl.LazyFrame, groups: list[tuple[str, ...]]) -> pl.DataFrame:
    """Count the readings, and those that give all channels of a group: a row a source, sorted by name.

    Beside it, how well the source's instants are known, in the median.
    """
    whole = [pl.all_horizontal(pl.col(_columns(g)).is_not_null()).sum().alias(_name(g)) for g in groups]
    return (
        frame.drop_nulls(["time_utc_ns", "source"])
        .group_by("source")
        .agg(pl.len().alias("readings"), pl.col("instant_std_s").fill_null(0.0).median(), *whole)
        .sort("source")
        .collect()
    )


def _of_one(frame: pl.LazyFrame, source: str, group: tuple[str, ...]) -> tuple[Nanoseconds, Float]:
    """Return the instants, shape (n,), and the values, shape (n, channels), of one source."""
    rows = frame.filter(pl.col("source") == source).select("time_utc_ns", *_columns(group)).drop_nulls().collect()
    time = rows["time_utc_ns"].to_numpy().astype(np.int64, copy=False)
    return time, rows.select(_columns(group)).to_numpy().astype(np.float64, copy=False)


def _also(frame: pl.LazyFrame, source: str, group: tuple[str, ...], chosen: dict[str, Series]) -> str:
    """Name a source that does not serve a group, and by how much it differs from the one that does."""
    # two antennas are two places
    if "latitude" in group:
        return source
    channels, _ = _at_instants(group, *_of_one(frame, source, group), source, [])
    found = {name: difference(name, chosen[name], channels[name]) for name in group}
    if len(set(found.values())) == 1:
        differ = next(iter(found.values()))
    else:
        differ = "; ".join(f"{name} {words}" for name, words in found.items() if words)
    return f"{source} ({differ})" if differ else source


def _choose(counts: dict[str, int]) -> tuple[str, list[str]]:
    """Name the source that is nearest to the instrument; among equals that with most readings, then by name.

    The others come second.
    """
    most = max(counts.values())
    enough = {name: many for name, many in counts.items() if many >= _ENOUGH * most}
    best = min(map(_remoteness, enough))
    equal = {name: many for name, many in enough.items() if _remoteness(name) == best}
    chosen = min(name for name, many in equal.items() if many >= _AS_MANY * max(equal.values()))
    return chosen, [name for name in counts if name != chosen]


def _remoteness(source: str) -> tuple[bool, bool, bool]:
    """Say how far a source is from the instrument: a magnetic compass, a repeater, a sentence without its own time.

    Only the address of an NMEA sentence says so; topics and columns are as near as any.
    """
    talker, sentence = source[:2], source[2:]
    if sentence not in SENTENCES or not talker.isupper():
        return False, False, False
    return sentence in _MAGNETIC, talker in _REPEATS, sentence not in _OWN_CLOCK


def _at_instants(
    group: tuple[str, ...], time: Nanoseconds, values: Float, source: str, notes: list[str]
) -> tuple[dict[str, Series], Held]:
    """Return the series of a group, and in which rows its instrument measured."""
    # most logs are in order, and a long one is not copied for nothing
    if np.any(time[1:] < time[:-1]):
        order = np.argsort(time, kind="stable")
        time, values = time[order], values[order]
    if np.any(time[1:] == time[:-1]):
        first = np.concatenate(([True], time[1:] > time[:-1]))
        time, values = time[first], values[first]
    held = find_held(time, values)
    if held.rows_per_value > 1:
        notes.append(
            f"{' and '.join(group)}: each measurement is in {held.rows_per_value} rows"
            f"{'' if source == ROW else f' of {source}'}; "
            f"kept {held.time_utc_ns.size} of {time.size} rows, at their instants of measurement"
        )
    result = {}
    for k, name in enumerate(group):
        value = values[held.rows, k] if held.rows_per_value > 1 else np.ascontiguousarray(values[:, k])
        if CHANNELS[name].wrap == "circle":
            value = np.unwrap(value)
        result[name] = Series(held.time_utc_ns, value)
    return result, held


def _add_from_the_bow(series: dict[str, Series], sources: dict[str, str], notes: list[str]) -> None:
    """Turn body-fixed velocities by the heading into speed and course over ground where the log has only these."""
    ahead, across, heading = (series.get(n) for n in ("velocity_forward", "velocity_starboard", "heading"))
    if ahead is None or across is None or heading is None or "course_over_ground" in series:
        return
    time = ahead.time_utc_ns
    beside, bow = across.at(time, gap_limit_s(across)), heading.at(time, gap_limit_s(heading))
    known = np.isfinite(beside) & np.isfinite(bow)
    if not known.any():
        return
    time, forward, beside, bow = time[known], ahead.value[known], beside[known], bow[known]
    series["speed_over_ground"] = Series(time, np.hypot(forward, beside))
    series["course_over_ground"] = Series(time, bow + np.unwrap(np.arctan2(beside, forward)))
    for name in ("speed_over_ground", "course_over_ground"):
        sources[name] = sources["velocity_forward"]
    notes.append("speed and course over ground computed from the body-fixed velocities and the heading")


def _add_speed_and_course(series: dict[str, Series], sources: dict[str, str], notes: list[str]) -> None:
    """Turn earth-fixed velocities into speed and course over ground where the log has only these."""
    north, east = series.get("velocity_north"), series.get("velocity_east")
    if north is None or east is None or "course_over_ground" in series:
        return
    # two topics need not have their values at the same instants
    across = east.at(north.time_utc_ns, gap_limit_s(east))
    both = np.isfinite(across)
    time, ahead, across = north.time_utc_ns[both], north.value[both], across[both]
    series["speed_over_ground"] = Series(time, np.hypot(ahead, across))
    series["course_over_ground"] = Series(time, np.unwrap(np.arctan2(across, ahead)))
    for name in ("speed_over_ground", "course_over_ground"):
        sources[name] = sources["velocity_north"]
    notes.append("speed and course over ground computed from the earth-fixed velocities")
