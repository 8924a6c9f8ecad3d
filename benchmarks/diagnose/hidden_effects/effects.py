"""The effects of the catalogue as the hidden cases have them: equation, unit, sign, and how strong.

v lateral speed, r yaw rate, V speed through the water, d rudder of the log, U and g relative wind speed and the angle
it comes from, n shaft speed, h depth, T draught, L length, phi roll, W = V0 n/n0 the speed on a straight course. A
force effect is scaled so that its rms over the zigzags of her own two days, sailed without it, is 5, 12 or 30 % of what
the rudder does to sway or to yaw, whichever share is greater. References: Abkowitz (1964), Norrbin (1971), Blanke
(1981), Yasukawa & Yoshimura (2015), Blendermann (1994), Fossen (2021), Cummins (1962).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, radians
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from benchmarks.diagnose.hidden_effects import plant
from kempf.pipeline.simulate.hulls import SimulatedHull

Float = NDArray[np.float64]
Kind = Literal["catalogue", "outsider", "none"]
Slot = tuple[int, float, str]

#: Shares of the rudder's work, by strength.
SHARES = (0.05, 0.12, 0.30)


@dataclass(frozen=True)
class HiddenEffect:
    """What is done to a ship, or to an instrument of hers."""

    #: name, equation: Key, and what is added to eq. (16) or to the measurement.
    name: str
    equation: str
    #: Of its parameter.
    unit: str
    #: Slots of theta, what each gets of the parameter, and what that is multiplied by, one of `scales`.
    slots: tuple[Slot, ...] = ()
    #: +1 or -1 where physics has one sign or the other would throw her off, 0 where a case draws it.
    sign: int = 1
    #: Parameter by strength; empty where the shares of the rudder's work decide.
    sizes: tuple[float, ...] = ()
    #: What ``sizes`` are multiplied by, one of `scales`.
    scale: str = "1"
    #: Further slots that the effect needs, their value and its scale.
    fixed: tuple[Slot, ...] = ()
    #: The parameter is never greater than this.
    most: float = inf
    #: Its name.
    parameter: str = "c"
    #: Power of the rudder's angle in the unit of the parameter: what a log whose rudder is off shows of it.
    of_rudder: int = 0
    #: Further parameters that are multiples of it.
    also: tuple[tuple[str, float], ...] = ()

    @property
    def sensor(self) -> bool:
        """Whether it sits in an instrument and leaves the motion alone."""
        return not self.slots

    def parameters(self, c: float) -> dict[str, float]:
        """Return all its parameters by name, from the first."""
        return {self.parameter: c} | {name: factor * c for name, factor in self.also}


def scales(hull: SimulatedHull) -> dict[str, float]:
    """Return what sizes and slots may be multiplied by for a hull, by the text that stands for it."""
    L, V, n = hull.length_m, hull.trial_speed_m_s, hull.shaft_speed_per_s
    found = {"1": 1.0, "L": L, "1/L": 1.0 / L, "1/L^2": 1.0 / L**2, "V": V, "L/V": L / V, "V/L": V / L}
    return found | {
        "1/rate": 1.0 / hull.rudder_rate_rad_s,
        "V^2/(n^2 L)": (V / n) ** 2 / L,
        "V^2/(n^2 L^2)": (V / n / L) ** 2,
    }


def theta(effect: HiddenEffect | None, c: float, hull: SimulatedHull) -> Float:
    """Return the strengths that the kernels of `benchmarks.diagnose.hidden_effects.plant` take, shape (N_THETA,).

    Parameters
    ----------
    effect : HiddenEffect or None
        None: all zero, eq. (16).
    c : float
        Its parameter.
    """
    found = np.zeros(plant.N_THETA)
    if effect is None:
        return found
    by = scales(hull)
    for slot, factor, scale in effect.slots:
        found[slot] = c * factor * by[scale]
    for slot, value, scale in effect.fixed:
        found[slot] = value * by[scale]
    return found


def only(slot: int, factor: float = 1.0, scale: str = "1") -> tuple[Slot, ...]:
    """Return the slots of an effect whose parameter goes into one of them."""
    return ((slot, factor, scale),)


def _deg(*values: float) -> tuple[float, ...]:
    return tuple(radians(v) for v in values)


_HULL = (
    HiddenEffect(
        "cross_flow_drag",
        "v' -= (c/L) mean(|u| u),  r' -= (16 c/L^3) mean(x |u| u),  u = v + x r, means over -L/2 < x < L/2",
        "1",
        only(plant.CROSS_FLOW, 1.0, "1/L"),
    ),
    HiddenEffect(
        "cross_flow_cubic",
        "v' -= (c/L) mean(u^3) / V,  r' -= (16 c/L^3) mean(x u^3) / V,  u = v + x r, means over -L/2 < x < L/2",
        "1",
        only(plant.CROSS_FLOW_CUBIC, 1.0, "1/L"),
    ),
    HiddenEffect("sway_quadratic", "v' -= c v|v| / L", "1", only(plant.SWAY_QUAD, -1.0, "1/L")),
    HiddenEffect("yaw_quadratic", "r' -= c r|r|", "1", only(plant.YAW_QUAD, -1.0)),
    HiddenEffect("sway_abs_r_v", "v' -= c |r| v", "1", only(plant.SWAY_ABS_R, -1.0)),
    HiddenEffect("sway_abs_v_r", "v' += c |v| r", "1", only(plant.SWAY_ABS_V)),
    HiddenEffect("yaw_abs_r_v", "r' += c |r| v / L", "1", only(plant.YAW_ABS_R, 1.0, "1/L")),
    HiddenEffect("yaw_abs_v_r", "r' -= c |v| r / L", "1", only(plant.YAW_ABS_V, -1.0, "1/L")),
    HiddenEffect("sway_cubic", "v' -= c v^3 / (V L)", "1", only(plant.SWAY_CUBIC, -1.0, "1/L")),
    HiddenEffect("sway_v2r", "v' += c v^2 r / V", "1", only(plant.SWAY_V2R)),
    HiddenEffect("sway_vr2", "v' -= c v r^2 L / V", "1", only(plant.SWAY_VR2, -1.0, "L")),
    HiddenEffect("yaw_cubic", "r' -= c r^3 L / V", "1", only(plant.YAW_CUBIC, -1.0, "L")),
    HiddenEffect("yaw_v2r", "r' -= c v^2 r / (V L)", "1", only(plant.YAW_V2R, -1.0, "1/L")),
    HiddenEffect("yaw_vr2", "r' += c v r^2 / V", "1", only(plant.YAW_VR2)),
    HiddenEffect("yaw_v3", "r' += c v^3 / (V L^2)", "1", only(plant.YAW_V3, 1.0, "1/L^2")),
)
_RUDDER = (
    HiddenEffect("rudder_stall", "the hull feels d - c d^3", "1/rad^2", only(plant.STALL), most=1.9, of_rudder=-2),
    HiddenEffect("flow_straightening", "the hull feels d + c d (v/V)^2", "1", only(plant.STRAIGHTEN), 0, most=12.0),
    HiddenEffect(
        "rudder_lag",
        "the hull feels x with tau x' = d - x",
        "s",
        only(plant.LAG),
        sizes=(0.06, 0.12, 0.25),
        scale="L/V",
        parameter="tau",
    ),
    HiddenEffect(
        "dead_time",
        "the hull feels d(t - tau)",
        "s",
        only(plant.DEAD_TIME),
        sizes=(0.05, 0.10, 0.20),
        scale="L/V",
        parameter="tau",
    ),
    HiddenEffect(
        "backlash",
        "the hull feels the play operator of d of total width c: x stays until |d - x| = c/2",
        "rad",
        only(plant.BACKLASH),
        sizes=_deg(1.0, 2.0, 4.0),
        of_rudder=1,
    ),
    HiddenEffect(
        "rate_limit",
        "the hull feels x that follows d at 1/c at most: 60, 40, 20 % of the logged rudder's rate",
        "s/rad",
        only(plant.RATE_LIMIT),
        sizes=(1.0 / 0.6, 1.0 / 0.4, 1.0 / 0.2),
        scale="1/rate",
        of_rudder=-1,
    ),
    HiddenEffect(
        "neutral_angle",
        "the hull feels d + c",
        "rad",
        only(plant.NEUTRAL),
        0,
        sizes=_deg(1.0, 2.0, 4.0),
        of_rudder=1,
    ),
    HiddenEffect("rudder_asymmetry", "the hull feels d + c |d|", "1", only(plant.ASYMMETRY), 0),
    HiddenEffect(
        "propeller_wash",
        "rudder force b d ((1 - c) V^2 + c W^2)",
        "1",
        only(plant.WASH),
        sizes=(0.2, 0.4, 0.8),
    ),
    HiddenEffect(
        "propeller_walk",
        "v' += c W^2 / L,  r' -= 8 c W^2 / L^2",
        "1",
        ((plant.WALK_Y, 1.0, "V^2/(n^2 L)"), (plant.WALK_N, -8.0, "V^2/(n^2 L^2)")),
        0,
        sizes=(0.003, 0.006, 0.012),
    ),
    HiddenEffect(
        "speed_exponent",
        "rudder force b V^2 (W/V)^c d, the power of V is 2 - c",
        "1",
        only(plant.EXPONENT),
        sizes=(0.3, 0.6, 1.0),
    ),
)
_AROUND = (
    HiddenEffect(
        "wind_force",
        "v' -= c U^2 sin g / L,  r' -= k U^2 sin 2g / L^2,  k = 1.5 c",
        "1",
        ((plant.WIND_Y, -1.0, "1/L"), (plant.WIND_N, -1.5, "1/L^2")),
        also=(("k", 1.5),),
    ),
    HiddenEffect(
        "waves",
        "heading, yaw rate and lateral speed contain a narrow-band motion of damping 0.1 at the frequency of encounter "
        "of a wave of length L; c is the rms of the yaw angle, c L/16 that of the sway displacement",
        "rad",
        ((plant.WAVE_PSI, 1.0, "1"), (plant.WAVE_Y, 1.0 / 16.0, "L")),
        sizes=_deg(0.05, 0.15, 0.4),
    ),
    HiddenEffect("shallow_water", "a11, a21, a22 times 1 + c (T/h)^2", "1", only(plant.SHALLOW), most=9.0),
)
_SENSORS = (
    HiddenEffect(
        "antenna_lever",
        "GNSS antenna x forward of where the profile has it",
        "m",
        sign=0,
        sizes=(0.05, 0.12, 0.3),
        scale="L",
        parameter="x",
    ),
    HiddenEffect("heading_misalignment", "the compass shows psi + c", "rad", sign=0, sizes=_deg(0.5, 1.0, 2.0)),
    HiddenEffect("gyro_bias", "the rate gyro shows r + c", "rad/s", sign=0, sizes=_deg(0.02, 0.05, 0.15)),
    HiddenEffect("gyro_scale", "the rate gyro shows (1 + c) r", "1", sign=0, sizes=(0.02, 0.05, 0.12)),
    HiddenEffect("log_scale", "the log shows V / (1 + c)", "1", sign=0, sizes=(0.03, 0.07, 0.15)),
    *(
        HiddenEffect(
            name,
            f"the {what} is that of tau before its stamp",
            "s",
            sizes=(0.02, 0.05, 0.12),
            scale="L/V",
            parameter="tau",
        )
        for name, what in (
            ("gnss_latency", "velocity and position of the GNSS"),
            ("heading_latency", "heading of the compass"),
            ("gyro_latency", "yaw rate of the gyro"),
        )
    ),
)
_OTHER = (
    HiddenEffect("roll_coupling", "r' -= c V^2 phi / L^2", "1", only(plant.ROLL, -1.0, "1/L^2"), -1, most=9.0),
    HiddenEffect(
        "load_condition",
        "a11, a21, a22, b1, b2 times 1 + c on the second day",
        "1",
        only(plant.LOAD),
        0,
        most=0.28,
    ),
    HiddenEffect(
        "memory",
        "v' -= c V (v - m) / L with m' = V (v - m) / (3 L)",
        "1",
        only(plant.MEMORY, -1.0, "1/L"),
        most=4.5,
    ),
)

#: By name; the current of the earth and the speed of the log belong to the model and are no effects here.
CATALOGUE: dict[str, HiddenEffect] = {e.name: e for e in (*_HULL, *_RUDDER, *_AROUND, *_SENSORS, *_OTHER)}
