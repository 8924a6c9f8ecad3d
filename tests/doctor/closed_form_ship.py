"""A ship in closed form: her heading is given, everything else follows from it by kinematics and Nomoto's equation."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np

from kempf.pipeline.channels.doctor.log import EARTH_M, Log
from kempf.pipeline.channels.series import Float, Series
from kempf.schemas.profile import ChannelMap, Source, TimeColumn, VesselProfile
from kempf.schemas.units import SECOND_NS

START_NS = 1_746_252_000_000_000_000
STEP_S, LONG_S = 0.5, 1200.0
TIME_CONSTANT_S, GAIN_PER_S, DRIFT_S = 20.0, 0.1, 6.0
STREAM = 0.4 - 0.2j
LENGTH_M = 80.0


@cache
def truth() -> dict[str, Float]:
    """Channels in SI on the common grid, without noise."""
    t = np.arange(0.0, LONG_S, STEP_S)
    legs = sum(a / (1.0 + np.exp(-(t - at) / 12.0)) for a, at in ((1.2, 300.0), (-2.0, 600.0), (1.6, 900.0)))
    psi = 0.7 + legs + 0.35 * np.sin(2 * np.pi * t / 110.0) + 0.1 * np.sin(2 * np.pi * t / 37.0 + 1.0)
    r = np.gradient(psi, t)
    rudder = (TIME_CONSTANT_S * np.gradient(r, t) + r) / GAIN_PER_S
    water = 6.0 - 20.0 * np.abs(r)
    velocity = water * np.exp(1j * (psi - DRIFT_S * r)) + STREAM
    place = np.concatenate([[0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * STEP_S)])
    latitude = 0.9 + place.real / EARTH_M
    return {
        "heading": psi,
        "yaw_rate": r,
        "rudder_angle": rudder,
        "rudder_order": np.interp(t + 2.0, t, rudder),
        "speed_over_ground": np.abs(velocity),
        "course_over_ground": np.unwrap(np.angle(velocity)),
        "latitude": latitude,
        "longitude": 0.3 + place.imag / EARTH_M / np.cos(0.9),
        "speed_through_water": water,
    }


NOISE = {
    "heading": 1e-3, "yaw_rate": 3e-4, "rudder_angle": 2e-3, "rudder_order": 0.0, "speed_over_ground": 0.05,
    "course_over_ground": 8e-3, "latitude": 0.5 / EARTH_M, "longitude": 0.5 / EARTH_M, "speed_through_water": 0.05,
}  # fmt: skip


def channels(*names: str) -> dict[str, Float]:
    """Some channels with noise, all by default."""
    random = np.random.Generator(np.random.PCG64(5))
    noisy = {name: value + NOISE[name] * random.standard_normal(value.size) for name, value in truth().items()}
    return {name: noisy[name] for name in names or noisy}


def time_ns() -> np.ndarray:
    return START_NS + np.arange(truth()["heading"].size) * round(STEP_S * SECOND_NS)


def log(*names: str, length_m: float | None = LENGTH_M) -> Log:
    return Log({name: Series(time_ns(), value) for name, value in channels(*names).items()}, length_m)


#: How the log below is written: the column of each channel, its unit, and the factor from SI.
COLUMNS = {
    "heading": ("hdg", "deg", 180 / np.pi), "yaw_rate": ("rot", "deg/min", 60 * 180 / np.pi),
    "rudder_angle": ("rudder", "deg", 180 / np.pi), "rudder_order": ("order", "deg", 180 / np.pi),
    "speed_over_ground": ("sog", "m/s", 1.0), "course_over_ground": ("cog", "deg", 180 / np.pi),
    "latitude": ("lat", "deg", 180 / np.pi), "longitude": ("lon", "deg", 180 / np.pi),
    "speed_through_water": ("stw", "m/s", 1.0), "velocity_north": ("vn", "m/s", 1.0),
    "velocity_east": ("ve", "m/s", 1.0),
}  # fmt: skip


def text(values: Mapping[str, Float]) -> bytes:
    """Delimited text of some channels; an angle on the circle within 0 and 360."""
    columns = []
    for name, value in values.items():
        turned = np.mod(value, 2 * np.pi) if name in ("heading", "course_over_ground") else value
        columns.append(turned * COLUMNS[name][2])
    head = ",".join(["t", *(COLUMNS[name][0] for name in values)])
    seconds = np.arange(len(columns[0])) * STEP_S
    rows = (",".join(f"{cell:.8f}" for cell in row) for row in np.column_stack([seconds, *columns]))
    return "\n".join([head, *rows, ""]).encode()


def profile(*names: str, **spoilt: dict[str, object]) -> VesselProfile:
    """The profile of that text; ``rot={"unit": "deg/s"}`` spoils the entry of a column."""
    entries = {
        COLUMNS[name][0]: ChannelMap(channel=name, unit=COLUMNS[name][1]).model_copy(
            update=spoilt.get(COLUMNS[name][0], {})
        )
        for name in names or truth()
    }
    time = TimeColumn(column="t", unit="s", start="2025-05-03T06:00:00Z")  # type: ignore[arg-type]
    return VesselProfile(vessel="made", length_m=LENGTH_M, sources=[Source(match="*.csv", time=time, channels=entries)])
