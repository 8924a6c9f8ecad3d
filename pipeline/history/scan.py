"""One stretch of a history without known change, put to the test: directions, scatter, simulated histories, p-value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.history.contrasts import Statistics, axes, directions, scatter, statistics, variances
from kempf.pipeline.history.sets import ParameterHistory
from kempf.pipeline.history.settings import ChangeSettings

YEAR_S = 365.25 * 86400.0


@dataclass(frozen=True, eq=False)
class Stretch:
    """A history in relative numbers, with all that the statistics need."""

    #: Shape (n_parameter,). What a relative 1 is worth, in the parameters' units.
    scale: Float
    #: value, covariance: Shape (n_set, n_parameter), (n_set, n_parameter, n_parameter). Relative.
    value: Float
    covariance: Float
    #: Shape (n_set,). Since the first set.
    years: Float
    #: Shape (n_parameter, n_direction). Principal axes, then parameters.
    along: Float
    #: Shape (n_set, n_direction). The sets' own, along the directions.
    variance: Float
    #: Shape (n_set, n_parameter, n_parameter). Relative covariance with the scatter between trials.
    total: Float
    settings: ChangeSettings

    def statistics(self, value: Float) -> Statistics:
        """Return the statistics of values in place of the stretch's own, shape (..., n_set, n_parameter)."""
        s = self.settings
        return statistics(value @ self.along, self.variance, self.years, s.smallest_side, s.prior_dof)

    def noise(self, draws: int, stream: int) -> Float:
        """Return simulated deviations, shape (draws, n_set, n_parameter): scatter as estimated, tails heavier.

        Parameters
        ----------
        stream : int
            Which of the independent streams.
        """
        n, p = self.value.shape
        random = np.random.Generator(np.random.PCG64([self.settings.seed, stream, n]))
        normal = random.standard_normal((draws, n, p))
        tails = np.sqrt(self.settings.tail_dof / random.chisquare(self.settings.tail_dof, (draws, n, 1)))
        deviations: Float = np.einsum("iab,sib->sia", np.linalg.cholesky(self.total), normal * tails)
        return deviations


def stretch(history: ParameterHistory, settings: ChangeSettings) -> Stretch:
    """Make a history ready for the test.

    Parameters
    ----------
    history : ParameterHistory
        Three sets at least.
    """
    variance = np.einsum("ijj->ij", history.covariance)
    # a parameter near zero is measured by its standard error instead
    scale = np.hypot(np.mean(history.value, axis=0), np.sqrt(np.mean(variance, axis=0)))
    value, covariance = history.value / scale, history.covariance / np.outer(scale, scale)
    U, along = axes(covariance), directions(covariance)
    between = scatter(value @ U, variances(covariance, U))[0]
    return Stretch(
        scale,
        value,
        covariance,
        (history.time_utc_ns - history.time_utc_ns[0]) / (1e9 * YEAR_S),
        along,
        variances(covariance, along),
        covariance + (U * between) @ U.T,
        settings,
    )


@dataclass(frozen=True)
class Verdict:
    """Result of the test of one stretch."""

    #: Probability of something so remarkable, step or drift, in a history without change; the settings' caution is in
    #: it.
    p_value: float
    #: step_threshold, drift_threshold: Squared t statistics beyond which a change is reported.
    step_threshold: float
    drift_threshold: float


def judge(span: Stretch, level: float) -> Verdict:
    """Test a stretch for a step at an unknown time and for a drift, both at once.

    The two statistics are put on one scale by their ranks among the simulated histories, and the smaller rank
    probability is itself judged by those histories (min-p: Westfall and Young 1993, Resampling-Based Multiple Testing).
    """
    simulated = span.statistics(span.noise(span.settings.draws, 0))
    own = span.statistics(span.value)
    step, drift = (
        np.append(many, alone)
        for many, alone in (
            (simulated.largest_step, own.largest_step),
            (simulated.largest_drift, own.largest_drift),
        )
    )
    size = step.size
    smaller = np.minimum(_tail(step), _tail(drift))
    p_value = min(1.0, float(np.mean(smaller <= smaller[-1])) / span.settings.caution)
    # the rank that so many simulated histories reach by one of the two
    allowed = np.sort(smaller[:-1])[max(int(level * span.settings.caution * size) - 1, 0)]
    place = min(max(round(allowed * size), 1), size - 1)
    return Verdict(p_value, float(np.sort(step[:-1])[-place]), float(np.sort(drift[:-1])[-place]))


def _tail(x: Float) -> Float:
    """Return the share of values at least as large as each."""
    ordered = np.sort(x)
    share: Float = (x.size - np.searchsorted(ordered, x, side="left")) / x.size
    return share
