"""What a channel was, given all of its readings: the signal without the noise of its instrument.

A model that goes by a noisy input answers too weakly to it: what is noise in the input moves no ship, so that a
coefficient comes out too small, and too certain. By the signal that the readings let expect it does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from kempf.pipeline.channels.rounding import rounding_std
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.channels.spline import Smoother

#: fewer readings do not part noise from signal
_FEWEST = 12
#: widths that are tried, in periods of the readings: noise of a narrower one is none; a straight line through all of a
#: series would know its error for nothing; and beyond the last one the equations lose their digits
_NARROWEST, _PART_OF_SERIES, _WIDEST, _STEP = 0.1, 8.0, 2000.0, 0.6
_EXACT = 1.01 * _NARROWEST
#: log-likelihood of a width that leaves less than the rounding
_IMPOSSIBLE = -1e12
#: variance of what is left of the noise, as a part of the noise's, times the width in periods, by order: the integral
#: of 1 / (1 + w^(2 order)) over all w, divided by 2 pi
_LEFT = {1: 0.5, 2: 0.5**1.5}


@dataclass(frozen=True, eq=False)
class Signal:
    """A series without its noise, and the error of that."""

    #: At its own instants.
    series: Series
    #: Standard deviation of the error, in the series' unit.
    error_std: float
    #: Its correlation time, s: that of the first-order process with as much variance and as much power at frequency 0.
    error_time_s: float
    #: Number of the shape that it goes with, from 0, and the multiple of it; None where it goes with none.
    shape: int | None = None
    multiple: float = 0.0


@dataclass(frozen=True)
class _Candidate:
    log_likelihood: float
    order: int
    log_width: float
    #: column of the shape that it stands beside, 0 beside none; and its multiple
    shape: int
    multiple: float
    noise_variance: float
    multiple_variance: float


def signal(series: Series, shapes: Sequence[Float] = ()) -> Signal:
    """Take the noise out of a series.

    The signal wanders (a random walk: gusts, revolutions) or bends (an integrated one: a speed, a roll), the noise of
    the readings is white. Which of the two, and how strong signal and noise are, the readings' likelihood says.

    Parameters
    ----------
    series : Series
    shapes : sequence of ndarray, shape (n,), optional
        What the series may go with, at its instants. A multiple of one of them, the one that helps most, may come on
        top, so that less is left to follow.

    Returns
    -------
    Signal
        With the same series where its readings show no noise, or are fewer than 12.

    References
    ----------
    Wahba (1985), "A comparison of GCV and GML for choosing the smoothing parameter", Annals of Statistics 13: the
    likelihood of a spline's width. Harvey (1989), Forecasting, Structural Time Series Models and the Kalman Filter,
    ch. 2 and 4: both signals, and regression beside them. Silverman (1984), "Spline smoothing: the equivalent variable
    kernel method", Annals of Statistics 12: what a width passes on. Carroll, Ruppert, Stefanski & Crainiceanu (2006),
    Measurement Error in Nonlinear Models, ch. 4: regression on the expected input is free of the bias of one on a noisy
    input.
    """
    if len(series) < _FEWEST or not np.ptp(series.value) > 0.0:
        return Signal(series, 0.0, 0.5 * series.period_s if len(series) > 1 else 0.0)
    search = _Search(series, shapes)
    best = search.best
    width = float(np.exp(best.log_width))
    noise_std = float(np.sqrt(best.noise_variance))
    goes_with = best.shape - 1 if best.shape else None, best.multiple
    if width <= _EXACT:
        return Signal(series, noise_std, 0.5 * series.period_s, *goes_with)
    value, around = search.laid(best)
    left = min(_LEFT[best.order] / width, 1.0)
    # white noise of the readings: all of its power at frequency 0 passes
    error_std = float(np.hypot(noise_std * np.sqrt(left), around))
    return Signal(Series(series.time_utc_ns, value), error_std, 0.5 * series.period_s / left, *goes_with)


class _Search:
    """The most likely signal among those that wander or bend, beside a shape or none."""

    def __init__(self, series: Series, shapes: Sequence[Float]) -> None:
        # time in periods of the readings, so that one list of widths serves every rate
        time = series.seconds_since(int(series.time_utc_ns[0])) / series.period_s
        self._floor = rounding_std(series) ** 2
        self._first_step = float(time[1] - time[0])
        self._columns = np.column_stack([series.value, *shapes])
        self._smoothers = {order: Smoother(time, self._columns, order) for order in _LEFT}
        widest = np.log(np.clip(len(series) / _PART_OF_SERIES, 1.0, _WIDEST))
        widths = np.arange(np.log(_NARROWEST), widest + _STEP, _STEP)
        candidates = [self.at(order, width) for order in _LEFT for width in widths]
        top = max(candidates, key=lambda candidate: candidate.log_likelihood)

        def unlikely(width: float) -> float:
            return -self.at(top.order, width).log_likelihood

        bounds = max(top.log_width - _STEP, widths[0]), min(top.log_width + _STEP, widths[-1])
        closer = minimize_scalar(unlikely, bounds=bounds, method="bounded", options={"xatol": 0.02})
        self.best = max(top, self.at(top.order, float(closer.x)), key=lambda candidate: candidate.log_likelihood)

    def at(self, order: int, log_width: float) -> _Candidate:
        """Return the likeliest multiple at one width.

        By how likely the readings are from the third on, after the first two, so that both orders compare; a shape
        costs one, as by Akaike.
        """
        penalty, smoother = _penalty(order, log_width), self._smoothers[order]
        white, log_det = smoother.whitened(penalty)
        count = white.shape[0]
        with_series, own = white[:, 0] @ white, np.einsum("ij,ij->j", white, white)
        # beside no shape there is no multiple
        multiples = np.where(own > 0.0, with_series / np.where(own > 0.0, own, 1.0), 0.0)
        multiples[0] = 0.0
        variances = np.maximum(own[0] - multiples * with_series, 0.0) / count
        possible = (own > 0.0) & (variances > self._floor)
        if not possible.any():
            return _Candidate(_IMPOSSIBLE, order, log_width, 0, 0.0, self._floor, 0.0)
        variance = np.where(possible, variances, 1.0)
        likely = -0.5 * (count * (np.log(2.0 * np.pi * variance) + 1.0) + log_det)
        likely[1:] -= 1.0
        if order == 1:
            first = smoother.differences[0]
            spread = variance * (2.0 + self._first_step / penalty)
            likely += 0.5 * (np.log(2.0 * np.pi * spread) + (first[0] - multiples * first) ** 2 / spread)
        best = int(np.argmax(np.where(possible, likely, -np.inf)))
        around = float(variances[best] / own[best])
        of_best = best, float(multiples[best]), float(variances[best]), around
        return _Candidate(float(likely[best]), order, log_width, *of_best)

    def laid(self, candidate: _Candidate) -> tuple[Float, float]:
        """Return the signal, shape (n,), and the standard error that the multiple brings in."""
        smooth = self._smoothers[candidate.order].smooth(_penalty(candidate.order, candidate.log_width))
        value: Float = smooth[:, 0]
        if not candidate.shape:
            return value, 0.0
        rough = self._columns[:, candidate.shape] - smooth[:, candidate.shape]
        return value + candidate.multiple * rough, float(np.sqrt(candidate.multiple_variance * np.mean(rough**2)))


def _penalty(order: int, log_width: float) -> float:
    """Return what the spline of a width pays, time in periods of the readings."""
    return float(np.exp(2.0 * order * log_width))
