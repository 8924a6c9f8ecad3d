"""What the doctor looks at: the channels of one log, as delivered, and the motions that they show."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.doctor.robust_regression import quantile
from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.schemas.units import SECOND_NS

Complex = NDArray[np.complex128]

#: Pairs of channels that give the velocity over ground: by speed and course, earth-fixed, body-fixed.
VELOCITIES: dict[str, tuple[str, str]] = {
    "course": ("speed_over_ground", "course_over_ground"),
    "earth": ("velocity_north", "velocity_east"),
    "body": ("velocity_forward", "velocity_starboard"),
    "track": ("latitude", "longitude"),
}
#: A ship slower than this share of her fast speed makes no way worth a course.
_UNDER_WAY = 0.4
#: No GNSS gives a course below this speed, m/s.
SLOWEST_M_S = 0.2
#: Fixes that show a motion; how many times their noise the way between two of them is; the finest noise that is
#: believed, m; 90th percentile of a second difference of places with unit noise north and east,
#: sqrt(6) sqrt(2 ln 10).
_FEWEST_FIXES, _CLEAR, _FINEST_M, _BEND = 20, 15.0, 0.1, 5.257
#: Turn within the time of one mean beyond which the mean is blurred, rad.
_BLURRED = 0.3
#: Mean radius of the earth, m (IUGG); a distance from it is right within half a per cent.
EARTH_M = 6_371_008.8


@dataclass(frozen=True, eq=False)
class Velocity:
    """A velocity at its instants."""

    #: What gives it.
    channels: tuple[str, str]
    #: Shape (n,).
    time_utc_ns: Nanoseconds
    #: Shape (n,). Towards north plus i times towards east (ahead plus i times to starboard for a body-fixed one), m/s.
    value: Complex
    #: Shape (n,). Its angle, unwrapped, rad.
    direction: Float
    #: Time over which it is a mean, s; 0 for an instrument's own.
    over_s: float = 0.0

    @property
    def under_way(self) -> NDArray[np.bool_]:
        """Where she makes so much way that the direction means something, shape (n,)."""
        speed = np.abs(self.value)
        fast = quantile(speed, 0.98) if speed.size else 0.0
        known: NDArray[np.bool_] = speed > max(_UNDER_WAY * fast, SLOWEST_M_S)
        return known

    def blurred(self, heading: Series) -> bool:
        """Return whether she turns so far within the time of one mean that the means do not show it."""
        return self.over_s > 0.0 and fastest_turn(heading) * self.over_s > _BLURRED


@dataclass(frozen=True, eq=False)
class Log:
    """The channels of one log as the doctor looks at them; a correction makes another log."""

    #: By canonical name; SI, angles on the circle unwrapped.
    series: Mapping[str, Series]
    #: Of the ship, where it is known: how far the course may lag behind the heading in a turn.
    length_m: float | None = None
    #: In a straight run, of the profile.
    trial_speed_m_s: float | None = None
    #: The unit that each channel is said to be written in, where that is known: what it was taken for.
    units: Mapping[str, str] = field(default_factory=dict)
    #: Values of each channel that ingest refused because they lie outside its physical range.
    refused: Mapping[str, int] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        instruments: Instruments,
        length_m: float | None = None,
        trial_speed_m_s: float | None = None,
        units: Mapping[str, str] | None = None,
        refused: Mapping[str, int] | None = None,
    ) -> Log:
        """Return the channels that a log has of its own; what was computed from others confirms nothing."""
        own = {name: series for name, series in instruments.series.items() if name not in instruments.derived}
        return cls(
            {name: series for name, series in own.items() if len(series) > 1},
            length_m,
            trial_speed_m_s,
            units or {},
            refused or {},
        )

    def has(self, names: Iterable[str]) -> bool:
        """Return whether all these channels are there."""
        return all(name in self.series for name in names)

    def with_series(self, changed: Mapping[str, Series | None]) -> Log:
        """Return the log with some channels exchanged; None takes one out."""
        series = {**self.series, **changed}
        return replace(self, series={name: channel for name, channel in series.items() if channel is not None})

    def velocity(self, kind: str) -> Velocity | None:
        """Return a velocity over ground by a key of `VELOCITIES`, None where the log does not have both channels."""
        names = VELOCITIES[kind]
        if not self.has(names):
            return None
        if kind == "track":
            return self._between_fixes()
        first, second = self.series[names[0]], self.series[names[1]]
        leading, other = (second, first) if kind == "course" else (first, second)
        beside = other.at(leading.time_utc_ns, gap_limit_s(other))
        known = np.isfinite(beside)
        time, own, beside = leading.time_utc_ns[known], leading.value[known], beside[known]
        if time.size < 2:
            return None
        if kind == "course":
            return Velocity(names, time, beside * np.exp(1j * own), own)
        value = own + 1j * beside
        return Velocity(names, time, value, np.unwrap(np.angle(value)))

    def velocities(self, *, track: bool = True) -> Iterator[tuple[str, Velocity]]:
        """Yield the velocities that the log has with their keys of `VELOCITIES`, if asked for that of the track too."""
        for kind in VELOCITIES:
            velocity = self.velocity(kind) if track or kind != "track" else None
            if velocity is not None:
                yield kind, velocity

    def between(self, start_ns: int, end_ns: int) -> Log:
        """Return the log with the readings of a time only, UTC ns, both ends included."""
        parts = {name: series.between(start_ns, end_ns) for name, series in self.series.items()}
        return replace(self, series={name: series for name, series in parts.items() if len(series) > 1})

    def thinned(self, most: int) -> Log:
        """Return the log with so many readings of each channel at most, as many left out between any two of them."""
        every = {name: max(len(series) // most, 1) for name, series in self.series.items()}
        thin = {
            n: Series(series.time_utc_ns[:: every[n]], series.value[:: every[n]]) for n, series in self.series.items()
        }
        return replace(self, series=thin)

    def over_ground(self, kind: str) -> Velocity | None:
        """Return a velocity in the earth's frame; a body-fixed one is turned by the heading."""
        velocity = self.velocity(kind)
        if kind != "body" or velocity is None:
            return velocity
        heading = self.series.get("heading")
        if heading is None:
            return None
        bow = heading.at(velocity.time_utc_ns, gap_limit_s(heading))
        known = np.isfinite(bow)
        value = velocity.value[known] * np.exp(1j * bow[known])
        return Velocity(
            velocity.channels,
            velocity.time_utc_ns[known],
            value,
            velocity.direction[known] + bow[known],
            velocity.over_s,
        )

    def _between_fixes(self) -> Velocity | None:
        """Return the velocity of the fixes, over steps so long that their noise does not hide the way."""
        track = self.track()
        if track is None or track[0].size < _FEWEST_FIXES:
            return None
        time, place = track
        seconds = (time - time[0]) / SECOND_NS
        period = float(np.median(np.diff(seconds)))
        noise = fix_noise(place)
        coarse = max(round(30.0 / period), 1)
        gone = np.abs(place[coarse:] - place[:-coarse]) / (seconds[coarse:] - seconds[:-coarse])
        fast = quantile(gone, 0.9) if gone.size else 0.0
        step = int(np.clip(np.ceil(_CLEAR * noise / max(fast, 1e-3) / period), 1, coarse))
        long = seconds[step:] - seconds[:-step]
        near = long < 3.0 * step * period
        value = ((place[step:] - place[:-step]) / long)[near]
        middle = (time[:-step] + (time[step:] - time[:-step]) // 2)[near]
        if value.size < _FEWEST_FIXES:
            return None
        return Velocity(VELOCITIES["track"], middle, value, np.unwrap(np.angle(value)), step * period)

    def track(self) -> tuple[Nanoseconds, Complex] | None:
        """Return the instants and the places of the fixes, north plus i times east of the first one, m."""
        if not self.has(("latitude", "longitude")):
            return None
        latitude, longitude = self.series["latitude"], self.series["longitude"]
        across = longitude.at(latitude.time_utc_ns, gap_limit_s(longitude))
        known = np.isfinite(across)
        if np.count_nonzero(known) < 2:
            return None
        north = latitude.value[known] - latitude.value[known][0]
        east = across[known] - across[known][0]
        shrink = np.cos(np.median(latitude.value[known]))
        return latitude.time_utc_ns[known], EARTH_M * (north + 1j * east * shrink)


def fix_noise(place: Complex) -> float:
    """Return the noise of a fix, m: it shows in the second difference of the places, the way hardly does."""
    if place.size < 3:
        return _FINEST_M
    bend = np.abs(place[2:] - 2.0 * place[1:-1] + place[:-2])
    return max(quantile(bend, 0.9) / _BEND, _FINEST_M, _rounding(place.real), _rounding(place.imag))


def _rounding(place: Float) -> float:
    """Return the error of a coordinate that is rounded so coarsely that it mostly repeats itself, m."""
    step = np.abs(np.diff(place))
    if np.mean(step == 0.0) < 0.5 or not step.any():
        return 0.0
    return float(np.min(step[step > 0.0])) / float(np.sqrt(12.0))


def turning(heading: Series) -> Series:
    """Return how fast a direction changes, rad/s, at the middles between its values one second or more apart."""
    apart = max(round(1.0 / max(heading.period_s, 1e-3)), 1)
    time, value = heading.time_utc_ns, heading.value
    if len(heading) <= apart:
        return Series(time[:0], value[:0])
    step = (time[apart:] - time[:-apart]) / SECOND_NS
    near = step < 3.0 * max(apart * heading.period_s, 1.0)
    middle = time[:-apart] + (time[apart:] - time[:-apart]) // 2
    return Series(middle[near], ((value[apart:] - value[:-apart]) / step)[near])


def fastest_turn(heading: Series) -> float:
    """Return how fast a direction changes when it changes fast, rad/s: the 95th percentile; 0 where it is not known."""
    rate = turning(heading).value
    return quantile(np.abs(rate), 0.95) if rate.size else 0.0


def integral(rate: Series) -> Series:
    """Return the integral of a series by the trapezium rule, at its instants; a gap is bridged by its mean."""
    step = np.diff(rate.time_utc_ns) / SECOND_NS
    gained = rate.value[1:] + rate.value[:-1]
    # in place: of a long log every copy counts
    gained *= 0.5
    gained *= step
    total = np.zeros(gained.size + 1)
    np.cumsum(gained, out=total[1:])
    return Series(rate.time_utc_ns, total)
