"""The likelihood of eq. (16) as a model of statsmodels, the way a user of that package would write it.

The same states (v, r, F, c_N, c_E, e), the same measurements y_v and y_r, the same exact steps with the logged speed
and a rudder that moves linearly; statsmodels filters (compiled) and maximises (L-BFGS, derivatives by differences).
The steps of all instants are made at once in numpy. Reference: Fulton (2015), "Estimating time series models by state
space methods in Python: statsmodels".
"""

from __future__ import annotations

from typing import Any

import numpy as np
from statsmodels.tsa.statespace.mlemodel import MLEModel

from kempf.pipeline.estimate.likelihood import INITIAL_STD
from kempf.pipeline.estimate.record.record import Record
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec

#: positions in our theta of what this model has: the hull, sigma_F, sigma_V, sigma_v, sigma_r
TAKEN = np.array([0, 1, 2, 3, 4, 5, 6, 8, 9, 10])
_NAMES = (*HULL_PARAMETERS, "log_sigma_F", "log_sigma_V", "log_sigma_v", "log_sigma_r")
_STATES = np.array([0, 1, 3, 5, 6])
_ORDER = 24
_NODES, _WEIGHTS = (np.array(x) for x in np.polynomial.legendre.leggauss(4))


class ShipLikelihood(MLEModel):  # type: ignore[misc, unused-ignore]
    """Lateral motion with wind force and a current fixed in the earth.

    Parameters
    ----------
    record : Record
        Its heading is not used but for the direction of the current. Steps must be short enough for one step of our
        kernel, |A| h <= 0.5: it takes the rudder's error for constant over a step.
    spec : ModelSpec
        Wind force, current in the earth frame.
    arm_per_m : float
        l of eq. (16), 1/m.
    scale : ndarray, shape (6,)
        Parameters are the hull over this, so that the optimiser sees numbers near 1, then the logarithms.
    """

    def __init__(self, record: Record, spec: ModelSpec, arm_per_m: float, scale: Any) -> None:
        super().__init__(record.measured[:, :2], k_states=6, k_posdef=6, loglikelihood_burn=0)
        self.arm, self.scale = arm_per_m, np.asarray(scale, dtype=np.float64)
        self.wind_rate = spec.wind_correlation_rate_per_s
        self.step_s, u = np.diff(record.time_s), record.rudder_rad
        self.speed = 0.5 * (record.speed_m_s[1:] + record.speed_m_s[:-1])
        self.before, self.slope = u[:-1], np.diff(u)
        self.rudder_variance = record.rudder_noise_rad_sqrt_s[1:] ** 2 / self.step_s
        self.decay = np.exp(-spec.current_correlation_rate_per_s * self.step_s)
        n = record.time_s.size
        design = np.zeros((2, 6, n))
        design[0, 0], design[1, 1] = 1.0, 1.0
        design[0, 3], design[0, 4] = -np.sin(record.heading_rad), np.cos(record.heading_rad)
        self["design"], self["selection"] = design, np.eye(6)
        error = record.speed_error
        self.error_gain = 0.5 * (error.gain_rad_s_m[1:] + error.gain_rad_s_m[:-1])
        self.error_std, self.error_decay = error.std_m_s, np.exp(-error.rate_per_s * self.step_s)
        std = np.append(np.array(INITIAL_STD)[_STATES], error.std_m_s)
        self.initialize_known(np.zeros(6), np.diag(std**2))
        self.arrays: dict[Any, tuple[Any, Any, Any]] = {}

    @property
    def param_names(self) -> list[str]:
        """Names of the parameters."""
        return list(_NAMES)

    @property
    def start_params(self) -> Any:
        """Taken from our starting points instead."""
        return np.full(len(_NAMES), np.nan)

    def ours(self, params: Any) -> Any:
        """Return theta as our kernel has it, shape (12,), from the parameters, shape (10,)."""
        theta = np.full(12, -400.0)
        theta[TAKEN] = np.concatenate([params[:6] * self.scale, params[6:]])
        return theta

    def theirs(self, theta: Any) -> Any:
        """Return the parameters, shape (10,), from our theta, shape (12,)."""
        chosen = theta[TAKEN]
        return np.concatenate([chosen[:6] / self.scale, chosen[6:]])

    def update(self, params: Any, **kwargs: Any) -> None:
        """Put the matrices of all steps into the state space."""
        params = super().update(params, **kwargs)
        hull, sigma = params[:6] * self.scale, np.exp(params[6:])
        n = self.speed.size + 1
        # the last of everything leads beyond the record
        transition = np.zeros((6, 6, n), dtype=params.dtype)
        intercept, noise = np.zeros((6, n), dtype=params.dtype), np.zeros((6, 6, n), dtype=params.dtype)
        Phi, g, Q, held = self._steps(hull, sigma[0])
        transition[:3, :3, :-1], intercept[:3, :-1], noise[:3, :3, :-1] = Phi, g, Q
        transition[3, 3, :-1] = transition[4, 4, :-1] = self.decay
        noise[3, 3, :-1] = noise[4, 4, :-1] = sigma[1] ** 2 * (1.0 - self.decay**2)
        transition[:3, 5, :-1], transition[5, 5, :-1] = held * self.error_gain, self.error_decay
        noise[5, 5, :-1] = self.error_std**2 * (1.0 - self.error_decay**2)
        self["transition"], self["state_intercept"], self["state_cov"] = transition, intercept, noise
        self["obs_cov"] = np.diag(sigma[2:] ** 2)

    def _steps(self, hull: Any, sigma_F: Any) -> tuple[Any, Any, Any, Any]:
        """Exact steps of (v, r, F): transition, input, process noise, and what a unit of rudder held does."""
        h, V, n = self.step_s, self.speed, self.speed.size
        A = np.zeros((n, 3, 3), dtype=hull.dtype)
        A[:, :2, :2] = hull[:4].reshape(2, 2) * (V * h)[:, None, None]
        A[:, 0, 2], A[:, 1, 2], A[:, 2, 2] = h, self.arm * h, -self.wind_rate * h
        B = np.zeros((n, 3), dtype=hull.dtype)
        B[:, :2] = hull[4:] * (V * V * h)[:, None]
        nodes, weights = 0.5 * (1.0 + _NODES), 0.5 * _WEIGHTS
        term = np.tile(np.eye(3, dtype=hull.dtype), (n, 1, 1))
        Phi, once, twice = term.copy(), term.copy(), 0.5 * term
        answer = np.repeat(term[:, :, 2:], nodes.size, axis=2)
        for k in range(1, _ORDER + 1):
            term = A @ term / k
            Phi += term
            once += term / (k + 1)
            twice += term / ((k + 1) * (k + 2))
            answer += term[:, :, 2:] * nodes**k
            if np.max(np.abs(term)) < 1e-18:
                break
        held = (once @ B[:, :, None])[:, :, 0]
        g = self.before[:, None] * held + self.slope[:, None] * (twice @ B[:, :, None])[:, :, 0]
        intensity = 2.0 * self.wind_rate * sigma_F**2 * h
        Q = intensity[:, None, None] * ((answer * weights) @ answer.transpose(0, 2, 1))
        Q += self.rudder_variance[:, None, None] * held[:, :, None] * held[:, None, :]
        return Phi.transpose(1, 2, 0), g.T, Q.transpose(1, 2, 0), held.T
