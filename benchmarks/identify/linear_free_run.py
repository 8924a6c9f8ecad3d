"""The model by itself: from the initial state on, under the logged rudder and speed, with no measurement taken in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filters.linear_kernel import N_STATE, N_THETA, likelihood, no_trace
from kempf.pipeline.estimate.one_step_fit import fit_percent
from kempf.pipeline.estimate.record.record import MEASUREMENTS, Record
from kempf.pipeline.estimate.record.rudder_inflow import with_rudder_inflow
from kempf.pipeline.model.discretise import LONGEST
from kempf.pipeline.model.ship import Hull
from kempf.schemas.model_spec import ModelSpec

#: logarithm of a level that is nothing, and time over which the initial state is averaged, s
_NOTHING, _INITIAL_S = -400.0, 1.0


@dataclass(frozen=True, eq=False)
class LinearFreeRun:
    """A free run beside the measurements."""

    #: Shape (n,). Of the record.
    time_s: Float
    #: Shape (n, 3). Lateral speed through the water, m/s, yaw rate, rad/s, heading from its first value, rad.
    predicted: Float
    #: Shape (n, 3). Measured less predicted; NaN where not measured.
    error: Float

    @property
    def rms(self) -> dict[str, float]:
        """Root of the mean squared error by measurement, SI; without those that the record does not hold."""
        return {
            name: float(np.sqrt(np.nanmean(self.error[:, i] ** 2)))
            for i, name in enumerate(MEASUREMENTS)
            if np.isfinite(self.error[:, i]).any()
        }

    @property
    def fit_percent(self) -> dict[str, float]:
        """As MATLAB's ``compare`` defines it, by measurement."""
        found = {}
        for i, name in enumerate(MEASUREMENTS):
            good = np.isfinite(self.error[:, i])
            if good.any():
                found[name] = fit_percent(self.error[good, i] + self.predicted[good, i], self.error[good, i])
        return found


def free_run(record: Record, hull: Hull, spec: ModelSpec) -> LinearFreeRun:
    """Let the ship of some parameters run under a record's rudder.

    Parameters
    ----------
    record : Record
        Gives the inputs, and the initial state as the mean of its first second's measurements.
    spec : ModelSpec
        For the rudder's inflow; wind, current and other disturbances are none.
    """
    used = with_rudder_inflow(record, spec)
    n = used.time_s.size
    first = used.time_s <= used.time_s[0] + _INITIAL_S
    x0, P0 = np.zeros(N_STATE), np.zeros((N_STATE, N_STATE))
    for state, column in ((0, 0), (1, 1), (2, 2)):
        known = used.measured[first, column]
        x0[state] = float(np.mean(known[np.isfinite(known)])) if np.isfinite(known).any() else 0.0
        # a state without variance would be left out of the arithmetic
        P0[state, state] = 1.0
    theta = np.concatenate([hull.array(), np.full(N_THETA - 6, _NOTHING)])
    states, spread = np.empty((n, N_STATE)), np.empty((n, N_STATE))
    trace = (*no_trace()[:2], states, spread, no_trace()[4])
    nothing = np.full((n, 3), np.nan)
    likelihood(
        *(theta, False, used.time_s, used.speed_m_s, used.rudder_rad, np.zeros(n), np.zeros(n), nothing),
        *(np.zeros(n, dtype=np.bool_), np.zeros((n, 2)), 0.0, 1.0, 1.0, 1.0, 1.0, LONGEST, x0, P0, trace),
    )
    predicted = states[:, [0, 1, 2]]
    return LinearFreeRun(record.time_s, predicted, record.measured - predicted)
