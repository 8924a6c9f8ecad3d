"""An NMEA 0183 log: one sentence a line behind the UTC stamp of its arrival, a share of the lines damaged."""

from __future__ import annotations

import gzip
from collections.abc import Callable, Iterable
from functools import reduce
from operator import xor

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.simulate.instruments import InstrumentRecord
from kempf.pipeline.simulate.random_streams import stream
from kempf.pipeline.simulate.trial import Trial
from kempf.schemas.units import MILLISECOND_NS, factor_to_si

Nanoseconds = NDArray[np.int64]

_CENTISECOND_NS = 10_000_000


def checksum(body: str) -> str:
    """Return the two hexadecimal digits that follow the asterisk.

    Parameters
    ----------
    body : str
        What stands between ``$`` and ``*``.

    Examples
    --------
    >>> checksum("HEHDT,11.37,T")
    '2B'
    """
    return f"{reduce(xor, body.encode('ascii'), 0):02X}"


def to_nmea(trial: Trial, damaged_share: float = 0.002) -> bytes:
    """Return the trial as gzipped, stamped NMEA 0183.

    Parameters
    ----------
    trial : Trial
        See `kempf.pipeline.simulate.trial`. A rudder order has no sentence here and is left out.
    damaged_share : float
        Probability of a line to be damaged: a changed digit, a cut end, or foreign bytes in the middle.

    Returns
    -------
    bytes
        Lines end with CR LF, sorted by arrival.
    """
    sentences: list[str] = []
    arrivals: list[Nanoseconds] = []
    for record in trial.instruments:
        for bodies in _TALKERS.get(record.instrument.name, _silent)(record):
            sentences += [f"${body}*{checksum(body)}" for body in bodies]
            arrivals.append(record.arrival_utc_ns)
    if not arrivals:
        return gzip.compress(b"", mtime=0)
    arrival = np.concatenate(arrivals)
    order = np.argsort(arrival, kind="stable")
    stamps = np.datetime_as_string((arrival[order] // MILLISECOND_NS).astype("datetime64[ms]"), unit="ms")
    lines = [f"{stamp}Z {sentences[k]}".encode("ascii") for stamp, k in zip(stamps, order, strict=True)]
    random = stream(trial.settings.seed, "damage")
    for k in np.flatnonzero(random.random(len(lines)) < damaged_share):
        lines[k] = damage(lines[k], random)
    return gzip.compress(b"\r\n".join([*lines, b""]), compresslevel=6, mtime=0)


def damage(line: bytes, random: np.random.Generator) -> bytes:
    """Return a stamped sentence with one fault that its checksum reveals."""
    start, star = line.index(b"$") + 1, line.index(b"*")
    fault = int(random.integers(3))
    digits = [k for k in range(start, star) if line[k : k + 1].isdigit()]
    if fault == 0 and digits:
        place = digits[int(random.integers(len(digits)))]
        digit = (line[place] - ord("0") + int(random.integers(1, 10))) % 10
        return line[:place] + str(digit).encode() + line[place + 1 :]
    if fault == 1:
        place = int(random.integers(start + 5, star))
        return line[:place] + b"\x00\xc3\xbf" + line[place:]
    return line[: int(random.integers(start + 5, len(line)))]


Bodies = Iterable[list[str]]


def _silent(record: InstrumentRecord) -> Bodies:  # a measurement without a sentence
    return []


def _in(record: InstrumentRecord, column: str, unit: str, si_unit: str) -> list[float]:
    return list((record.values[column] / factor_to_si(unit, si_unit, column)).tolist())


def _fixed(value: float, decimals: int, wrap: float | None = None) -> str:
    text = f"{value:.{decimals}f}"
    if wrap is not None and float(text) >= wrap:  # 359.996 must not become 360.00
        text = f"{0.0:.{decimals}f}"
    return text


def _degrees_minutes(degrees: float, width: int, positive: str, negative: str) -> str:
    # whole units of 1e-5 minute first: 59.999999 minutes must not become 60.00000
    units = round(abs(degrees) * 60.0 * 100_000)
    whole, rest = divmod(units, 6_000_000)
    return f"{whole:0{width}d}{rest // 100_000:02d}.{rest % 100_000:05d},{positive if degrees >= 0 else negative}"


def _gnss(record: InstrumentRecord) -> Bodies:
    centiseconds = (record.measured_utc_ns + _CENTISECOND_NS // 2) // _CENTISECOND_NS
    stamps = np.datetime_as_string((centiseconds * 10).astype("datetime64[ms]"), unit="ms")
    latitude, longitude = (_in(record, c, "deg", "rad") for c in ("latitude_rad", "longitude_rad"))
    course = _in(record, "course_over_ground_rad", "deg", "rad")
    knots = _in(record, "speed_over_ground_m_s", "kn", "m/s")
    kmh = _in(record, "speed_over_ground_m_s", "km/h", "m/s")
    rmc, vtg = [], []
    for stamp, lat, lon, cog, kn, km in zip(stamps, latitude, longitude, course, knots, kmh, strict=True):
        day, clock = f"{stamp[8:10]}{stamp[5:7]}{stamp[2:4]}", f"{stamp[11:13]}{stamp[14:16]}{stamp[17:22]}"
        place = f"{_degrees_minutes(lat, 2, 'N', 'S')},{_degrees_minutes(lon, 3, 'E', 'W')}"
        direction = _fixed(cog, 2, 360.0)
        rmc.append(f"GPRMC,{clock},A,{place},{kn:.2f},{direction},{day},,,A")
        vtg.append(f"GPVTG,{direction},T,,M,{kn:.2f},N,{km:.2f},K,A")
    return [rmc, vtg]


def _heading(record: InstrumentRecord) -> Bodies:
    return [[f"HEHDT,{_fixed(x, 2, 360.0)},T" for x in _in(record, "heading_rad", "deg", "rad")]]


def _yaw_rate(record: InstrumentRecord) -> Bodies:
    return [[f"TIROT,{x:.1f},A" for x in _in(record, "yaw_rate_rad_s", "deg/min", "rad/s")]]


def _rudder(record: InstrumentRecord) -> Bodies:
    return [[f"AGRSA,{x:.1f},A,," for x in _in(record, "rudder_angle_rad", "deg", "rad")]]


def _log(record: InstrumentRecord) -> Bodies:
    knots, kmh = (_in(record, "speed_through_water_m_s", unit, "m/s") for unit in ("kn", "km/h"))
    return [[f"VDVHW,,T,,M,{kn:.2f},N,{km:.2f},K" for kn, km in zip(knots, kmh, strict=True)]]


def _wind(record: InstrumentRecord) -> Bodies:
    angle, speed = _in(record, "wind_angle_rad", "deg", "rad"), _in(record, "wind_speed_m_s", "m/s", "m/s")
    return [[f"WIMWV,{_fixed(a, 1, 360.0)},R,{s:.1f},M,A" for a, s in zip(angle, speed, strict=True)]]


def _shaft(record: InstrumentRecord) -> Bodies:
    return [[f"ERRPM,S,1,{x:.1f},,A" for x in _in(record, "shaft_speed_per_s", "rpm", "1/s")]]


def _depth(record: InstrumentRecord) -> Bodies:
    return [[f"SDDPT,{x:.1f},0.0" for x in _in(record, "water_depth_m", "m", "m")]]


def _roll(record: InstrumentRecord) -> Bodies:
    return [[f"YXXDR,A,{x:.2f},D,ROLL" for x in _in(record, "roll_rad", "deg", "rad")]]


_TALKERS: dict[str, Callable[[InstrumentRecord], Bodies]] = {
    "gnss": _gnss,
    "heading": _heading,
    "yaw_rate": _yaw_rate,
    "rudder": _rudder,
    "log": _log,
    "wind": _wind,
    "shaft": _shaft,
    "depth": _depth,
    "roll": _roll,
}
