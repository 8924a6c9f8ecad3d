"""The rudder without the noise of its readings: one angle while its gear stands, a smooth course while it creeps.

Noise that goes into a fit as rudder is noise that the ship is asked to follow. Averaged over the time that the gear
stands it does as much to her in the long run, for its integral stays, and nothing from reading to reading. Where a play
is between gear and rudder the largest reading alone would decide where the rudder is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.channels.signal import signal
from kempf.schemas.units import SECOND_NS

Places = NDArray[np.int64]

#: readings of which a mean is worth anything
_FEWEST = 4
#: of the noise between two readings: more than that is a move
_NOISES = 4.0
#: of the median period: a longer interval is a gap
_LONGEST = 1.5
#: standard errors by which readings may scatter more than their noise, or creep to one side, and still be one angle
_SURE = 3.0


def without_noise(rudder: Series, noise_std: float) -> Series:
    """Return the rudder with every reading of a standing gear replaced by their mean, of a creeping one by its course.

    A creeping gear is a helmsman's or an autopilot's, who move it by no more than the noise from reading to reading.

    Parameters
    ----------
    rudder : Series
        Rudder angle, rad.
    noise_std : float
        Standard deviation of the noise of one reading, rad.

    Returns
    -------
    Series
        At the same instants; the same where there is no noise, and while the gear runs, but for readings that noise
        alone leads beyond the two angles at which it then stands.

    Examples
    --------
    >>> time = np.arange(0, 12) * 1_000_000_000
    >>> angle = np.array([0.01, -0.01, 0.01, -0.01, 0.01, 0.2, 0.41, 0.39, 0.41, 0.39, 0.41, 0.39])
    >>> without_noise(Series(time, angle), 0.01).value.round(3).tolist()
    [0.01, -0.01, 0.01, -0.01, 0.01, 0.2, 0.41, 0.4, 0.4, 0.4, 0.4, 0.39]
    """
    if len(rudder) < _FEWEST or not noise_std > 0.0:
        return rudder
    span = np.diff(rudder.time_utc_ns) / SECOND_NS
    gap = span > _LONGEST * float(np.median(span))
    still = (np.abs(np.diff(rudder.value)) <= _NOISES * np.sqrt(2.0) * noise_std) & ~gap
    # one number for every stretch of readings without a move between them; at its ends the gear may be moving already
    moves = np.concatenate([[True], ~still, [True]])
    inside = ~moves[1:] & ~moves[:-1]
    stretch = np.cumsum(moves[:-1]) - 1
    chosen = Series(rudder.time_utc_ns[inside], rudder.value[inside])
    mean = _means(chosen, stretch[inside], int(stretch[-1]) + 1, noise_std)[stretch]
    stands = inside & np.isfinite(mean)
    angle = np.where(stands, mean, rudder.value)
    creeping = np.flatnonzero(inside & ~stands)
    for own in np.split(creeping, np.flatnonzero(np.diff(stretch[creeping])) + 1):
        angle[own] = signal(Series(rudder.time_utc_ns[own], rudder.value[own])).series.value
    behind_gap = np.concatenate([[False], gap])
    return Series(rudder.time_utc_ns, _between_stands(angle, stands, behind_gap, _NOISES * noise_std))


def _between_stands(angle: Float, stands: NDArray[np.bool_], behind_gap: NDArray[np.bool_], noise: float) -> Float:
    """Return the angle without what noise alone leads beyond the two stands that a move goes between.

    A gear goes from stand to stand without turning back. Where a play is between it and the rudder, one reading beyond
    the stand pushes the rudder for as long as the gear then stands.
    """
    place = np.flatnonzero(stands)
    move = np.searchsorted(place, np.arange(angle.size))
    between = ~stands & (move > 0) & (move < place.size)
    if not between.any():
        return angle
    ends = np.stack([angle[place[move[between] - 1]], angle[place[move[between]]]])
    low, high = (np.zeros(angle.size) for _ in range(2))
    low[between], high[between] = ends.min(axis=0), ends.max(axis=0)
    # of a move that did go further, and over a gap, nothing is known
    further = between & ((angle < low - noise) | (angle > high + noise))
    unknown = np.bincount(move, further | behind_gap, place.size + 1) > 0
    return np.where(between & ~unknown[move], np.clip(angle, low, high), angle)


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
