"""The faults that a channel can have, each with the change to the readings that corrects it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import pi
from typing import Literal

import numpy as np

from kempf.pipeline.channels.doctor.log import VELOCITIES, Log
from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.schemas.units import SECOND_NS

Kind = Literal["sign", "unit", "scale", "frame", "axes", "swap", "offset", "latency", "clock_scale", "stuck", "leap"]

#: What a log may hold under the name of the canonical unit: the factor on the reading that corrects it, by name.
UNITS: dict[str, dict[str, float]] = {
    "rad": {"rad taken for deg": 180.0 / pi, "deg taken for rad": pi / 180.0},
    "rad/s": {
        "deg/s taken for deg/min": 60.0,
        "deg/min taken for deg/s": 1.0 / 60.0,
        "rad/s taken for deg/s": 180.0 / pi,
        "deg/s taken for rad/s": pi / 180.0,
        "rad/s taken for deg/min": 60.0 * 180.0 / pi,
        "deg/min taken for rad/s": pi / 180.0 / 60.0,
    },
    "m/s": {
        "kn taken for m/s": 1852.0 / 3600.0,
        "m/s taken for kn": 3600.0 / 1852.0,
        "km/h taken for m/s": 1.0 / 3.6,
        "m/s taken for km/h": 3.6,
        "km/h taken for kn": 1000.0 / 1852.0,
        "kn taken for km/h": 1852.0 / 1000.0,
    },
}


#: Pairs of units that are seldom taken for each other.
_SELDOM = ("km/h taken for kn", "kn taken for km/h")


@dataclass(frozen=True)
class Fault:
    """One fault of one instrument."""

    #: One of {"sign", "unit", "scale", "frame", "axes", "swap", "offset", "latency", "clock_scale", "stuck", "leap"}.
    kind: Kind
    #: That share the fault.
    channels: tuple[str, ...]
    #: What is done about it: the factor for a unit or a scale, the angle that is added (rad) for an offset, the seconds
    #: that are taken off for a latency, the rate (s/s) at which the clock runs too fast for a clock scale, the seconds
    #: for which a channel is stuck, the angle (rad) by which it leaps.
    value: float = 1.0
    #: Which fault of the kind, such as ``kn taken for m/s``.
    name: str = ""
    #: Standard error of ``value`` where it was estimated; 0 where it is exact.
    std: float = 0.0
    #: What ``std`` is, in words, where it is no standard error.
    spread: str = "1 s.e."
    #: Smaller is asked first: a wrong sign before a compass turned by 90 degrees and counting backwards.
    simplicity: int = 1
    #: When a channel that is stuck begins to be, or leaps, UTC ns.
    start_utc_ns: int = 0

    @property
    def key(self) -> tuple[str, tuple[str, ...], str]:
        """What distinguishes two faults; estimates of one are one."""
        return self.kind, self.channels, self.name

    def corrected(self, log: Log) -> Log:
        """Return the log without this fault."""
        own = {name: log.series[name] for name in self.channels if name in log.series}
        if len(own) < len(self.channels):
            return log
        corrected = log.with_series(_CORRECTIONS[self.kind](self, own))
        if self.kind not in ("unit", "scale"):
            return corrected
        # what was refused was refused in the wrong unit
        return replace(corrected, refused={n: many for n, many in log.refused.items() if n not in self.channels})


#: The course follows the bow as she drifts in a turn: in its place it looks like a compass that is late.
BOW_AND_COURSE = Fault("swap", ("heading", "course_over_ground"), simplicity=2)
#: What one inertial unit gives in axes north, east and down is mirrored where it is taken for east, north and up, and
#: the other way round: its heading and yaw rate agree, and so does its velocity.
AXES = tuple(
    Fault("axes", channels, pi / 2, simplicity=3)
    for channels in (("heading", "yaw_rate"), ("heading", "yaw_rate", *VELOCITIES["earth"]))
)


def unit_faults(channels: tuple[str, ...], dimension: str) -> Iterator[Fault]:
    """Yield the wrong units that channels may be in, by the canonical unit of their dimension."""
    for name, factor in UNITS[dimension].items():
        yield Fault("unit", channels, factor, name, simplicity=2 if name in _SELDOM else 1)


def _each(own: Mapping[str, Series], change: Mapping[str, Float]) -> dict[str, Series | None]:
    return {name: Series(own[name].time_utc_ns, value) for name, value in change.items()}


def _sign(fault: Fault, own: Mapping[str, Series]) -> dict[str, Series | None]:
    return _each(own, {name: -series.value for name, series in own.items()})


def _unit(fault: Fault, own: Mapping[str, Series]) -> dict[str, Series | None]:
    circle = ("heading", "course_over_ground")
    scaled = {name: series.value * fault.value for name, series in own.items()}
    return _each(own, {name: np.unwrap(value) if name in circle else value for name, value in scaled.items()})


def _offset(fault: Fault, own: Mapping[str, Series]) -> dict[str, Series | None]:
    # "counts from east" turns the sense of rotation too: psi = 90 deg - what is read
    turn = -1.0 if fault.name.startswith("counted anticlockwise") else 1.0
    return _each(own, {name: turn * series.value + fault.value for name, series in own.items()})


def _swap(fault: Fault, own: Mapping[str, Series]) -> dict[str, Series | None]:
    first, second = fault.channels
    return {first: own[second], second: own[first]}


def _frame(fault: Fault, own: Mapping[str, Series]) -> dict[str, Series | None]:
    kind = next(kind for kind, names in VELOCITIES.items() if names == fault.channels)
    other = VELOCITIES["body" if kind == "earth" else "earth"]
    moved: dict[str, Series | None] = dict.fromkeys(fault.channels)
    return moved | {new: own[old] for old, new in zip(fault.channels, other, strict=True)}


def _axes(fault: Fault, own: Mapping[str, Series]) -> dict[str, Series | None]:
    turned = _offset(replace(fault, name="counted anticlockwise"), {"heading": own["heading"]})
    turned |= _each(own, {"yaw_rate": -own["yaw_rate"].value})
    north, east = VELOCITIES["earth"]
    return turned | ({north: own[east], east: own[north]} if east in own else {})


def _moved(series: Series, time: Nanoseconds) -> Series:
    # a clock that is set right never runs backwards, but two readings may fall on one nanosecond
    rising = np.concatenate([[True], np.diff(time) > 0])
    return Series(time[rising], series.value[rising])


def _latency(fault: Fault, own: Mapping[str, Series]) -> dict[str, Series | None]:
    return {name: _moved(series, series.time_utc_ns - round(fault.value * SECOND_NS)) for name, series in own.items()}


def _clock_scale(fault: Fault, own: Mapping[str, Series]) -> dict[str, Series | None]:
    corrected: dict[str, Series | None] = {}
    for name, series in own.items():
        since = (series.time_utc_ns - series.time_utc_ns[0]).astype(np.float64)
        corrected[name] = _moved(series, series.time_utc_ns[0] + np.rint(since / (1.0 + fault.value)).astype(np.int64))
    return corrected


def _stuck(fault: Fault, own: Mapping[str, Series]) -> dict[str, Series | None]:
    (name,) = fault.channels
    time, end = own[name].time_utc_ns, fault.start_utc_ns + round(fault.value * SECOND_NS)
    kept = (time < fault.start_utc_ns) | (time > end)
    return {name: Series(time[kept], own[name].value[kept]) if np.count_nonzero(kept) > 1 else None}


def _leap(fault: Fault, own: Mapping[str, Series]) -> dict[str, Series | None]:
    (name,) = fault.channels
    behind = own[name].time_utc_ns >= fault.start_utc_ns
    return _each(own, {name: own[name].value - np.where(behind, fault.value, 0.0)})


_CORRECTIONS = {
    "sign": _sign,
    "unit": _unit,
    "scale": _unit,
    "offset": _offset,
    "swap": _swap,
    "frame": _frame,
    "axes": _axes,
    "latency": _latency,
    "clock_scale": _clock_scale,
    "stuck": _stuck,
    "leap": _leap,
}
