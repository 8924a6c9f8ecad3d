"""GNSS jumps: stretches in which the velocity leaps away and later back, as it does behind a bridge or at a new fix.

Single wild readings show in the prediction errors of a fitted model (`pipeline.estimate.gating`). A stretch of them
does not: a model with a slow current follows the leap, and only its two edges look wrong. So stretches are taken out
before anything is fitted, by what no ship can do: change her velocity from one reading to the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.lateral_speed import LateralSpeed, noise_std
from kempf.pipeline.channels.robust_std import MAD_TO_STD
from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.schemas.units import SECOND_NS

#: a change beyond so many robust standard deviations of the changes over such a time is a leap
_LEAP = 6.0
#: and if it is so many times the changes beside it, so many readings on either side
_SUDDEN, _BESIDE = 4.0, 3
#: a stretch is at most so long, and all of them at most this share of the readings; else it is no gross error
_LONGEST_S = 90.0
_LARGEST_SHARE = 0.2
_FEWEST = 20
#: a velocity that is broken more often than this is broken for another reason
_MOST_BREAKS = 250


@dataclass(frozen=True, eq=False)
class Jumps:
    """Readings of the GNSS velocity that lie in jumps."""

    #: Shape (n,).
    inside: NDArray[np.bool_]
    #: Leaps where so much would have to go, or so little, that it is unknown which side of them is right; none is taken
    #: out then.
    unresolved: int


def find_jumps(lateral: LateralSpeed) -> Jumps:
    """Find the stretches in which the velocity leaps away and back.

    The velocity along and across the bow, where the ship's own turning does not show, falls into pieces at its leaps.
    The longest chain of pieces that go on from each other, one perhaps some time after the other, is what the ship
    did; the rest are jumps.

    Parameters
    ----------
    lateral : LateralSpeed
        Of one segment.

    References
    ----------
    Basseville & Nikiforov (1993), Detection of Abrupt Changes, ch. 2: a leap in the mean against a robust scale.
    """
    inside = np.zeros(lateral.time_utc_ns.size, dtype=np.bool_)
    known = np.flatnonzero(np.isfinite(lateral.value_m_s))
    if known.size < _FEWEST:
        return Jumps(inside, 0)
    motion = _Motion(
        lateral.time_utc_ns[known], np.column_stack([lateral.forward_m_s[known], lateral.value_m_s[known]])
    )
    breaks, leaps = motion.breaks()
    if leaps.size == 0:
        return Jumps(inside, 0)
    edges = np.concatenate([[0], breaks + 1, [known.size]])
    wild = np.ones(known.size, dtype=np.bool_)
    for piece in _longest_chain(motion, edges) if breaks.size <= _MOST_BREAKS else ():
        wild[edges[piece] : edges[piece + 1]] = False
    _spare_smooth(wild, leaps)
    if np.count_nonzero(wild) > _LARGEST_SHARE * known.size or not wild.any():
        return Jumps(inside, int(leaps.size))
    inside[known[wild]] = True
    return Jumps(inside, 0)


def _spare_smooth(wild: NDArray[np.bool_], leaps: NDArray[np.intp]) -> None:
    """Keep the stretches that the velocity neither leaps into nor out of."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], wild, [False]]).astype(np.int8)))
    for first, end in edges.reshape(-1, 2):
        if not np.any((leaps >= first - 1) & (leaps < end)):
            wild[first:end] = False


class _Motion:
    """What the velocity of this ship, and the noise of this receiver, do within a time.

    Parameters
    ----------
    time_ns : ndarray, shape (n,)
    velocity : ndarray, shape (n, 2)
        Along and across the bow, m/s.
    """

    def __init__(self, time_ns: Nanoseconds, velocity: Float) -> None:
        self.time_ns, self.velocity = time_ns, velocity
        self._period_ns = float(np.median(np.diff(time_ns)))
        self._noise = np.array([noise_std(Series(time_ns, column)) for column in velocity.T])
        self._limits: dict[int, Float] = {}

    def breaks(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the readings that the next one does not go on from, and those of them where it leaps away.

        Without noise a ship's quickest changes are far from the usual too, but then she goes on changing.
        """
        change = np.abs(np.diff(self.velocity, axis=0))
        far = np.flatnonzero(np.any(change > self._limit(1), axis=1))
        breaks = np.array([k for k in far if not self.goes_on(int(k), int(k) + 1)], dtype=np.intp)
        padded = np.pad(change, ((_BESIDE, _BESIDE), (0, 0)), mode="reflect")
        beside = [np.median(np.delete(padded[k : k + 2 * _BESIDE + 1], _BESIDE, axis=0), axis=0) for k in breaks]
        sudden = [
            np.any(change[k] > np.maximum(self._limit(1), _SUDDEN * b)) for k, b in zip(breaks, beside, strict=True)
        ]
        return breaks, breaks[np.array(sudden, dtype=np.bool_)]

    def goes_on(self, first: int, second: int) -> bool:
        """Whether one reading can follow another, however much later within the longest stretch."""
        apart_ns = int(self.time_ns[second] - self.time_ns[first])
        if apart_ns > _LONGEST_S * SECOND_NS and second > first + 1:
            return False
        change = np.abs(self.velocity[second] - self.velocity[first])
        return bool(np.all(change <= self._limit(max(1, round(apart_ns / self._period_ns)))))

    def _limit(self, readings: int) -> Float:
        """Return the largest change within so many readings that motion and noise explain, shape (2,), m/s."""
        if readings in self._limits:
            return self._limits[readings]
        lag = min(readings, self.velocity.shape[0] // 2)
        change = np.abs(self.velocity[lag:] - self.velocity[:-lag])
        spread = MAD_TO_STD * np.median(change, axis=0)
        self._limits[readings] = _LEAP * np.maximum(spread, np.sqrt(2.0) * self._noise)
        return self._limits[readings]


def _longest_chain(motion: _Motion, edges: NDArray[np.intp]) -> list[int]:
    """Return the pieces of the chain that holds most readings, in order; ``edges`` bound the pieces."""
    pieces = edges.size - 1
    held = np.diff(edges).astype(np.int64)
    before = np.full(pieces, -1, dtype=np.int64)
    for j in range(pieces):
        own = int(held[j])
        for i in range(j - 1, -1, -1):
            if own + held[i] > held[j] and motion.goes_on(int(edges[i + 1]) - 1, int(edges[j])):
                held[j], before[j] = own + held[i], i
    chain = [int(np.argmax(held))]
    while before[chain[-1]] >= 0:
        chain.append(int(before[chain[-1]]))
    return chain[::-1]
