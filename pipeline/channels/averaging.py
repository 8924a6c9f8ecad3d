"""How many readings a log's mean goes over: a mean of the last few seconds has gaps in the spectrum of its noise.

Noise that merely lasts has none: it sinks steadily towards short times. So the two are distinguished, and a log that
averages is known by itself, whatever the ship does.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from kempf.pipeline.channels.series import Float, Series

#: readings that are needed, and the longest mean that is looked for, in readings
_FEWEST, _LONGEST = 240, 40
#: part of the spectrum in which a ship's own changes of speed are, in Nyquist's frequencies
_OWN = 0.2
#: noise that is not averaged, such as rounding, over that which is, as tried
_FRESH = (0.001, 0.01, 0.03, 0.1)
#: what lasting noise keeps from one reading to the next, as tried
_KEPT = np.linspace(0.0, 0.95, 20)
#: log-likelihood by which a mean must say more than any noise that lasts; where none averages it says up to 4 more
_LEAST_GAIN = 25.0
#: parts of the spectrum, each of which but the slowest it must fit, and by how many standard errors it may miss one:
#: where the ship's own changes of speed are above the noise, every shape misses
_PARTS, _MISSES = 8, 4.0
#: part of the ordinates of a tapered periodogram that are independent
_INDEPENDENT = 2.0 / 3.0
#: share of readings that may be missing
_LOST = 0.02


def readings_averaged(log: Series) -> float:
    """Return over how many readings a series is a running mean; 1 for none.

    A mean over a time holds now one reading more, now one less: then it is the mean of both numbers.

    Parameters
    ----------
    log : Series
        Of any unit, sampled evenly.

    References
    ----------
    Whittle (1953), "Estimation and information in stationary time series", Arkiv för Matematik 2: the likelihood of a
    spectrum by the periodogram.
    """
    n = len(log)
    if n < _FEWEST or n * log.period_s < (1.0 - _LOST) * (log.time_utc_ns[-1] - log.time_utc_ns[0]) * 1e-9:
        return 1.0
    # differences take away the ship's own slow changes, whose leakage would fill the gaps
    rough = np.diff(log.value, n=3)
    power = np.abs(np.fft.rfft(rough * np.hanning(rough.size))) ** 2
    frequency = np.arange(power.size) / rough.size
    kept = frequency > 0.5 * _OWN
    w = 2.0 * np.pi * frequency[kept]
    power = power[kept] / (2.0 * np.sin(0.5 * w)) ** 6
    if not np.all(power > 0.0):
        return 1.0
    lasting = max(_likelihood(power, shape) for shape in _lasting(w))
    means = [_mean(w, many) for many in range(2, _LONGEST + 1)]
    lengths = {2.0 + k: mean for k, mean in enumerate(means)}
    lengths |= {2.5 + k: 0.5 * (shorter + longer) for k, (shorter, longer) in enumerate(pairwise(means))}
    shapes = ((many, shape + fresh) for many, shape in lengths.items() for fresh in _FRESH)
    best, shape = max(shapes, key=lambda candidate: _likelihood(power, candidate[1]))
    return best if _likelihood(power, shape) > lasting + _LEAST_GAIN and _fits(power, shape) else 1.0


def _mean(w: Float, many: int) -> Float:
    """Return the share of white noise that a running mean lets through."""
    passed: Float = (np.sin(0.5 * many * w) / (many * np.sin(0.5 * w))) ** 2
    return passed


def _lasting(w: Float) -> list[Float]:
    """Return spectra of noise of first order, alone and with fresh noise on it."""
    shapes = [(1.0 - a) ** 2 / (1.0 - 2.0 * a * np.cos(w) + a * a) for a in _KEPT]
    return [shape + fresh for shape in shapes for fresh in (0.0, *_FRESH)]


def _fits(power: Float, shape: Float) -> bool:
    """Return whether a shape fits a spectrum in all of its parts, but for the one where most of the ship's own is."""
    parts = np.array_split(power / shape, _PARTS)[1:]
    usual = np.mean(np.concatenate(parts))
    return all(abs(np.mean(part) / usual - 1.0) * np.sqrt(_INDEPENDENT * part.size) < _MISSES for part in parts)


def _likelihood(power: Float, shape: Float) -> float:
    """Return the log-likelihood of a spectrum of this shape and the size that suits best.

    A tapered periodogram has neighbours that resemble each other: two of three ordinates count.
    """
    size = float(np.mean(power / shape))
    return -_INDEPENDENT * float(np.sum(np.log(shape)) + power.size * np.log(size))
