"""The log-likelihood of one record as a function of theta alone: the compiled kernel with everything else bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float, Mask
from kempf.pipeline.estimate.filters.linear_kernel import (
    ERROR,
    LOG_F,
    LOG_MEASUREMENT,
    N_STATE,
    N_THETA,
    likelihood,
    no_trace,
)
from kempf.pipeline.estimate.record.record import Instants
from kempf.pipeline.model.discretise import LONGEST
from kempf.schemas.model_spec import ModelSpec

#: logarithm of a noise level whose square is 0 to a double
_NOTHING = -400.0
#: standard deviations of (v, r, psi, F, M, c_1, c_2, b) at the first instant, SI: wide, the data decide
INITIAL_STD = (2.0, 0.2, 0.2, 0.1, 0.01, 2.0, 2.0, 0.01)


@dataclass(frozen=True, eq=False)
class Trace:
    """What the filter did on its way."""

    #: innovation, variance: Shape (n, 3). One-step prediction errors and their variances, NaN where not measured.
    innovation: Float
    variance: Float
    #: states, spread: Shape (n, 9). Filtered states and their variances.
    states: Float
    spread: Float
    #: Shape (n, 3, 12). Derivative of each measurement's own log-likelihood.
    scores: Float


class Likelihood:
    """Log-likelihood of one record.

    Parameters
    ----------
    record : Instants
    spec : ModelSpec
    arm_per_m : float
        l of eq. (16), 1/m.
    initial_std : tuple of float
        Standard deviations of the state (v, r, psi, F, M, c_1, c_2, b) at the first instant.
    sigma_low, sigma_high : tuple of float
        Bounds of the noise levels, order of `kempf.schemas.model_spec.NOISE_PARAMETERS`.
    longest : float
        Largest |A| h of one step of the filter; the default is exact to the last bits of a double.

    Attributes
    ----------
    active : ndarray of bool, shape (12,)
        Elements of theta that these data and this specification have.
    logarithms : ndarray of bool, shape (12,)
        Elements of theta that are logarithms of noise levels.
    low, high : ndarray, shape (12,)
        Bounds of theta.
    """

    def __init__(
        self,
        record: Instants,
        spec: ModelSpec,
        arm_per_m: float,
        initial_std: tuple[float, ...],
        sigma_low: tuple[float, ...],
        sigma_high: tuple[float, ...],
        longest: float = LONGEST,
    ) -> None:
        self.record, self.spec, self.arm_per_m = record, spec, arm_per_m
        used = record.used
        wind, moment, current = spec.wind != "none", spec.moment == "gauss-markov", spec.current != "none"
        self.active: Mask = np.array([*[True] * 6, wind, moment, current, *used])
        self.logarithms: Mask = np.arange(N_THETA) >= LOG_F
        present = np.array([1, 1, used[2], wind, moment, current, current, spec.rate_bias and used[1] and used[2]])
        if spec.current == "earth":
            row = np.column_stack([-np.sin(record.heading_rad), np.cos(record.heading_rad)])
        else:
            row = np.tile([1.0, 0.0], (record.time_s.size, 1))
            present[6] = 0
        error = record.speed_error
        P0 = np.diag(np.insert(np.array(initial_std) * present, ERROR, error.std_m_s) ** 2)
        rates = (
            *(spec.wind_correlation_rate_per_s, spec.moment_correlation_rate_per_s),
            *(spec.current_correlation_rate_per_s, error.rate_per_s),
        )
        withheld = np.zeros(record.time_s.size, dtype=np.bool_)
        noise = (record.rudder_noise_rad_sqrt_s, error.gain_rad_s_m)
        inputs = (record.time_s, record.speed_m_s, record.rudder_rad, *noise)
        self._fixed = (*inputs, record.measured, withheld, row, arm_per_m, *rates, longest, np.zeros(N_STATE), P0)
        self.low = np.concatenate([np.full(6, -np.inf), np.log(sigma_low)])
        self.high = np.concatenate([np.full(6, np.inf), np.log(sigma_high)])
        # a disturbance that the specification leaves out has no intensity at all
        absent = np.flatnonzero(~self.active[6:LOG_MEASUREMENT]) + 6
        self.low[absent], self.high[absent] = _NOTHING, _NOTHING

    def room(self, theta: Float, *, far: bool) -> tuple[Float, Float]:
        """Return how far a step may go down and up, shape (12,) each: by one in a logarithm."""
        reach = np.where(self.logarithms, 1.0, np.inf)
        return -reach, reach

    def value(self, theta: Float) -> float:
        """Log-likelihood alone."""
        return float(likelihood(theta, False, *self._fixed, no_trace())[0])  # noqa: FBT003 - compiled, by position

    def full(self, theta: Float) -> tuple[float, Float, Float]:
        """Log-likelihood, score, shape (12,), and expected information, shape (12, 12)."""
        value, score, information = likelihood(theta, True, *self._fixed, no_trace())  # noqa: FBT003 - the same
        return float(value), score, information

    def trace(self, theta: Float, *, scores: bool = False) -> Trace:
        """Run the filter once more and keep what it did; ``scores`` asks for those of the single measurements."""
        n = self.record.time_s.size
        kept = (
            *(np.full((n, 3), np.nan), np.full((n, 3), np.nan)),
            *(np.full((n, N_STATE), np.nan), np.full((n, N_STATE), np.nan)),
            np.zeros((n if scores else 0, 3, N_THETA)),
        )
        likelihood(theta, scores, *self._fixed, kept)
        return Trace(*kept)

    def predict(self, theta: Float, withheld: Mask) -> Trace:
        """Run the filter with some instants' measurements withheld; they are predicted, not taken in.

        Parameters
        ----------
        theta : ndarray, shape (12,)
        withheld : ndarray of bool, shape (n,)
        """
        n = self.record.time_s.size
        kept = (
            *(np.full((n, 3), np.nan), np.full((n, 3), np.nan)),
            *(np.full((n, N_STATE), np.nan), np.full((n, N_STATE), np.nan)),
            np.zeros((0, 3, N_THETA)),
        )
        before, after = self._fixed[:6], self._fixed[7:]
        likelihood(theta, False, *before, withheld, *after, kept)  # noqa: FBT003 - the same
        return Trace(*kept)

    def answers_per_s(self, theta: Float) -> float:
        """Rate at which the ship of these parameters answers at her largest speed, 1/s; the kernel's own measure."""
        a11, a12, a21, a22 = theta[:4]
        rate = abs(a11) + abs(a22) + np.sqrt(abs(a12 * a21))
        return float(rate * np.max(np.abs(self.record.speed_m_s)))
