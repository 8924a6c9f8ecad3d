"""One run under one model: the extended filter with everything else bound, its innovations, its free run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float, Mask
from kempf.pipeline.estimate.filters.ekf import extended
from kempf.pipeline.estimate.level_bounds import SIGMA_HIGH, SIGMA_LOW
from kempf.pipeline.estimate.likelihood import INITIAL_STD, Likelihood
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.record.rudder_inflow import with_rudder_inflow
from kempf.pipeline.model.batch import LANES, MOST, ONE
from kempf.pipeline.model.chain import N_CHAIN
from kempf.pipeline.model.dynamics import N_AFTER, N_BEFORE
from kempf.pipeline.model.effect_model import EffectModel
from kempf.schemas.model_spec import ModelSpec

#: so few sets of parameters go through one by one: a group of lanes costs less than twice as much
_ALONE = 1


@dataclass(frozen=True, eq=False)
class Passed:
    """What one pass of the filter gives."""

    log_likelihood: float
    #: innovation, variance: Shape (n, 3). Measured less predicted, NaN where not measured; and its variance.
    innovation: Float
    variance: Float
    #: Shape (n, 3).
    predicted: Float
    #: states, spread: Shape (n, 9 + k). Filtered states and their variances; 0 rows unless asked for.
    states: Float
    spread: Float


@dataclass(frozen=True, eq=False)
class RunFilter:
    """A run, a model and a disturbance model, ready for parameters."""

    run: GridRun
    model: EffectModel
    #: Which disturbances there are.
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

    def linear(self) -> Likelihood:
        """Return the likelihood of the run without effects, by the linear filter on the same measurements."""
        spec = self.spec
        record = with_rudder_inflow(self.run.instants(), spec)
        return Likelihood(record, spec, self.run.ship.arm_per_m, INITIAL_STD, SIGMA_LOW, SIGMA_HIGH)

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
            See `kempf.pipeline.estimate.filters.ekf.extended`; a level that is not used is taken for 0.
        values : ndarray, shape (p,)
            Parameters of the effects.
        withheld : ndarray of bool, shape (n,), optional
        """
        return self._filtered(hull[:, None], levels[:, None], values[:, None], states=states, withheld=withheld)[0]

    def run_filters(self, hulls: Float, levels: Float, values: Float) -> list[Passed]:
        """Run the filter for several sets of parameters at once, much faster than one after the other.

        Parameters
        ----------
        hulls, levels : ndarray, shape (6, k)
        values : ndarray, shape (p, k)
        """
        return self._filtered(hulls, levels, values, states=False, withheld=None)

    def _filtered(
        self, hulls: Float, levels: Float, values: Float, *, states: bool, withheld: Mask | None
    ) -> list[Passed]:
        extra = self.model.extra
        std = np.array(INITIAL_STD) * self.present()
        wide = np.concatenate([std[:N_CHAIN], [self.run.speed_error_std_m_s], np.zeros(extra), std[N_CHAIN:]])
        used = np.where(np.array(self.levels_used())[:, None], levels, np.array([[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]]).T)
        x0 = np.zeros((wide.size, hulls.shape[1]))
        return self._passes(hulls, used, values, x0, np.diag(wide**2), states=states, withheld=withheld)

    def free(self, hull: Float, values: Float, start: Float) -> Float:
        """Let the ship run from a state on, with no measurement taken in; return what would be measured, shape (n, 3).

        See `free_from`; ``start`` is of shape (8,).
        """
        predicted: Float = self.free_from(hull, values, start[:, None])[..., 0]
        return predicted

    def free_from(self, hull: Float, values: Float, starts: Float) -> Float:
        """Let the ship run from several states on, with no measurement taken in; return what would be measured.

        Parameters
        ----------
        hull : ndarray, shape (6,)
        values : ndarray, shape (p,)
        starts : ndarray, shape (8, k)
            (v, r, psi, F, M, c_1, c_2, b); the last five stay as they are.

        Returns
        -------
        ndarray, shape (n, 3, k)
        """
        k = starts.shape[1]
        between = np.zeros((N_BEFORE - N_CHAIN + self.model.extra, k))
        x0 = np.concatenate([starts[:N_CHAIN], between, starts[N_CHAIN:]])
        held = np.ones(self.run.measured.shape[0], dtype=np.bool_)
        quiet = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
        hulls, levels, same = (np.repeat(column[:, None], k, axis=1) for column in (hull, quiet, values))
        P0 = np.zeros((x0.shape[0], x0.shape[0]))
        passes = self._passes(hulls, levels, same, x0, P0, states=False, withheld=held, still=True)
        return np.stack([passed.predicted for passed in passes], axis=-1)

    def _passes(
        self,
        hulls: Float,
        levels: Float,
        values: Float,
        x0: Float,
        P0: Float,
        *,
        states: bool,
        withheld: Mask | None,
        still: bool = False,
    ) -> list[Passed]:
        """Run the filter in groups of lanes, and what is left over by itself or in a group filled up with itself."""
        passes: list[Passed] = []
        while len(passes) < hulls.shape[1]:
            left = hulls.shape[1] - len(passes)
            lanes, together = (LANES, MOST) if left > _ALONE else (ONE, 1)
            at = np.minimum(len(passes) + np.arange(together), hulls.shape[1] - 1)
            hull, level, value, start = (np.ascontiguousarray(part[:, at]) for part in (hulls, levels, values, x0))
            group = self._lanes(hull, level, value, start, P0, lanes, states=states, withheld=withheld, still=still)
            passes += group[: min(left, together)]
        return passes

    def _lanes(
        self,
        hulls: Float,
        levels: Float,
        values: Float,
        x0: Float,
        P0: Float,
        lanes: tuple[int, ...],
        *,
        states: bool,
        withheld: Mask | None,
        still: bool,
    ) -> list[Passed]:
        run, spec = self.run, self.spec
        (n, _), (size, k) = run.measured.shape, x0.shape
        # the kernel writes as many lanes as it was compiled for
        assert size == N_BEFORE + self.model.extra + N_AFTER and k == lanes[0]
        rates = (
            *(spec.wind_correlation_rate_per_s, spec.moment_correlation_rate_per_s),
            *(spec.current_correlation_rate_per_s, run.speed_error_rate_per_s),
        )
        rudders = self.model.rudders(run.rudder_line, values)
        rows = n if states else 0
        kept = (
            *(np.full((n, 3, k), np.nan), np.full((n, 3, k), np.nan)),
            *(np.empty((rows, size, k)), np.empty((rows, size, k))),
        )
        log_likelihoods = extended(
            *(hulls, levels, values, run.step_s, run.inputs, rudders, run.rudder_noise, run.measured),
            *(run.offset_s, np.zeros(n, dtype=np.bool_) if withheld is None else withheld, run.current_row),
            run.constants(spec.rudder_speed_exponent),
            *(np.zeros(4) if still else np.array(rates), x0, P0, self.model.table, kept, lanes),
        )
        predicted, variance, filtered, spread = (np.ascontiguousarray(np.moveaxis(part, -1, 0)) for part in kept)
        return [
            Passed(
                float(log_likelihoods[b]),
                run.measured - predicted[b],
                variance[b],
                predicted[b],
                filtered[b],
                spread[b],
            )
            for b in range(k)
        ]
