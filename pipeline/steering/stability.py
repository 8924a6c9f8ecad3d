"""Whether a ship holds a straight course by herself, and whether the data can tell.

Eq. (16) is stable when the trace of its matrix is negative and its determinant positive: a11 + a22 < 0 and
C = a11 a22 - a12 a21 > 0. References: Abkowitz (1964), "Lectures on ship hydrodynamics: steering and
manoeuvrability", Hydro- and Aerodynamics Laboratory report Hy-5; Clarke, Gedling and Hine (1983), Transactions RINA
125.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.result import Value
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.steering.delta_method import gradient
from kempf.pipeline.steering.nomoto import require_numbers

Verdict = Literal["stable", "unstable", "cannot be determined from these data"]
#: how sure a verdict must be
CONFIDENCE = 0.95
_LOG2_DRAWS = 14
#: standard errors from which a determinant is not near zero
_FAR = 2.0


@dataclass(frozen=True)
class Stability:
    """The straight-line stability of a ship."""

    #: ``stable`` or ``unstable`` where the data say so with 95 %, else ``cannot be determined from these data``.
    verdict: Verdict
    #: Why.
    reason: str
    #: That she is stable, from the covariance of the parameters as a normal distribution; NaN without one.
    probability: float
    #: C = a11 a22 - a12 a21, 1/m^2; its sign is that of the verdict.
    determinant: Value
    #: Real parts of the two eigenvalues at the speed, 1/s, the slower one first.
    real_parts: tuple[Value, Value]
    #: One of {"real", "complex"}.
    poles: str


def stability(hull: Hull, covariance: Float, speed_m_s: float) -> Stability:
    """Judge the straight-line stability.

    Parameters
    ----------
    covariance : ndarray, shape (6, 6)
        NaN where unknown; then there is no verdict.
    speed_m_s : float
        The eigenvalues are proportional to it; the verdict does not depend on it.

    Raises
    ------
    UsageError, DataRejected
        The speed is not positive, or a parameter is not a number.
    """
    require_numbers(hull, speed_m_s)
    p, V = hull.array(), speed_m_s
    apart = (p[0] + p[3]) ** 2 - 4.0 * (p[0] * p[3] - p[1] * p[2])
    poles = "real" if apart > 0.0 else "complex"

    def judged(q: Float) -> Float:
        trace, determinant = q[0] + q[3], q[0] * q[3] - q[1] * q[2]
        root = np.sqrt(trace**2 - 4.0 * determinant) if poles == "real" else 0.0
        return np.array([determinant, 0.5 * V * (trace + root), 0.5 * V * (trace - root)])

    value = np.real(judged(p))
    known = bool(np.all(np.isfinite(covariance)))
    slopes = gradient(judged, p)
    std = np.sqrt(np.maximum(np.diag(slopes @ covariance @ slopes.T), 0.0)) if known else np.full(3, np.nan)
    probability = _probability(p, covariance) if known else float("nan")
    verdict, reason = _verdict(probability, float(value[0]), float(std[0]))
    units = ("1/m^2", "1/s", "1/s")
    names = ("a11 a22 - a12 a21", "slower eigenvalue", "faster eigenvalue")
    values = [Value(n, float(x), float(s), u) for n, x, s, u in zip(names, value, std, units, strict=True)]
    return Stability(verdict, reason, probability, values[0], (values[1], values[2]), poles)


def _verdict(probability: float, determinant: float, std: float) -> tuple[Verdict, str]:
    if np.isnan(probability):
        return (
            "cannot be determined from these data",
            "the parameters have no covariance, so nothing says how sure the sign is",
        )
    where = f"a11 a22 - a12 a21 is {determinant:.3g}" + (f" with standard error {std:.2g}" if std > 0 else "")
    percent = "more than 99.9" if probability > 0.9995 else f"{100.0 * probability:.1f}"
    chance = f"the probability of a stable ship is {percent} %"
    if probability >= CONFIDENCE:
        return "stable", f"{where}; {chance}"
    if probability <= 1.0 - CONFIDENCE:
        return "unstable", f"{where}; {chance}"
    # far from zero by its own error it may have either sign: a product of parameters is not spread evenly
    why = "too near to zero" if abs(determinant) < _FAR * std else "the errors of its factors allow either sign"
    return "cannot be determined from these data", f"{where}: {why}; {chance}"


def _probability(p: Float, covariance: Float) -> float:
    """Return the share of the normal distribution that is stable, over the points of a Sobol sequence."""
    points = qmc.Sobol(4, scramble=False).random_base2(_LOG2_DRAWS)
    normal = ndtri(points + 0.5 / points.shape[0])
    # the parameters differ by orders of magnitude: the root of the correlation, scaled afterwards
    scale = np.sqrt(np.maximum(np.diag(covariance)[:4], 1e-300))
    values, vectors = np.linalg.eigh(covariance[:4, :4] / np.outer(scale, scale))
    draws = p[:4] + normal @ (vectors * np.sqrt(np.maximum(values, 0.0))).T * scale
    stable = (draws[:, 0] + draws[:, 3] < 0.0) & (draws[:, 0] * draws[:, 3] - draws[:, 1] * draws[:, 2] > 0.0)
    return float(np.mean(stable))
