"""How a measured manoeuvre began, and what acted from there on, read off its log: speed, turn, shaft and true wind."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.lateral_speed import noise_std
from kempf.pipeline.channels.rounding import rounding_std
from kempf.pipeline.channels.series import Float, Nanoseconds
from kempf.pipeline.manoeuvre.ship import Start
from kempf.schemas.units import SECOND_NS

Complex = NDArray[np.complex128]
#: the beginning is read over this part of the time in which she sails her own length, and over no less than that, s
_PART, _LEAST_S = 0.25, 1.0
#: instants at which what acts from then on is read
_INSTANTS = 400


@dataclass(frozen=True)
class InitialConditions:
    """A beginning; None and 0 where the log does not show it."""

    start: Start
    #: Standard errors of it, of the noise of single readings; None where the log does not show it.
    start_std: Start
    #: Mean shaft speed from the first execute on.
    shaft_per_s: float | None
    #: wind_m_s, wind_from_rad: Mean true wind from the first execute on; from where, clockwise from north.
    wind_m_s: float
    wind_from_rad: float
    #: Shape (k, 3). Its course, as far as the log has it: instant from the execute on, s, and its parts from north and
    #: from east, m/s; without rows where the log hardly has it.
    air: Float = field(default_factory=lambda: np.zeros((0, 3)), repr=False, compare=False)

    def counted_from(self, heading_rad: float) -> InitialConditions:
        """Return it with directions counted from a heading instead of north."""
        north, east = self.air[:, 1], self.air[:, 2]
        ahead = north * np.cos(heading_rad) + east * np.sin(heading_rad)
        beside = east * np.cos(heading_rad) - north * np.sin(heading_rad)
        air = np.column_stack([self.air[:, 0], ahead, beside])
        return replace(self, wind_from_rad=self.wind_from_rad - heading_rad, air=air)


def initial_conditions(
    instruments: Instruments, execute_utc_ns: int, end_utc_ns: int, own_time_s: float
) -> InitialConditions:
    """Read how a manoeuvre began.

    Parameters
    ----------
    instruments : Instruments
        Of its log.
    execute_utc_ns, end_utc_ns : int
        First execute and end.
    own_time_s : float
        In which she sails her own length.
    """
    before = round(max(_PART * own_time_s, _LEAST_S) * SECOND_NS)
    at = np.linspace(execute_utc_ns - before, execute_utc_ns, 21).round().astype(np.int64)
    later = np.linspace(execute_utc_ns, end_utc_ns, _INSTANTS).round().astype(np.int64)
    along_bow, channel = _forward(instruments, at)
    forward, rate = _mean(along_bow), _mean(_read(instruments, "yaw_rate", at))
    wind = _wind(instruments, later)
    known = np.isfinite(wind)
    mean = complex(np.mean(wind[known])) if known.mean() > 0.5 else 0.0 + 0.0j
    since = (later[known] - execute_utc_ns) / SECOND_NS
    air = np.column_stack([since, wind[known].real, wind[known].imag])
    shaft = _mean(_read(instruments, "shaft_speed", later))
    start = Start(forward_m_s=forward, yaw_rate_rad_s=rate)
    std = Start(
        forward_m_s=_std(instruments, channel, before / SECOND_NS),
        yaw_rate_rad_s=_std(instruments, "yaw_rate", before / SECOND_NS),
    )
    return InitialConditions(
        start, std, shaft, abs(mean), float(np.angle(mean)), air if known.mean() > 0.5 else air[:0]
    )


def _std(instruments: Instruments, channel: str, over_s: float) -> float | None:
    """Return the standard error of a mean over some time, None of a channel too short to say."""
    series = instruments.get(channel)
    noise = float("nan") if series is None else noise_std(series)
    if series is None or not np.isfinite(noise):
        return None
    # readings that repeat each other share the error of their rounding
    return float(np.hypot(noise / np.sqrt(max(over_s / series.period_s, 1.0)), rounding_std(series)))


def _mean(course: Float) -> float | None:
    known = np.isfinite(course)
    return float(np.mean(course[known])) if known.mean() > 0.5 else None


def _read(instruments: Instruments, channel: str, at: Nanoseconds) -> Float:
    series = instruments.get(channel)
    if series is None or len(series) < 2:
        return np.full(at.size, np.nan)
    values: Float = series.at(at, gap_limit_s(series))
    return values


def _forward(instruments: Instruments, at: Nanoseconds) -> tuple[Float, str]:
    """Return the speed along the bow, through the water where a log shows that, else over ground, and its channel."""
    water = _read(instruments, "speed_through_water", at)
    if np.isfinite(water).any():
        return water, "speed_through_water"
    away = _read(instruments, "course_over_ground", at) - _read(instruments, "heading", at)
    return _read(instruments, "speed_over_ground", at) * np.cos(away), "speed_over_ground"


def _wind(instruments: Instruments, at: Nanoseconds) -> Complex:
    """Return the true wind, speed and where it comes from as a complex number (north, east), from either anemometer."""
    speed, direction = (_read(instruments, f"true_wind_{name}", at) for name in ("speed", "direction"))
    if np.isfinite(speed * direction).any():
        true: Complex = speed * np.exp(1j * direction)
        return true
    speed, angle = _read(instruments, "wind_speed", at), _read(instruments, "wind_angle", at)
    over_ground = _read(instruments, "speed_over_ground", at)
    way = over_ground * np.exp(1j * _read(instruments, "course_over_ground", at))
    # over the deck comes the true wind and that of her own way, which comes from ahead
    wind: Complex = speed * np.exp(1j * (angle + _read(instruments, "heading", at))) - way
    return wind
