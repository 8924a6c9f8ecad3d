"""The effects of the catalogue as the hidden cases have them: equation, unit, sign, and how strong.

v lateral speed, r yaw rate, V speed through the water, d rudder of the log, U and g relative wind speed and the angle
it comes from, n shaft speed, h depth, T draught, L length, phi roll, V0 and n0 of the straight course. A force effect
is scaled so that its rms over the zigzags of its own day, sailed without it, is 5, 12 or 30 % of what the rudder does
to sway or to yaw, whichever share is greater. References: Abkowitz (1964), Norrbin (1971), Blanke (1981), Yasukawa &
Yoshimura (2015), Blendermann (1994), Fossen (2021), Cummins (1962).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from benchmarks.hidden_effects import plant
from pipeline.simulate.hulls import Hull

Float = NDArray[np.float64]

Kind = Literal["catalogue", "outsider", "none"]

#: Shares of the rudder's work, by strength.
SHARES = (0.05, 0.12, 0.30)
STRENGTHS = ("small", "medium", "large")


@dataclass(frozen=True)
class HiddenEffect:
    """What is done to a ship, or to an instrument of hers.

    Attributes
    ----------
    name, equation : str
        Key, and what is added to eq. (16) or to the measurement.
    unit : str
        Of its parameter c.
    slots : tuple of (int, float, str)
        Slots of theta, what each gets of c, and what that is multiplied by.
    sign : int
        +1 or -1 where physics has one sign, 0 where a case draws it.
    sizes : tuple of float
        c by strength; empty where the shares of the rudder's work decide.
    scale : str
        What ``sizes`` are multiplied by, one of `scales`.
    fixed : tuple of (int, float, str)
        Further slots that the effect needs, their value and its scale.
    sensor : bool
        An effect of an instrument: it leaves the motion alone.
    most : float
        c is never greater than this.
    """

    name: str
    equation: str
    unit: str
    slots: tuple[tuple[int, float, str], ...] = ()
    sign: int = 1
    sizes: tuple[float, ...] = ()
    scale: str = "1"
    fixed: tuple[tuple[int, float, str], ...] = ()
    sensor: bool = False
    most: float = float("inf")


def scales(hull: Hull) -> dict[str, float]:
    """Return what sizes and slots may be multiplied by for a hull, by the text that stands for it."""
    L, V, n, p = hull.length_m, hull.trial_speed_m_s, hull.shaft_speed_per_s, hull.parameters
    plain = {"1": 1.0, "L": L, "1/L": 1.0 / L, "V": V, "L/V": L / V, "V/L": V / L}
    return plain | {
        "rate": hull.rudder_rate_rad_s,
        "b1 V^2/n^2": p.b1 * (V / n) ** 2,
        "b2 V^2/n^2": p.b2 * (V / n) ** 2,
    }


def theta(effect: HiddenEffect | None, c: float, hull: Hull) -> Float:
    """Return the strengths that the kernels of `benchmarks.hidden_effects.plant` take, shape (43,).

    Parameters
    ----------
    effect : HiddenEffect or None
        None: all zero, eq. (16).
    c : float
        Its parameter.
    hull : Hull
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


def only(slot: int) -> tuple[tuple[int, float, str], ...]:
    """Return the slots of an effect whose c goes into one of them as it is."""
    return ((slot, 1.0, "1"),)


def _deg(*values: float) -> tuple[float, ...]:
    return tuple(radians(v) for v in values)


_HULL = (
    HiddenEffect(
        "cross_flow_drag",
        "v' -= c (1/L) int |v+xr|(v+xr) dx,  r' -= c (12/L^2) (1/L) int x|v+xr|(v+xr) dx,  x from -L/2 to L/2",
        "1/m",
        only(plant.CROSS_FLOW),
    ),
    HiddenEffect("sway_quadratic", "v' += c v|v|", "1/m", only(plant.SWAY_QUAD), -1),
    HiddenEffect("yaw_quadratic", "r' += c r|r|", "1", only(plant.YAW_QUAD), -1),
    HiddenEffect("sway_abs_v_r", "v' += c |v| r", "1", only(plant.ABSV_R)),
    HiddenEffect("yaw_abs_r_v", "r' += c |r| v", "1/m", only(plant.ABSR_V)),
    HiddenEffect("sway_cubic", "v' += c v^3 / V", "1/m", only(plant.SWAY_CUBIC), -1),
    HiddenEffect("yaw_v2r", "r' += c v^2 r / V", "1/m", only(plant.V2R), -1),
    HiddenEffect("yaw_vr2", "r' += c v r^2 / V", "1", only(plant.VR2)),
    HiddenEffect("yaw_cubic", "r' += c r^3 / V", "m", only(plant.YAW_CUBIC), -1),
)
_RUDDER = (
    HiddenEffect("rudder_stall", "the hull feels d (1 - c d^2)", "1/rad^2", only(plant.STALL)),
    HiddenEffect("flow_straightening", "the hull feels d (1 + c (v/V)^2)", "1", only(plant.STRAIGHTEN), 0),
    HiddenEffect(
        "rudder_lag",
        "the hull feels x with x' = (d - x) / c",
        "s",
        only(plant.LAG),
        sizes=(0.06, 0.12, 0.25),
        scale="L/V",
    ),
    HiddenEffect(
        "rudder_dead_time",
        "the hull feels d(t - c)",
        "s",
        only(plant.DEAD_TIME),
        sizes=(0.05, 0.10, 0.20),
        scale="L/V",
    ),
    HiddenEffect(
        "rudder_backlash",
        "the hull feels the play operator of d of total width c: x stays until |d - x| = c/2",
        "rad",
        only(plant.BACKLASH),
        sizes=_deg(1.0, 2.0, 4.0),
    ),
    HiddenEffect(
        "rudder_rate_limit",
        "the hull feels x that follows d at c at most",
        "rad/s",
        only(plant.RATE_LIMIT),
        sizes=(0.6, 0.4, 0.2),
        scale="rate",
    ),
    HiddenEffect("neutral_angle", "the hull feels d + c", "rad", only(plant.NEUTRAL), 0, sizes=_deg(1.0, 2.0, 4.0)),
    HiddenEffect("rudder_asymmetry", "the hull feels d (1 - c) where d < 0", "1", only(plant.ASYMMETRY), 0, most=0.6),
    HiddenEffect(
        "propeller_wash",
        "rudder force b V^2 d (1 + c ((n V0 / (n0 V))^2 - 1))",
        "1",
        only(plant.WASH),
        sizes=(0.2, 0.4, 0.8),
    ),
    HiddenEffect(
        "propeller_walk",
        "v' += b1 q n^2,  r' += b2 q n^2;  c = q n0^2 / V0^2 is the rudder angle it amounts to at V0, n0",
        "rad",
        ((plant.WALK_Y, 1.0, "b1 V^2/n^2"), (plant.WALK_N, 1.0, "b2 V^2/n^2")),
        0,
        sizes=_deg(1.0, 2.0, 4.0),
    ),
    HiddenEffect(
        "speed_exponent",
        "rudder force b V^2 (V/V0)^c d, the power of V is 2 + c",
        "1",
        only(plant.EXPONENT),
        -1,
        sizes=(0.3, 0.6, 1.0),
    ),
)
_AROUND = (
    HiddenEffect(
        "wind_relative",
        "v' += c U^2 sin g,  r' += -(2/L) c U^2 sin 2g; wind from starboard pushes to port",
        "1/m",
        ((plant.WIND_Y, 1.0, "1"), (plant.WIND_N, -2.0, "1/L")),
        -1,
    ),
    HiddenEffect(
        "waves",
        "measured heading, yaw rate and lateral speed contain a narrow-band motion of damping 0.07 at the frequency of "
        "encounter of a wave of length L; c is the rms of the yaw angle, c L/4 that of the sway displacement",
        "rad",
        ((plant.WAVE_PSI, 1.0, "1"), (plant.WAVE_Y, 0.25, "L")),
        sizes=_deg(0.05, 0.15, 0.4),
    ),
    HiddenEffect("shallow_water", "hull terms (a11, a12, a21, a22) times 1 + c (T/h)^2", "1", only(plant.SHALLOW)),
)
_SENSORS = (
    HiddenEffect(
        "antenna_lever",
        "GNSS antenna c forward of where the profile has it",
        "m",
        sign=0,
        sizes=(0.05, 0.12, 0.3),
        scale="L",
        sensor=True,
    ),
    HiddenEffect(
        "heading_misalignment",
        "the compass shows psi + c",
        "rad",
        sign=0,
        sizes=_deg(0.5, 1.0, 2.0),
        sensor=True,
    ),
    HiddenEffect("gyro_bias", "the rate gyro shows r + c", "rad/s", sign=0, sizes=_deg(0.02, 0.05, 0.15), sensor=True),
    HiddenEffect("gyro_scale", "the rate gyro shows (1 + c) r", "1", sign=0, sizes=(0.02, 0.05, 0.12), sensor=True),
    HiddenEffect(
        "gnss_latency",
        "GNSS velocity and position are those of c earlier than their stamp",
        "s",
        sizes=(0.02, 0.05, 0.12),
        scale="L/V",
        sensor=True,
    ),
    HiddenEffect("log_scale", "the log shows (1 + c) V", "1", sign=0, sizes=(0.03, 0.07, 0.15), sensor=True),
)
_OTHER = (
    HiddenEffect("roll_coupling", "r' += c phi", "1/s^2", only(plant.ROLL)),
    HiddenEffect("load_condition", "b2 (1 + c) on the second day, b2 on the first", "1", only(plant.LOAD), 0, most=0.4),
    HiddenEffect(
        "slow_memory",
        "r' += c V m with m' = (r - m) / tau, tau = 3 L/V0",
        "1/m",
        only(plant.MEMORY),
        -1,
        fixed=((plant.MEMORY_S, 3.0, "L/V"),),
    ),
)

#: By name; the current of the earth and the speed of the log belong to the model and are no effects here.
CATALOGUE: dict[str, HiddenEffect] = {e.name: e for e in (*_HULL, *_RUDDER, *_AROUND, *_SENSORS, *_OTHER)}
