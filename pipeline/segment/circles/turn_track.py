"""The track of a ship through a turn, from what was logged: positions, else speed and course, else the water log.

What was measured is laid on common instants; the figures are read off in `turning_figures`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.lateral_speed import noise_std
from kempf.pipeline.channels.positions import EARTH_M, plane
from kempf.pipeline.channels.series import Float, Series, wrapped
from kempf.schemas.units import SECOND_NS

Source = Literal["positions", "speed and course over ground", "speed through the water and heading", "heading alone"]

#: No ship under way drifts more, rad: course or heading is wrong there.
_LARGEST_DRIFT_RAD = float(np.pi / 3)

#: Longest pause of a channel that is bridged, as a share of the time for a change of heading by 90 deg.
_BRIDGED = 0.25


@dataclass(frozen=True, eq=False)
class TurnTrack:
    """A track on common instants."""

    #: Shape (n,). Seconds on the clock of the manoeuvre.
    time_s: Float
    #: north_m, east_m: Shape (n,). Position relative to the first instant, m.
    north_m: Float
    east_m: Float
    #: Shape (n,). Unwrapped heading, rad.
    heading_rad: Float
    #: Shape (n,). Speed along the track, m/s; NaN, as the positions, where there is the heading alone.
    speed_m_s: Float
    #: Shape (n,). Heading minus course, rad; NaN where the log has neither course nor positions.
    drift_rad: Float
    #: Shape (n,). Speed of the water log, m/s; NaN where there is none.
    log_m_s: Float
    #: What it was made of.
    source: Source
    #: Standard error of a distance between two positions, m; NaN where it is integrated.
    distance_std_m: float
    #: Share of instants whose drift angle was impossible and is bridged.
    bridged_share: float

    def without(self, north_m_s: float, east_m_s: float) -> TurnTrack:
        """Return the track relative to a uniform stream towards north and east, m/s."""
        course = self.heading_rad - self.drift_rad
        north = self.speed_m_s * np.cos(course) - north_m_s
        east = self.speed_m_s * np.sin(course) - east_m_s
        since = self.time_s - self.time_s[0]
        return replace(
            self,
            north_m=self.north_m - north_m_s * since,
            east_m=self.east_m - east_m_s * since,
            speed_m_s=np.hypot(north, east),
            drift_rad=wrapped(self.heading_rad - np.arctan2(east, north)),
        )


def track_of(instruments: Instruments, origin_ns: int, start_s: float, end_s: float, quarter_s: float) -> TurnTrack:
    """Make the track of a turn.

    Parameters
    ----------
    instruments : Instruments
        Series of the log; the heading is among them.
    origin_ns : int
        UTC nanoseconds of second 0.
    start_s, end_s : float
        From when to when, s.
    quarter_s : float
        Time for a change of heading by 90 deg, s: the ship's own time.

    Returns
    -------
    TurnTrack
        Of the heading alone where no position and no speed is recorded throughout.

    Raises
    ------
    ValueError
        There is no heading.
    """
    cut = {
        name: series.between(_ns(origin_ns, start_s - quarter_s), _ns(origin_ns, end_s + quarter_s))
        for name in (
            "heading",
            "latitude",
            "longitude",
            "speed_over_ground",
            "course_over_ground",
            "speed_through_water",
        )
        if (series := instruments.get(name)) is not None
    }
    cut = {name: series for name, series in cut.items() if len(series) >= 5}
    periods = [cut[name].period_s for name in cut]
    if "heading" not in cut:
        raise ValueError("a track needs the heading, and the log has none there")
    step_s = max(min(periods), quarter_s / 500)
    time_s = np.arange(start_s, end_s + step_s / 2, step_s)
    stamps = origin_ns + np.round(time_s * SECOND_NS).astype(np.int64)
    columns = {name: series.at(stamps, _BRIDGED * quarter_s) for name, series in cut.items()}
    for source, names in (
        ("positions", ("latitude", "longitude")),
        ("speed and course over ground", ("speed_over_ground", "course_over_ground")),
        ("speed through the water and heading", ("speed_through_water",)),
    ):
        if not all(name in columns for name in names):
            continue
        there = np.isfinite(columns["heading"])
        for name in names:
            there &= np.isfinite(columns[name])
        # the ends may lie between two samples of a slower channel
        inside = np.flatnonzero(there)
        if inside.size < 5 or inside[-1] - inside[0] + 1 != inside.size:
            continue
        if time_s[inside[0]] > start_s + _BRIDGED * quarter_s or time_s[inside[-1]] < end_s - _BRIDGED * quarter_s:
            continue
        rows = slice(int(inside[0]), int(inside[-1]) + 1)
        return _made(source, time_s[rows], {k: v[rows] for k, v in columns.items()}, cut, quarter_s)  # type: ignore[arg-type]
    there = np.isfinite(columns["heading"])
    time_s, heading = time_s[there], columns["heading"][there]
    nothing = np.full(time_s.size, np.nan)
    return TurnTrack(time_s, nothing, nothing, heading, nothing, nothing, nothing, "heading alone", float("nan"), 0.0)


def _ns(origin_ns: int, second: float) -> int:
    return origin_ns + round(second * SECOND_NS)


def _made(
    source: Source, time_s: Float, columns: dict[str, Float], cut: dict[str, Series], quarter_s: float
) -> TurnTrack:
    heading = columns["heading"]
    speed, course = columns.get("speed_over_ground"), columns.get("course_over_ground")
    distance_std = float("nan")
    known = speed is not None and course is not None and bool(np.all(np.isfinite(speed) & np.isfinite(course)))
    if source == "positions":
        north, east = plane(columns["latitude"], columns["longitude"])
        distance_std = float(np.sqrt(2.0)) * max(
            noise_std(cut["latitude"]), noise_std(cut["longitude"]) * np.cos(float(columns["latitude"][0]))
        )
        distance_std *= EARTH_M
        if not known:
            north_m_s, east_m_s = (_slope(time_s, column, quarter_s) for column in (north, east))
            speed, course = np.hypot(north_m_s, east_m_s), np.arctan2(east_m_s, north_m_s)
    elif source == "speed through the water and heading":
        speed, course = columns["speed_through_water"], None
    assert speed is not None
    drift, bridged = np.full(time_s.size, np.nan), 0.0
    if course is not None:
        drift = wrapped(heading - course)
        wrong = np.abs(drift) > _LARGEST_DRIFT_RAD
        bridged = float(np.mean(wrong))
        if 0.0 < bridged < 1.0:
            drift = np.interp(time_s, time_s[~wrong], drift[~wrong])
    if source != "positions":
        along = heading - (drift if course is not None else 0.0)
        north, east = (_integral(time_s, speed * turned) for turned in (np.cos(along), np.sin(along)))
    log = columns.get("speed_through_water", np.full(time_s.size, np.nan))
    return TurnTrack(time_s, north, east, heading, speed, drift, log, source, distance_std, bridged)


def _integral(time_s: Float, rate: Float) -> Float:
    return np.concatenate([[0.0], np.cumsum(np.diff(time_s) * (rate[1:] + rate[:-1]) / 2.0)])


def _slope(time_s: Float, values: Float, quarter_s: float) -> Float:
    """Return the derivative over a tenth of the ship's time, so that the noise of positions does not become speed."""
    half = max(round(0.05 * quarter_s / (time_s[1] - time_s[0])), 1)
    at = np.arange(time_s.size)
    before, after = np.maximum(at - half, 0), np.minimum(at + half, time_s.size - 1)
    return np.asarray((values[after] - values[before]) / (time_s[after] - time_s[before]), dtype=np.float64)
