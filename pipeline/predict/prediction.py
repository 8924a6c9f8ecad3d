"""One run beside its prediction at any horizon: error, interval, fit % as MATLAB defines it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate import sensitivity
from kempf.pipeline.estimate.filtered import Passed, RunFilter
from kempf.pipeline.estimate.one_step_fit import fit_percent
from kempf.pipeline.estimate.record.record import MEASUREMENTS
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.predict.free_run import FreeRun, free_run_of
from kempf.pipeline.predict.horizon import Horizon
from kempf.schemas.confidence import NORMAL_95
from kempf.schemas.errors import DataRejected

#: a prediction counts when its variance is below this many times the median one: the first only carry the initial state
_SETTLED = 3.0
#: parts of a horizon; errors of its last part count, so that all predictions are between 3/4 and the whole of it ahead
_PARTS = 4
#: horizons for which measurements are taken in before each prediction
_TAKEN_IN = 3


@dataclass(frozen=True, eq=False)
class Predicted:
    """A run beside its prediction."""

    horizon: Horizon
    #: Shape (n,).
    time_s: Float
    #: predicted, error: Shape (n, 3). What would be measured, and measured less predicted, columns
    #: `pipeline.estimate.record.record.MEASUREMENTS`, m/s, rad/s, rad; NaN where nothing was measured or predicted.
    predicted: Float
    error: Float
    #: Shape (n, 3). Of the error as the model has it; NaN in a free run, whose error no disturbance model describes.
    std: Float
    #: Predictions left out because the initial state was not known yet.
    settling: int
    #: Shape (8,), or None. Of a free run: initial v, r, psi and the constant F, M, c_1, c_2, b.
    constants: Float | None = None

    def rms(self) -> dict[str, float]:
        """Root mean square error by channel, SI; without channels that were not measured."""
        return {name: float(np.sqrt(np.mean(e**2))) for name, _, e in self._channels()}

    def fit_percent(self) -> dict[str, float]:
        """Return 100 (1 - |y - y^| / |y - mean y|) by channel."""
        return {name: fit_percent(y, e) for name, y, e in self._channels()}

    def count(self) -> dict[str, int]:
        """Return how many predictions there are, by channel."""
        return {name: int(e.size) for name, _, e in self._channels()}

    def inside_95(self) -> dict[str, tuple[int, int]]:
        """Return how many measurements lie in their 95 % interval, and of how many; none in a free run."""
        counts = {}
        for i, name in enumerate(MEASUREMENTS):
            good = np.isfinite(self.error[:, i]) & np.isfinite(self.std[:, i])
            if good.any():
                within = np.abs(self.error[good, i]) < NORMAL_95 * self.std[good, i]
                counts[name] = (int(np.count_nonzero(within)), int(np.count_nonzero(good)))
        return counts

    def _channels(self) -> list[tuple[str, Float, Float]]:
        channels = []
        for i, name in enumerate(MEASUREMENTS):
            good = np.isfinite(self.error[:, i])
            if np.count_nonzero(good) > 1:
                channels.append((name, self.error[good, i] + self.predicted[good, i], self.error[good, i]))
        return channels


def predict(filtered: RunFilter, point: Point, horizon: Horizon) -> Predicted:
    """Predict a run.

    Parameters
    ----------
    point : Point
        Parameters and noise levels; a free run asks for no levels.

    Raises
    ------
    DataRejected
        ``prediction_diverges``: the model runs away under this run's rudder.
        ``horizon_too_long``: the run is shorter than two horizons.
    """
    if horizon.kind == "free run":
        return of_free_run(filtered, free_run_of(filtered, point.hull, point.values), horizon)
    if horizon.seconds is not None:
        return _ahead(filtered, point, horizon, horizon.seconds)
    passed = sensitivity.passed(filtered, point)
    _require_finite(passed, filtered)
    error, std = settled(passed)
    settling = int(np.count_nonzero(np.isfinite(passed.innovation)) - np.count_nonzero(np.isfinite(error)))
    return Predicted(horizon, filtered.run.time_s, passed.predicted, error, std, settling)


def of_free_run(filtered: RunFilter, free_run: FreeRun, horizon: Horizon) -> Predicted:
    """Return a free run that was made already as a prediction.

    Parameters
    ----------
    free_run : FreeRun
        Of it.
    horizon : Horizon
        The free one.

    Raises
    ------
    DataRejected
        ``prediction_diverges``.
    """
    if not np.all(np.isfinite(free_run.predicted)):
        raise _diverges(filtered)
    std = np.full(free_run.error.shape, np.nan)
    return Predicted(horizon, filtered.run.time_s, free_run.predicted, free_run.error, std, 0, free_run.constants)


def settled(passed: Passed) -> tuple[Float, Float]:
    """Return innovations and their standard deviations, NaN until the initial state is known, shape (n, 3) each."""
    made = np.isfinite(passed.innovation)
    variance = np.where(made, passed.variance, np.nan)
    good = made.copy()
    for i in range(variance.shape[1]):
        if made[:, i].any():
            good[:, i] &= passed.variance[:, i] < _SETTLED * np.nanmedian(variance[:, i])
    return np.where(good, passed.innovation, np.nan), np.where(good, np.sqrt(variance), np.nan)


def _ahead(filtered: RunFilter, point: Point, horizon: Horizon, seconds: float) -> Predicted:
    """Go without measurements for one horizon in four, from as many beginnings as predict every instant once."""
    run = filtered.run
    n = run.measured.shape[0]
    steps = max(1, round(seconds / run.step_s))
    if n < 2 * steps + 1:
        raise DataRejected(
            "horizon_too_long",
            f"{run.name} lasts {run.time_s[-1]:.0f} s; to predict {seconds:g} s ahead it must last twice as long.",
            "Ask for a shorter horizon, or for the free run.",
            {"segment_id": run.name},
        )
    part = max(1, steps // _PARTS)
    cycle = (1 + _TAKEN_IN) * steps
    predicted, error, std = (np.full((n, 3), np.nan) for _ in range(3))
    number = np.arange(n)
    for first in range(0, cycle, part):
        since = (number - first) % cycle
        # the first stretch must be taken in: the initial state is hardly known
        withheld = (since < steps) & (number - since >= steps)
        far = withheld & (since >= steps - part)
        if not far.any():
            continue
        passed = filtered.run_filter(point.hull, np.exp(point.levels), point.values, withheld=withheld)
        _require_finite(passed, filtered)
        predicted[far], error[far] = passed.predicted[far], passed.innovation[far]
        std[far] = np.sqrt(passed.variance[far])
    std[~np.isfinite(error)] = np.nan
    left_out = int(np.count_nonzero(np.isfinite(run.measured)) - np.count_nonzero(np.isfinite(error)))
    return Predicted(horizon, run.time_s, predicted, error, std, left_out)


def _require_finite(passed: Passed, filtered: RunFilter) -> None:
    if not np.isfinite(passed.log_likelihood):
        raise _diverges(filtered)


def _diverges(filtered: RunFilter) -> DataRejected:
    return DataRejected(
        "prediction_diverges",
        f"The model runs away under the rudder of {filtered.run.name}: its state leaves all bounds.",
        "Identify it from more manoeuvres, or compare another parameter set with --set.",
        {"segment_id": filtered.run.name},
    )
