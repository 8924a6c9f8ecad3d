"""The Cramer-Rao bound of a simulated run: the information on hull and noise levels at what the simulator really had.

Its wind force is a constant and a slow part of eq. (16); one state of the filter is the slow part, and the constant is
an unknown beside the parameters. Information of a Gaussian sequence from its prediction errors e and their variances S:
the sum of de de' / S + dS dS' / (2 S^2), here by differences of whole passes of the filter (Ljung 1999, System
Identification, sect. 7.4).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.model.chain import R, V
from kempf.schemas.model_spec import ModelSpec

_HULL = 6
#: steps of the differences: of a hull parameter as a share of it, of a logarithm
_SHARE, _LOGARITHM = 1e-4, 1e-3


def information_at(
    record: Record, spec: ModelSpec, arm_per_m: float, theta: Float, mean_force_m_s2: float
) -> tuple[Float, Float]:
    """Return the information on theta, shape (12, 12), the constant force unknown, and which elements are free.

    Parameters
    ----------
    spec : ModelSpec
        Correlation rates of the slow parts.
    theta : ndarray, shape (12,)
        Truth; a level at or below the bound of the search is nothing, and not free.
    mean_force_m_s2 : float
        The constant; without one (0) the model itself is true, and the likelihood has its information.
    """
    settings = MaximumLikelihoodSettings()
    objective = settings.bind(record, spec, arm_per_m)
    free = objective.active & (theta > objective.low + 1e-9)
    if mean_force_m_s2 == 0.0:
        return objective.full(theta)[2], free
    seen = np.isfinite(record.measured)

    def passed(at: Float, force: float) -> tuple[Float, Float]:
        """Prediction errors and variances of what is left when the answer to a constant force is taken away."""
        left = replace(record, measured=record.measured - force * _answer(record, spec, arm_per_m, at))
        trace = settings.bind(left, spec, arm_per_m).trace(at)
        return trace.innovation[seen], trace.variance[seen]

    _, S = passed(theta, mean_force_m_s2)
    index = np.flatnonzero(free)
    de, dS = np.zeros((S.size, index.size + 1)), np.zeros((S.size, index.size + 1))
    for column, i in enumerate(index):
        step = np.zeros(theta.size)
        step[i] = _SHARE * abs(theta[i]) if i < _HULL else _LOGARITHM
        (e1, S1), (e0, S0) = passed(theta + step, mean_force_m_s2), passed(theta - step, mean_force_m_s2)
        de[:, column], dS[:, column] = (e1 - e0) / (2 * step[i]), (S1 - S0) / (2 * step[i])
    # linear in the force, and of about the size of the force itself
    de[:, -1] = passed(theta, 2 * mean_force_m_s2)[0] - passed(theta, mean_force_m_s2)[0]
    J = (de / S[:, None]).T @ de + 0.5 * (dS / S[:, None] ** 2).T @ dS
    information = np.zeros((theta.size, theta.size))
    information[np.ix_(index, index)] = J[:-1, :-1] - np.outer(J[:-1, -1], J[-1, :-1]) / J[-1, -1]
    return information, free


def _answer(record: Record, spec: ModelSpec, arm_per_m: float, theta: Float) -> Float:
    """Lateral speed, yaw rate and heading under a constant unit of force and its moment, shape (n, 3)."""
    ship = theta.copy()
    ship[4:6] = 1.0, arm_per_m  # b V^2 delta is the force where delta is 1 / V^2
    nothing = np.full_like(record.measured, np.nan)
    pushed = replace(
        record,
        rudder_rad=1.0 / record.speed_m_s**2,
        rudder_noise_rad_sqrt_s=np.zeros_like(record.speed_m_s),
        measured=nothing,
    )
    states = MaximumLikelihoodSettings().bind(pushed, spec, arm_per_m).trace(ship).states
    turned = np.concatenate(
        [[0.0], np.cumsum(0.5 * (states[1:, R] + states[:-1, R]) * np.diff(record.time_s))],
    )
    return np.column_stack([states[:, V], states[:, R], turned])
