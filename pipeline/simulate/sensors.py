"""How each kind of instrument sees the truth: the measurement equations, eq. (18) among them, and their noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, radians, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.simulate.hulls import SimulatedHull
from kempf.pipeline.simulate.plant import STATE
from kempf.pipeline.simulate.trajectory import Sample

Float = NDArray[np.float64]

_GRAVITY_M_S2 = 9.80665


@dataclass(frozen=True)
class Setting:
    """What a sensor needs to know beside the path.

    Parameters
    ----------
    latitude_deg, longitude_deg : float
        Of the start.
    antenna_forward_m, antenna_starboard_m : float
        GNSS antenna, from midships on the centre line.
    wind_speed_path : ndarray, shape (n,)
        True wind on the fine grid, m/s.
    wind_step_s : float
        Distance of its points.
    wind_from_rad : float
        Where it blows from.
    water_depth_m : float
        Below the transducer.
    """

    latitude_deg: float
    longitude_deg: float
    antenna_forward_m: float
    antenna_starboard_m: float
    wind_speed_path: Float
    wind_step_s: float
    wind_from_rad: float
    water_depth_m: float


Noise = dict[str, float]
Read = Callable[[Sample, SimulatedHull, Setting, Noise, np.random.Generator], dict[str, Float]]


@dataclass(frozen=True)
class Sensor:
    """A kind of instrument: how it reads, and which quantities of it can be noisy."""

    read: Read
    noises: tuple[str, ...]


def _state(sample: Sample, name: str) -> Float:
    return sample.state[:, STATE.index(name)]


def _draw(random: np.random.Generator, noise: Noise, name: str, n: int) -> Float:
    # drawn even where it is scaled to nothing, so that the scale does not shift the other draws
    return noise.get(name, 0.0) * random.standard_normal(n)


def _radii_of_curvature(latitude_rad: float) -> tuple[float, float]:
    """Return the radii of WGS 84 along the meridian and across it, m."""
    a, e2 = 6378137.0, 6.69437999014e-3
    w = 1.0 - e2 * sin(latitude_rad) ** 2
    return a * (1.0 - e2) / (w * sqrt(w)), a / sqrt(w)


def _gnss(
    sample: Sample, hull: SimulatedHull, setting: Setting, noise: Noise, random: np.random.Generator
) -> dict[str, Float]:
    n = sample.time_s.size
    forward, starboard = setting.antenna_forward_m, setting.antenna_starboard_m
    v_north, v_east = sample.ground_velocity(forward, starboard)
    v_north = v_north + _draw(random, noise, "velocity", n)
    v_east = v_east + _draw(random, noise, "velocity", n)
    psi = _state(sample, "psi")
    north = (
        _state(sample, "north") + forward * np.cos(psi) - starboard * np.sin(psi) + _draw(random, noise, "position", n)
    )
    east = (
        _state(sample, "east") + forward * np.sin(psi) + starboard * np.cos(psi) + _draw(random, noise, "position", n)
    )
    # a plane that touches the ellipsoid at the start; over a trial of some miles the difference is centimetres a mile
    latitude = radians(setting.latitude_deg)
    meridian, across = _radii_of_curvature(latitude)
    return {
        "latitude_rad": latitude + north / meridian,
        "longitude_rad": radians(setting.longitude_deg) + east / (across * cos(latitude)),
        "speed_over_ground_m_s": np.hypot(v_north, v_east),
        "course_over_ground_rad": np.arctan2(v_east, v_north) % (2 * pi),
    }


def _heading(
    sample: Sample, hull: SimulatedHull, setting: Setting, noise: Noise, random: np.random.Generator
) -> dict[str, Float]:
    return {"heading_rad": (_state(sample, "psi") + _draw(random, noise, "heading", sample.time_s.size)) % (2 * pi)}


def _yaw_rate(
    sample: Sample, hull: SimulatedHull, setting: Setting, noise: Noise, random: np.random.Generator
) -> dict[str, Float]:
    return {"yaw_rate_rad_s": _state(sample, "r") + _draw(random, noise, "yaw_rate", sample.time_s.size)}


def _rudder(
    sample: Sample, hull: SimulatedHull, setting: Setting, noise: Noise, random: np.random.Generator
) -> dict[str, Float]:
    return {"rudder_angle_rad": sample.rudder + _draw(random, noise, "rudder_angle", sample.time_s.size)}


def _rudder_order(
    sample: Sample, hull: SimulatedHull, setting: Setting, noise: Noise, random: np.random.Generator
) -> dict[str, Float]:
    return {"rudder_order_rad": sample.order.copy()}


def _log(
    sample: Sample, hull: SimulatedHull, setting: Setting, noise: Noise, random: np.random.Generator
) -> dict[str, Float]:
    return {
        "speed_through_water_m_s": _state(sample, "V") + _draw(random, noise, "speed_through_water", sample.time_s.size)
    }


def _wind(
    sample: Sample, hull: SimulatedHull, setting: Setting, noise: Noise, random: np.random.Generator
) -> dict[str, Float]:
    n = sample.time_s.size
    true = np.interp(
        sample.time_s, np.arange(setting.wind_speed_path.size) * setting.wind_step_s, setting.wind_speed_path
    )
    v_north, v_east = sample.ground_velocity()
    # the air's velocity past the ship, turned round: where the wind comes from
    from_north = true * cos(setting.wind_from_rad) + v_north
    from_east = true * sin(setting.wind_from_rad) + v_east
    angle = np.arctan2(from_east, from_north) - _state(sample, "psi") + _draw(random, noise, "wind_angle", n)
    speed = np.hypot(from_north, from_east) + _draw(random, noise, "wind_speed", n)
    return {"wind_speed_m_s": np.abs(speed), "wind_angle_rad": angle % (2 * pi)}


def _shaft(
    sample: Sample, hull: SimulatedHull, setting: Setting, noise: Noise, random: np.random.Generator
) -> dict[str, Float]:
    return {"shaft_speed_per_s": hull.shaft_speed_per_s + _draw(random, noise, "shaft_speed", sample.time_s.size)}


def _depth(
    sample: Sample, hull: SimulatedHull, setting: Setting, noise: Noise, random: np.random.Generator
) -> dict[str, Float]:
    return {"water_depth_m": setting.water_depth_m + _draw(random, noise, "water_depth", sample.time_s.size)}


def _roll(
    sample: Sample, hull: SimulatedHull, setting: Setting, noise: Noise, random: np.random.Generator
) -> dict[str, Float]:
    # outward heel: a turn to starboard heels her to port, which is negative
    lateral_g = _state(sample, "V") * _state(sample, "r") / _GRAVITY_M_S2
    return {"roll_rad": -hull.heel_per_g * lateral_g + _draw(random, noise, "roll", sample.time_s.size)}


#: The kinds of instruments by name.
SENSORS: dict[str, Sensor] = {
    "gnss": Sensor(_gnss, ("velocity", "position")),
    "heading": Sensor(_heading, ("heading",)),
    "yaw_rate": Sensor(_yaw_rate, ("yaw_rate",)),
    "rudder": Sensor(_rudder, ("rudder_angle",)),
    "rudder_order": Sensor(_rudder_order, ()),
    "log": Sensor(_log, ("speed_through_water",)),
    "wind": Sensor(_wind, ("wind_speed", "wind_angle")),
    "shaft": Sensor(_shaft, ("shaft_speed",)),
    "depth": Sensor(_depth, ("water_depth",)),
    "roll": Sensor(_roll, ("roll",)),
}
