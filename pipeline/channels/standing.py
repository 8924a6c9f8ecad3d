"""The rudder while its gear stands: one angle, of which every reading there says the same but for its noise.

Noise that goes into a fit as rudder is noise that the ship is asked to follow. Averaged over the time that the gear
stands it does as much to her in the long run, for its integral stays, and nothing from reading to reading.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import SECOND_NS, Float, Series

Places = NDArray[np.int64]

#: readings of which a mean is worth anything
_FEWEST = 4
#: of the noise between two readings: more than that is a move
_NOISES = 4.0
#: of the median period: a longer interval is a gap
_LONGEST = 1.5
#: standard errors by which readings may scatter more than their noise, or creep to one side, and still be one angle
_SURE = 3.0


def averaged_where_standing(rudder: Series, noise_std: float) -> Series:
    """Return the rudder with every reading of a standing gear replaced by their mean.

    Parameters
    ----------
    rudder : Series
        Rudder angle, rad.
    noise_std : float
        Standard deviation of the noise of one reading, rad.

    Returns
    -------
    Series
        At the same instants; the same where there is no noise, and wherever the gear moves or creeps.

    Examples
    --------
    >>> time = np.arange(0, 12) * 1_000_000_000
    >>> angle = np.array([0.01, -0.01, 0.01, -0.01, 0.01, 0.2, 0.41, 0.39, 0.41, 0.39, 0.41, 0.39])
    >>> averaged_where_standing(Series(time, angle), 0.01).value.round(3).tolist()
    [0.01, -0.01, 0.01, -0.01, 0.01, 0.2, 0.41, 0.4, 0.4, 0.4, 0.4, 0.39]
    """
    if len(rudder) < _FEWEST or not noise_std > 0.0:
        return rudder
    span = np.diff(rudder.time_utc_ns) / SECOND_NS
    still = (np.abs(np.diff(rudder.value)) <= _NOISES * np.sqrt(2.0) * noise_std) & (
        span <= _LONGEST * float(np.median(span))
    )
    # one number for every stretch of readings without a move between them; at its ends the gear may be moving already
    moves = np.concatenate([[True], ~still, [True]])
    inside = ~moves[1:] & ~moves[:-1]
    stretch = np.cumsum(moves[:-1]) - 1
    chosen = Series(rudder.time_utc_ns[inside], rudder.value[inside])
    mean = _means(chosen, stretch[inside], int(stretch[-1]) + 1, noise_std)[stretch]
    return Series(rudder.time_utc_ns, np.where(inside & np.isfinite(mean), mean, rudder.value))


def _means(rudder: Series, stretch: Places, many: int, noise_std: float) -> Float:
    """Return the one angle of every stretch, rad, shape (many,); NaN where it is none."""
    count = np.bincount(stretch, minlength=many).astype(np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        time = rudder.seconds_since(int(rudder.time_utc_ns[0])) if len(rudder) else np.zeros(0)
        mean, mid = (np.bincount(stretch, column, many) / count for column in (rudder.value, time))
    apart, later = rudder.value - mean[stretch], time - mid[stretch]
    scatter = np.bincount(stretch, apart**2, many) / noise_std**2
    moment, length = np.bincount(stretch, apart * later, many), np.bincount(stretch, later**2, many)
    freedom = np.maximum(count - 1.0, 0.0)
    creeps = np.abs(moment) > _SURE * noise_std * np.sqrt(length)
    wanders = scatter > freedom + _SURE * np.sqrt(2.0 * freedom)
    return np.where((count >= _FEWEST) & ~creeps & ~wanders, mean, np.nan)
