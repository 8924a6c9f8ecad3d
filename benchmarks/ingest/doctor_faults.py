"""Faults put into sound logs, each as a change to the channels and the truth that is to be found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.doctor.faults import Fault
from kempf.pipeline.channels.doctor.log import Log
from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.series import Series
from kempf.schemas.channels import CHANNELS
from kempf.schemas.units import SECOND_NS

_FASTEST = 0.015
_CIRCLE = ("heading", "course_over_ground")
_GNSS = ("latitude", "longitude", "speed_over_ground", "course_over_ground")


@dataclass(frozen=True)
class Stated:
    """A fault: the log that has it, the kind of fault and the channels that should be named."""

    log: Log
    kind: str
    channels: tuple[str, ...]
    size: float = 0.0


PutIn = Callable[[Log, np.random.Generator], Stated]

#: What a log must have for a fault to be put into it, beside the channels of every log here.
NEEDS = {"rudder order, zero at 25 to 45 deg": "rudder_order"}


def _changed(log: Log, name: str, change: Callable[[np.ndarray], np.ndarray]) -> Log:
    one = log.series[name]
    value = np.mod(one.value, 2 * np.pi) if name in _CIRCLE else one.value
    value = change(value)
    channel = CHANNELS[name]
    keep = (value >= channel.low) & (value <= channel.high) if name not in _CIRCLE else np.abs(value) <= 4 * np.pi
    value = np.unwrap(value[keep]) if name in _CIRCLE else value[keep]
    return log.with_series({name: Series(one.time_utc_ns[keep], value)})


def _shifted(log: Log, names: tuple[str, ...], change: Callable[[np.ndarray], np.ndarray]) -> Log:
    moved = {}
    for name in names:
        one = log.series[name]
        first = int(one.time_utc_ns[0])
        since = np.rint(change(one.seconds_since(first)) * SECOND_NS).astype(np.int64)
        moved[name] = Series(first + since, one.value)
    return log.with_series(moved)


def with_velocities(log: Log) -> Log:
    """The same log with earth-fixed velocities in place of speed and course."""
    velocity = log.velocity("course")
    assert velocity is not None
    time = velocity.time_utc_ns
    return log.with_series(
        {
            "speed_over_ground": None,
            "course_over_ground": None,
            "velocity_north": Series(time, velocity.value.real),
            "velocity_east": Series(time, velocity.value.imag),
        }
    )


def with_body_velocities(log: Log) -> Log:
    """The same log with body-fixed velocities in place of speed and course."""
    velocity, heading = log.velocity("course"), log.series["heading"]
    assert velocity is not None
    bow = heading.at(velocity.time_utc_ns, gap_limit_s(heading))
    known = np.isfinite(bow)
    time, value = velocity.time_utc_ns[known], velocity.value[known] * np.exp(-1j * bow[known])
    return log.with_series(
        {
            "speed_over_ground": None,
            "course_over_ground": None,
            "velocity_forward": Series(time, value.real),
            "velocity_starboard": Series(time, value.imag),
        }
    )


def _sign(name: str) -> PutIn:
    return lambda log, _: Stated(_changed(log, name, np.negative), "sign", (name,))


def _times(name: str, factor: float) -> PutIn:
    return lambda log, _: Stated(_changed(log, name, lambda v: v * factor), "unit", (name,), factor)


def _turned(name: str) -> PutIn:
    def fault(log: Log, random: np.random.Generator) -> Stated:
        angle = float(np.deg2rad(random.uniform(20.0, 160.0)) * random.choice([-1.0, 1.0]))
        return Stated(_changed(log, name, lambda v: v + angle), "offset", (name,), angle)

    return fault


def _anticlockwise(log: Log, _: np.random.Generator) -> Stated:
    return Stated(_changed(log, "heading", lambda v: np.pi / 2 - v), "offset", ("heading",))


def _swapped(first: str, second: str, prepare: Callable[[Log], Log] = lambda log: log) -> PutIn:
    def fault(log: Log, _: np.random.Generator) -> Stated:
        log = prepare(log)
        return Stated(log.with_series({first: log.series[second], second: log.series[first]}), "swap", (first, second))

    return fault


def _frame(prepare: Callable[[Log], Log], log: Log) -> Stated:
    log = prepare(log)
    earth = ("velocity_north", "velocity_east")
    channels = earth if "velocity_north" in log.series else ("velocity_forward", "velocity_starboard")
    faulty = Fault("frame", channels).corrected(log)
    other = ("velocity_forward", "velocity_starboard") if channels == earth else earth
    return Stated(faulty, "frame", other)


def _body_to_port(log: Log, _: np.random.Generator) -> Stated:
    log = with_body_velocities(log)
    return Stated(_changed(log, "velocity_starboard", np.negative), "sign", ("velocity_starboard",))


def _other_axes(log: Log, *names: str) -> Stated:
    mirrored = Fault("axes", ("heading", "yaw_rate", *names), np.pi / 2)
    return Stated(mirrored.corrected(log), "axes", mirrored.channels)


def _late(*names: str) -> PutIn:
    def fault(log: Log, random: np.random.Generator) -> Stated:
        late = float(random.uniform(3.0, 12.0))
        return Stated(_shifted(log, names, lambda t: t + late), "latency", names, late)

    return fault


def _fast(*names: str) -> PutIn:
    def fault(log: Log, random: np.random.Generator) -> Stated:
        one = log.series[names[0]]
        span = float(one.time_utc_ns[-1] - one.time_utc_ns[0]) / SECOND_NS
        # no clock that ran at all is out by more than a hundredth or two
        rate = min(float(random.uniform(5.0, 20.0)) / span, _FASTEST) * float(random.choice([-1.0, 1.0]))
        return Stated(_shifted(log, names, lambda t: t * (1.0 + rate)), "clock_scale", names, rate)

    return fault


def _zero_elsewhere(log: Log, random: np.random.Generator) -> Stated:
    angle = float(np.deg2rad(random.uniform(25.0, 45.0)))
    return Stated(_changed(log, "rudder_order", lambda v: v + angle), "offset", ("rudder_order",), angle)


#: Every fault by name, in the order of the page.
FAULTS: dict[str, PutIn] = {
    "yaw rate, sign": _sign("yaw_rate"),
    "yaw rate, deg/s as deg/min": _times("yaw_rate", 1.0 / 60.0),
    "yaw rate, rad/s as deg/s": _times("yaw_rate", np.pi / 180.0),
    "heading, anticlockwise from east": _anticlockwise,
    "heading, turned by 20 to 160 deg": _turned("heading"),
    "course, turned by 20 to 160 deg": _turned("course_over_ground"),
    "rudder, positive to port": _sign("rudder_angle"),
    "rudder, rad as deg": _times("rudder_angle", np.pi / 180.0),
    "rudder order, zero at 25 to 45 deg": _zero_elsewhere,
    "speed over ground, kn as m/s": _times("speed_over_ground", 3600.0 / 1852.0),
    "speed through water, kn as m/s": _times("speed_through_water", 3600.0 / 1852.0),
    "speed through water, km/h as m/s": _times("speed_through_water", 3.6),
    "latitude and longitude swapped": _swapped("latitude", "longitude"),
    "longitude, west positive": _sign("longitude"),
    "velocities north and east swapped": _swapped("velocity_north", "velocity_east", with_velocities),
    "earth-fixed velocities as body-fixed": lambda log, _: _frame(with_velocities, log),
    "body-fixed velocities as earth-fixed": lambda log, _: _frame(with_body_velocities, log),
    "body-fixed velocity, positive to port": _body_to_port,
    "heading and yaw rate, down for up": lambda log, _: _other_axes(log),
    "these and the velocity, down for up": lambda log, _: _other_axes(
        with_velocities(log), "velocity_north", "velocity_east"
    ),
    "yaw rate, 3 to 12 s late": _late("yaw_rate"),
    "heading, 3 to 12 s late": _late("heading"),
    "heading, clock gains or loses 5 to 20 s": _fast("heading"),
    "yaw rate, clock gains or loses 5 to 20 s": _fast("yaw_rate"),
    "heading and course swapped": _swapped("heading", "course_over_ground"),
}
