"""Nomoto's constants of the linear ship, eq. (16), with standard errors and intervals.

The transfer function from rudder to yaw rate at a stated speed V is

    r(s) / delta(s) = K (1 + T3 s) / ((1 + T1 s) (1 + T2 s)),        T = T1 + T2 - T3.

References: Nomoto, Taguchi, Honda and Hirano (1957), "On the steering qualities of ships", International Shipbuilding
Progress 4; Clarke, Gedling and Hine (1983), "The application of manoeuvring criteria in hull design using linear
theory", Transactions RINA 125.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, sqrt

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.steering.delta_method import gradient, quotient
from kempf.schemas.errors import DataRejected, UsageError

#: standard errors between the denominator of a constant and zero, below which its error is far from normal
_SAFE = 4.0


@dataclass(frozen=True)
class Constant:
    """A number that follows from the parameters."""

    name: str
    #: value, std: ``std`` by the delta method; NaN where the parameters have no covariance.
    value: float
    std: float
    unit: str
    #: 95 % interval of Fieller for a quotient of uncertain numbers; None where the data leave it unbounded, or there is
    #: no covariance.
    interval_95: tuple[float, float] | None


@dataclass(frozen=True)
class Nomoto:
    """Nomoto's constants at one speed."""

    speed_m_s: float
    #: One of {"real", "complex"}. Whether the two poles are real. Where they are complex T1 and T2 do not exist.
    poles: str
    #: ``K`` 1/s, ``T3``, ``T`` s; with real poles ``T1``, ``T2`` s (T1 belongs to the slower pole and is negative for a
    #: ship that is unstable on a straight course); with complex ones ``natural_frequency`` rad/s and ``damping``; with
    #: a length also ``K'`` = K L/V and ``T'`` = T V/L.
    constants: dict[str, Constant]
    warnings: tuple[str, ...]


def require_numbers(hull: Hull, speed_m_s: float) -> None:
    """Do nothing where a speed and six parameters can be worked with.

    Raises
    ------
    UsageError
        The speed is not positive.
    DataRejected
        A parameter is not a number.
    """
    if not (isfinite(speed_m_s) and speed_m_s > 0.0):
        raise UsageError(
            "speed_not_positive",
            f"The speed is {speed_m_s:g} m/s, expected more than 0: a ship at rest has no steering constants.",
            "Give the speed through the water in m/s for which they are wanted.",
        )
    if not np.all(np.isfinite(hull.array())):
        raise DataRejected(
            "no_hull_parameters",
            "The parameter set holds no six finite hull parameters; the estimate failed.",
            "Take another parameter set, such as a converged one by maximum likelihood.",
        )


def nomoto(hull: Hull, covariance: Float, speed_m_s: float, length_m: float | None = None) -> Nomoto:
    """Return Nomoto's constants with standard errors.

    Parameters
    ----------
    covariance : ndarray, shape (6, 6)
        Of the six parameters in the order of `Hull`; NaN where unknown.
    speed_m_s : float
        V, taken as known.
    length_m : float, optional
        For the nondimensional K' and T'.

    Raises
    ------
    UsageError, DataRejected
        See `require_numbers`.

    Examples
    --------
    >>> from kempf.pipeline.model.ship import mariner_like
    >>> steering = nomoto(mariner_like(160.93), np.zeros((6, 6)), 7.7, 160.93)
    >>> steering.poles, round(steering.constants["K'"].value, 2), round(steering.constants["T'"].value, 2)
    ('real', 3.84, 4.86)
    """
    require_numbers(hull, speed_m_s)
    p, V = hull.array(), speed_m_s
    a11, a12, a21, a22, _, b2 = p
    determinant, turning = a11 * a22 - a12 * a21, a21 * hull.b1 - a11 * b2
    apart = (a11 + a22) ** 2 - 4.0 * determinant
    poles = "real" if apart > 0.0 else "complex"
    if determinant == 0.0 or turning == 0.0:
        raise DataRejected(
            "no_nomoto_model",
            "a11 a22 - a12 a21 or a21 b1 - a11 b2 is exactly zero, expected another number: K or T3 is infinite.",
            "Take a parameter set from a manoeuvre that moved the ship.",
        )
    names = ["K", "T3", "T", *(("T1", "T2") if poles == "real" else ("natural_frequency", "damping"))]
    scales = {"K": ("K'", "1/s", (length_m or 0.0) / V), "T": ("T'", "s", V / (length_m or 1.0))}
    constants: dict[str, Constant] = {}
    for name in names:
        value, std, interval = quotient(lambda q, name=name: _quotients(q, V, name), p, covariance)  # type: ignore[misc]
        constants[name] = Constant(name, value, std, _UNITS[name], interval)
        if length_m is not None and name in scales:
            symbol, _, factor = scales[name]
            scaled = None if interval is None else (factor * interval[0], factor * interval[1])
            constants[symbol] = Constant(symbol, factor * value, factor * std, "1", scaled)
    order = [n for n in ("K", "T1", "T2", "T3", "T", "natural_frequency", "damping", "K'", "T'") if n in constants]
    warnings = _warnings(p, covariance, determinant, turning, apart)
    return Nomoto(V, poles, {name: constants[name] for name in order}, warnings)


#: (a11 + a22)^2 - 4 (a11 a22 - a12 a21) = p' Q p
_DISCRIMINANT = np.zeros((6, 6))
_DISCRIMINANT[:4, :4] = [[1, 0, 0, -1], [0, 0, 2, 0], [0, 2, 0, 0], [-1, 0, 0, 1]]

_UNITS = {"K": "1/s", "T1": "s", "T2": "s", "T3": "s", "T": "s", "natural_frequency": "rad/s", "damping": "1"}


def _quotients(p: Float, V: float, name: str) -> tuple[Float, Float]:
    """Return numerator and denominator of a constant; p may be complex."""
    a11, a12, a21, a22, b1, b2 = p
    trace, determinant, turning = a11 + a22, a11 * a22 - a12 * a21, a21 * b1 - a11 * b2
    one = 1.0 + 0.0 * trace
    if name == "K":
        return V * turning, determinant
    if name == "T3":
        return b2, V * turning
    if name == "T":
        return -(trace * turning + b2 * determinant), V * turning * determinant
    if name in ("T1", "T2"):
        apart = np.sqrt(trace**2 - 4.0 * determinant)
        return -2.0 * one, V * (trace + (apart if name == "T1" else -apart))
    if name == "natural_frequency":
        return V * np.sqrt(determinant), one
    return -trace, 2.0 * np.sqrt(determinant)


def _warnings(p: Float, covariance: Float, determinant: float, turning: float, apart: float) -> tuple[str, ...]:
    warnings = []
    if determinant < 0.0:
        warnings.append(
            "unstable on a straight course: K and T1 are negative and no steady turn belongs to a small rudder"
        )
    if turning * p[5] <= 0.0 or p[5] <= 0.0:
        warnings.append("the signs are not those of a ship with a stern rudder: K and T3 should be read with care")
    if not np.all(np.isfinite(covariance)):
        return (*warnings, "the parameters have no covariance: no standard errors")
    slopes = gradient(
        lambda q: np.array(
            [
                q[0] * q[3] - q[1] * q[2],
                q[2] * q[4] - q[0] * q[5],
                (q[0] + q[3]) ** 2 - 4.0 * (q[0] * q[3] - q[1] * q[2]),
            ]
        ),
        p,
    )
    std = np.sqrt(np.diag(slopes @ covariance @ slopes.T))
    for name, value, error in (("K, T1 and T", determinant, std[0]), ("T3 and T", turning, std[1])):
        if abs(value) < _SAFE * error:
            warnings.append(
                f"{name} divide by a number only {abs(value) / error:.1f} standard errors from zero: "
                "read the interval, not the standard error"
            )
    # the discriminant is a quadratic form; its error is that of the second order, which counts where poles are near
    twice = _DISCRIMINANT @ covariance
    error = float(np.sqrt(std[2] ** 2 + 2.0 * np.trace(twice @ twice)))
    if abs(apart) < 2.0 * error:
        warnings.append(
            f"the two poles cannot be separated (their discriminant lies {abs(apart) / error:.1f} standard errors "
            "from zero, at least 2 are expected): T1 and T2 one by one, or that they exist, cannot be determined"
        )
    return tuple(warnings)


def largest_rate_per_s(hull: Hull, speed_m_s: float) -> float:
    """Return the modulus of the faster pole of eq. (16), 1/s."""
    return float(np.max(np.abs(np.linalg.eigvals(hull.continuous(speed_m_s)[0]))))


def turning_frequency_rad_s(hull: Hull, speed_m_s: float) -> float:
    """Return V sqrt(|b2|), the frequency at which a rudder equal to the heading error would swing her undamped."""
    return speed_m_s * sqrt(abs(hull.b2))
