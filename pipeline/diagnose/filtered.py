"""One run under one model: the extended filter with everything else bound, its innovations, its free run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.diagnose.run import Run
from pipeline.identify.scoring import Mask
from pipeline.model.augmented import Augmented
from pipeline.model.extended import N_AFTER, N_BEFORE, extended
from pipeline.normalise.series import Float
from schemas.model_spec import ModelSpec

#: standard deviations of (v, r, psi, F, M, c_1, c_2, b) at the first instant, SI: wide, the data decide
INITIAL_STD = np.array([2.0, 0.2, 0.2, 0.1, 0.01, 2.0, 2.0, 0.01])


@dataclass(frozen=True, eq=False)
class Passed:
    """What one pass of the filter gives.

    Attributes
    ----------
    log_likelihood : float
    innovation, variance : ndarray, shape (n, 3)
        Measured less predicted, NaN where not measured; and its variance.
    predicted : ndarray, shape (n, 3)
    states, spread : ndarray, shape (n, 8 + k)
        Filtered states and their variances; 0 rows unless asked for.
    """

    log_likelihood: float
    innovation: Float
    variance: Float
    predicted: Float
    states: Float
    spread: Float


@dataclass(frozen=True, eq=False)
class Filtered:
    """A run, a model and a disturbance model, ready for parameters.

    Attributes
    ----------
    run : Run
    model : Augmented
    spec : ModelSpec
        Which disturbances there are.
    """

    run: Run
    model: Augmented
    spec: ModelSpec

    def present(self) -> Float:
        """Which of (v, r, psi, F, M, c_1, c_2, b) the disturbance model has, shape (8,)."""
        current = self.spec.current != "none"
        used = self._measured()
        two = current and self.spec.current == "earth"
        bias = self.spec.rate_bias and used[1] and used[2]
        wind, moment = self.spec.wind != "none", self.spec.moment == "gauss-markov"
        return np.array([1.0, 1.0, 1.0, wind, moment, current, two, bias])

    def _measured(self) -> list[bool]:
        """Which of the three measurements the run has."""
        return [bool(np.isfinite(column).any()) for column in self.run.measured.T]

    def levels_used(self) -> list[bool]:
        """Which of the six noise levels these data and this specification have."""
        has = self.present()
        return [bool(has[3]), bool(has[4]), bool(has[5]), *self._measured()]

    def run_filter(
        self, hull: Float, levels: Float, values: Float, *, states: bool = False, withheld: Mask | None = None
    ) -> Passed:
        """Run the filter.

        Parameters
        ----------
        hull, levels : ndarray, shape (6,)
            See `pipeline.model.extended.extended`; a level that is not used is taken for 0.
        values : ndarray, shape (p,)
            Parameters of the effects.
        states : bool, optional
        withheld : ndarray of bool, shape (n,), optional
        """
        extra = self.model.extra
        std = INITIAL_STD * self.present()
        wide = np.concatenate([std[:N_BEFORE], np.zeros(extra), std[N_BEFORE:]])
        return self._pass(hull, levels, values, np.zeros(wide.size), np.diag(wide**2), states=states, withheld=withheld)

    def free(self, hull: Float, values: Float, start: Float) -> Float:
        """Let the ship run from a state on, with no measurement taken in; return what would be measured, shape (n, 3).

        Parameters
        ----------
        hull : ndarray, shape (6,)
        values : ndarray, shape (p,)
        start : ndarray, shape (8,)
            (v, r, psi, F, M, c_1, c_2, b); the last five stay as they are but for their correlation rates.
        """
        extra = self.model.extra
        x0 = np.concatenate([start[:N_BEFORE], np.zeros(extra), start[N_BEFORE:]])
        n = self.run.measured.shape[0]
        held = np.ones(n, dtype=np.bool_)
        quiet = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
        P0 = np.zeros((x0.size, x0.size))
        return self._pass(hull, quiet, values, x0, P0, states=False, withheld=held, still=True).predicted

    def _pass(
        self,
        hull: Float,
        levels: Float,
        values: Float,
        x0: Float,
        P0: Float,
        *,
        states: bool,
        withheld: Mask | None,
        still: bool = False,
    ) -> Passed:
        run, spec = self.run, self.spec
        n, size = run.measured.shape[0], x0.size
        inputs = run.inputs
        if any(effect.rudder_course is not None for effect in self.model.effects):
            inputs = inputs.copy()
            inputs[:, 1] = self.model.rudder(run.fine_time_s, inputs[:, 1], values)
        rates = np.array(
            [
                spec.wind_correlation_rate_per_s,
                spec.moment_correlation_rate_per_s,
                spec.current_correlation_rate_per_s,
            ]
        )
        ship = run.ship
        told = np.array(
            [
                *(ship.arm_per_m, ship.length_m, ship.draught_m, run.approach_m_s, run.approach_per_s),
                spec.rudder_speed_exponent,
            ]
        )
        used = np.where(self.levels_used(), levels, [0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
        kept = (
            *(np.full((n, 3), np.nan), np.full((n, 3), np.nan)),
            *(np.empty((n if states else 0, size)), np.empty((n if states else 0, size))),
        )
        value = extended(
            *(hull, used, values, run.step_s, inputs, run.rudder_noise, run.measured, run.offset_s),
            *(np.zeros(n, dtype=np.bool_) if withheld is None else withheld, run.current_row, told),
            *(np.zeros(3) if still else rates, x0, P0, self.model.table, kept),
        )
        assert size == N_BEFORE + self.model.extra + N_AFTER
        return Passed(float(value), run.measured - kept[0], kept[1], *(kept[i] for i in (0, 2, 3)))
