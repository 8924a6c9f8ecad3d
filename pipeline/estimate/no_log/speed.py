"""The speed through the water of runs without a log: maximum likelihood of the longitudinal model, then the smoother.

The lateral parameters are given, from a fit that took some speed for granted; what the estimated speed changes in them
is the affair of `kempf.pipeline.estimate.no_log.identify`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from kempf.pipeline.channels.robust_std import MAD_TO_STD
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filters.smoother import LinearSystem, last_state, smooth
from kempf.pipeline.estimate.no_log.joint_motion import (
    CURRENT,
    LOST,
    MISFIT,
    SUM,
    V0,
    Y_U,
    LateralFit,
    MotionRun,
    Priors,
    V,
    join,
    set_surge,
    spans,
)
from kempf.pipeline.estimate.no_log.lateral_steps import YAW
from kempf.pipeline.estimate.no_log.longitudinal import Surge

#: bounds of T in s, of the wander of V over its mean in 1/s^0.5, of the noise of y_u in m/s
_T_S, _WANDER, _NOISE_M_S = (2.0, 3000.0), (1e-5, 0.03), (1e-4, 2.0)
#: no ship keeps to the longitudinal equation: once T is found, V is let wander by 0.8 % in a minute at least. Not
#: before: a T too short would explain why she wanders less
_LEAST_WANDER = 1e-3
_GATE = 5.0
#: of the logarithms of T and the noise levels, for finite differences
_STEP = 0.05
_START_LOG_T = (np.log(60.0), np.log(300.0))
_SEARCH = {"maxiter": 40, "ftol": 1e-9, "eps": 1e-4}


@dataclass(frozen=True, eq=False)
class Speed:
    """Speed through the water of several runs, one entry of each tuple a run."""

    #: speed_m_s, std_m_s: Shape (n,). V and its standard error at the instants of the run, for the lateral parameters
    #: given.
    speed_m_s: tuple[Float, ...]
    std_m_s: tuple[Float, ...]
    #: With the turning that was found, and without gross errors.
    runs: tuple[MotionRun, ...]
    surge: Surge
    #: Standard deviation of y_u.
    along_noise_m_s: float
    #: settled_m_s, loss_m: V_0 and k with their standard errors.
    settled_m_s: tuple[float, float]
    loss_m: tuple[float, float]
    #: One a run: what the hull shows of a current that is none, with its standard error.
    misfit_m_s: tuple[tuple[float, float], ...]
    #: current_along_m_s, current_along_std_m_s, correlation: Shape (n,). Current along the bow with its standard error,
    #: and the correlation of its error with that of V.
    current_along_m_s: tuple[Float, ...]
    current_along_std_m_s: tuple[Float, ...]
    correlation: tuple[Float, ...]
    #: Which of the longitudinal parameters ended at a bound.
    at_bound: tuple[str, ...]
    log_likelihood: float


class Motion:
    """Runs and the lateral fits that go with them, bound once: only the longitudinal parameters are left.

    Parameters
    ----------
    runs : tuple of MotionRun
        In the order of time.
    fits : tuple of LateralFit
    priors : Priors
    current : str
        See `kempf.pipeline.estimate.no_log.joint_motion.join`.
    """

    def __init__(self, runs: tuple[MotionRun, ...], fits: tuple[LateralFit, ...], priors: Priors, current: str) -> None:
        self.runs, self.fits, self.priors, self.current = runs, fits, priors, current
        self._system = join(runs, fits, priors, current)
        mean = float(np.mean([np.nanmean(run.along_m_s) for run in runs]))
        bounds = np.array([_T_S, (_WANDER[0] * mean, _WANDER[1] * mean), _NOISE_M_S])
        self.low, self.high = np.log(bounds).T
        self.least_wander = float(np.log(_LEAST_WANDER * mean))
        self.start = np.log([60.0, 2e-3 * mean, 0.1])

    def system(self, parameters: Float, averaged: int = 0) -> LinearSystem:
        """Return the linear system for (log T, log wander, log noise of y_u); good until the next call."""
        T, wander, noise = (float(p) for p in np.exp(parameters))
        set_surge(self._system, self.runs, Surge(T, wander), noise, averaged)
        return self._system

    def with_runs(self, runs: tuple[MotionRun, ...]) -> Motion:
        """Return the same with other y_u or turning."""
        return Motion(runs, self.fits, self.priors, self.current)

    def fitted(self, start: Float | None) -> tuple[Float, float]:
        """Return the most likely (log T, log wander, log noise of y_u), shape (3,), and its log-likelihood.

        ``start`` is one found before; without it several are tried.
        """

        def cost(parameters: Float) -> float:
            return -last_state(self.system(parameters)).log_likelihood

        bounds = list(zip(self.low, self.high, strict=True))
        # a slow ship that obeys and a quick one that wanders can look alike: both are tried
        fresh = [self.start, *(np.array([log_T, self.start[1] - 2.0, self.start[2]]) for log_T in _START_LOG_T)]
        starts = fresh if start is None else [start]
        searches = [
            minimize(cost, np.clip(x, self.low, self.high), method="L-BFGS-B", bounds=bounds, options=_SEARCH)
            for x in starts
        ]
        best = min(searches, key=lambda search: float(search.fun))
        return np.asarray(best.x, dtype=np.float64), -float(best.fun)

    def believed(self, parameters: Float) -> Float:
        """Return the parameters with no less wander than a ship has, shape (3,)."""
        return np.array([parameters[0], max(parameters[1], self.least_wander), parameters[2]])

    def mean_speed(self, parameters: Float, averaged: int) -> tuple[float, float]:
        """Return the mean of V over one run and its standard error, both m/s, the lateral parameters being given."""
        end = last_state(self.system(self.believed(parameters), averaged))
        duration = float(self.runs[averaged].record.time_s[-1])
        return float(end.mean[SUM]) / duration, float(np.sqrt(end.covariance[SUM, SUM])) / duration

    def surge_variance(self, parameters: Float, averaged: int) -> float:
        """Return what the unknown T and noise levels add to the variance of the mean speed, m^2/s^2."""
        free = [i for i in range(3) if self.low[i] + _STEP < parameters[i] < self.high[i] - _STEP]
        steps = _STEP * np.eye(3)[free]

        def value(at: Float) -> float:
            return last_state(self.system(at)).log_likelihood

        slope = np.array(
            [
                (self.mean_speed(parameters + h, averaged)[0] - self.mean_speed(parameters - h, averaged)[0])
                / (2.0 * _STEP)
                for h in steps
            ]
        )
        # no more than a factor of e^2 either way is believed of a parameter that the data leave open
        information = np.eye(len(free)) / 4.0
        for i, a in enumerate(steps):
            for j, b in enumerate(steps[: i + 1]):
                corners = [value(parameters + s * a + t * b) for s, t in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
                curvature = (corners[0] - corners[1] - corners[2] + corners[3]) / (4.0 * _STEP**2)
                information[i, j] -= curvature
                information[j, i] = information[i, j]
        eigenvalues, directions = np.linalg.eigh(information)
        along = directions.T @ slope
        return float(np.sum(along**2 / np.maximum(eigenvalues, 0.25)))


def speed_without_log(motion: Motion, start: Float | None = None) -> tuple[Speed, Motion, Float]:
    """Estimate the speed through the water.

    Parameters
    ----------
    motion : Motion
        Runs without gross errors in y_v.
    start : ndarray, shape (3,), optional
        Longitudinal parameters to start from, as `Motion.fitted` gives them.

    Returns
    -------
    speed : Speed
    motion : Motion
        With the turning filled in and gross errors of y_u left out.
    parameters : ndarray, shape (3,)
        log T, log wander, log noise of y_u, the most likely ones; see `Motion.believed`.
    """
    # a loose first pass: how the ship turned, and which y_u are no measurements
    loose = smooth(motion.system(motion.start))
    rows = spans(motion.runs)
    runs = tuple(
        replace(run, squared_rate=loose.mean[span, YAW] ** 2) for run, span in zip(motion.runs, rows, strict=True)
    )
    motion = motion.with_runs(_gated(runs, loose.innovation[:, -1] / np.sqrt(loose.variance[:, -1]), rows))
    fitted, value = motion.fitted(start)
    at = [np.isclose(fitted, motion.low, atol=1e-6), np.isclose(fitted, motion.high, atol=1e-6)]
    parameters = motion.believed(fitted)
    system = motion.system(parameters)
    final = smooth(system)
    names = ("T", "wander of V", "noise of y_u")
    T, wander, noise = (float(p) for p in np.exp(parameters))
    std = _root(np.einsum("kii->ki", final.covariance))
    row = system.H[:, Y_U, CURRENT]
    along = np.einsum("ki,ki->k", row, final.mean[:, CURRENT])
    along_std = _root(np.einsum("ki,kij,kj->k", row, final.covariance[:, CURRENT, CURRENT], row))
    shared = np.einsum("ki,ki->k", row, final.covariance[:, CURRENT, V])
    speed = Speed(
        speed_m_s=tuple(final.mean[span, V] for span in rows),
        std_m_s=tuple(std[span, V] for span in rows),
        runs=motion.runs,
        surge=Surge(T, wander),
        along_noise_m_s=noise,
        settled_m_s=(float(final.mean[-1, V0]), float(std[-1, V0])),
        loss_m=(float(final.mean[-1, LOST]), float(std[-1, LOST])),
        misfit_m_s=tuple((float(final.mean[span, MISFIT][-1]), float(std[span, MISFIT][-1])) for span in rows),
        current_along_m_s=tuple(along[span] for span in rows),
        current_along_std_m_s=tuple(along_std[span] for span in rows),
        correlation=tuple(shared[span] / (along_std[span] * std[span, V] + 1e-300) for span in rows),
        at_bound=tuple(name for i, name in enumerate(names) if at[0][i] or at[1][i]),
        log_likelihood=value,
    )
    return speed, motion, fitted


def _root(variance: Float) -> Float:
    """Return standard deviations; where the digits run out a variance may fall below 0, and is not known then."""
    return np.sqrt(np.where(variance >= 0.0, variance, np.nan))


def _gated(runs: tuple[MotionRun, ...], white: Float, rows: tuple[slice, ...]) -> tuple[MotionRun, ...]:
    """Leave out y_u whose innovation lies beyond the gate, in robust standard deviations."""
    width = _GATE * MAD_TO_STD * float(np.nanmedian(np.abs(white)))
    kept = []
    for run, span in zip(runs, rows, strict=True):
        along = run.along_m_s.copy()
        along[np.abs(np.nan_to_num(white[span])) > width] = np.nan
        kept.append(replace(run, along_m_s=along))
    return tuple(kept)
