"""What every estimator returns: values, uncertainty, and an honest report of how it went."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.ship import Hull, discrete_from_continuous
from kempf.schemas.model_spec import HULL_PARAMETERS


@dataclass(frozen=True)
class Value:
    """A number with its standard error and unit; ``std`` is NaN where the estimator has none."""

    name: str
    value: float
    std: float
    unit: str


@dataclass(frozen=True, eq=False)
class Estimate:
    """Parameters of eq. (16) from one segment."""

    estimator: str
    #: The six hull parameters, continuous time.
    parameters: tuple[Value, ...]
    #: The matrices of eq. (17) at ``step_s`` and the mean speed.
    discrete: tuple[Value, ...]
    #: Shape (6, 6). Of the hull parameters; NaN where unknown.
    covariance: Float
    noise: tuple[Value, ...]
    converged: bool
    #: Why it stopped, condition number, active bounds, weakly determined directions, starts; JSON-serialisable.
    report: dict[str, Any]
    #: Every iteration with its parameters, JSON-serialisable.
    iterations: tuple[dict[str, Any], ...]
    #: In-sample statistics, see `kempf.pipeline.estimate.one_step_fit`; JSON-serialisable.
    fit: dict[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def hull(self) -> Hull:
        """The six parameters as the model takes them."""
        return Hull(*(p.value for p in self.parameters))


def hull_values(hull: Float, covariance: Float) -> tuple[Value, ...]:
    """Pair the six parameters, shape (6,), with the standard errors of their covariance, shape (6, 6)."""
    std = np.sqrt(np.diag(covariance))
    return tuple(
        Value(name, float(hull[i]), float(std[i]), unit) for i, (name, unit) in enumerate(HULL_PARAMETERS.items())
    )


def discrete_values(hull: Float, covariance: Float, speed_m_s: float, step_s: float) -> tuple[Value, ...]:
    """Convert to the matrices of eq. (17), errors propagated to first order by central differences.

    Parameters
    ----------
    hull : ndarray, shape (6,)
    covariance : ndarray, shape (6, 6)
    speed_m_s, step_s : float
        Speed and step of the discrete model.

    Returns
    -------
    tuple of Value
        A11, A12, A21, A22, B1, B2 for states (v, r) in m/s and rad/s and rudder in rad.
    """

    def flat(parameters: Float) -> Float:
        A, B = discrete_from_continuous(Hull(*parameters), speed_m_s, step_s)
        return np.concatenate([A.ravel(), B.ravel()])

    centre = flat(hull)
    jacobian = np.empty((6, 6))
    for i in range(6):
        step = 1e-6 * max(abs(hull[i]), 1e-9)
        up, down = hull.copy(), hull.copy()
        up[i] += step
        down[i] -= step
        jacobian[:, i] = (flat(up) - flat(down)) / (2.0 * step)
    std = np.sqrt(np.diag(jacobian @ covariance @ jacobian.T))
    names = ("A11", "A12", "A21", "A22", "B1", "B2")
    units = ("1", "m/rad", "rad/m", "1", "m/s/rad", "1/s")
    return tuple(Value(n, float(c), float(s), u) for n, c, s, u in zip(names, centre, std, units, strict=True))
