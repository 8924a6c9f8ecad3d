"""Stretches over which the rudder is held at one angle, whatever the angle.

`legs` looks for two angles that alternate; here each stretch stands for itself, as in a turning circle, a pull-out or
the steps of a spiral.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from kempf.pipeline.channels.series import Float

#: Half width of the band about the held angle, as a share of it and at least, rad. A helmsman who steers an angle and a
#: pump that lets the rudder creep stay within it.
_SHARE = 0.05
_SLACK_RAD = float(np.deg2rad(0.5))

#: The same in standard deviations of the rudder's noise.
_NOISES = 4.0

#: Samples in a row outside the band that do not end a stretch.
_OUTLIERS = 2


@dataclass(frozen=True)
class HeldRudder:
    """The rudder held at one angle."""

    #: first, last: First and last held sample of the rudder series.
    first: int
    last: int
    #: Median of the held rudder, rad.
    rudder: float
    #: start_s, end_s: Instants of both samples, s.
    start_s: float
    end_s: float

    @property
    def duration_s(self) -> float:
        """Time for which the rudder is held, s."""
        return self.end_s - self.start_s


def band(rudder: float, noise: float) -> float:
    """Return how far a held rudder may lie from its angle, rad.

    Parameters
    ----------
    rudder : float
        The angle, rad.
    noise : float
        Standard deviation of the rudder's noise, rad.
    """
    return max(_SHARE * abs(rudder), _SLACK_RAD, _NOISES * noise)


def held_stretches(rudder_s: Float, rudder: Float, first: int, end: int, noise: float) -> list[HeldRudder]:
    """Divide a part of a rudder's record into stretches at one angle; what the rudder passes is left out.

    Parameters
    ----------
    rudder_s, rudder : ndarray, shape (n,)
        Instants, s, and rudder, rad.
    first, end : int
        The part: its first sample and the one behind its last.
    noise : float
        Standard deviation of the rudder's noise, rad.

    Returns
    -------
    list of HeldRudder
        In order of time; each of five samples at least. One over which the rudder creeps on is none.
    """
    values = rudder[first:end].tolist()
    pieces: list[tuple[int, int]] = []
    begin, total, count, outside, last = 0, 0.0, 0, 0, 0
    k = 0
    while k < len(values):
        level = total / count if count else values[k]
        if abs(values[k] - level) <= band(level, noise):
            total, count, outside, last = total + values[k], count + 1, 0, k
        else:
            outside += 1
            if outside > _OUTLIERS:
                pieces.append((begin, last))
                # what follows begins with the first sample that lay outside
                k = begin = last = k - _OUTLIERS
                total, count, outside = values[k], 1, 0
        k += 1
    if values:
        pieces.append((begin, last))
    stretches = [_held(rudder_s, rudder, first + a, first + b) for a, b in pieces if b - a >= 4]
    return [stretch for stretch in _joined(rudder_s, rudder, stretches, noise) if _at_rest(rudder, stretch, noise)]


def _held(rudder_s: Float, rudder: Float, first: int, last: int) -> HeldRudder:
    level = float(np.median(rudder[first : last + 1]))
    return HeldRudder(first, last, level, float(rudder_s[first]), float(rudder_s[last]))


def _joined(rudder_s: Float, rudder: Float, stretches: list[HeldRudder], noise: float) -> list[HeldRudder]:
    """Join neighbours at the same angle, as where the rudder was touched for a moment; trim what leads up to them."""
    joined: list[HeldRudder] = []
    for stretch in stretches:
        before = joined[-1] if joined else None
        gap = stretch.start_s - before.end_s if before else inf
        if (
            before is not None
            and abs(stretch.rudder - before.rudder) <= band(before.rudder, noise) / 2
            and gap <= 0.1 * min(before.duration_s, stretch.duration_s)
        ):
            joined[-1] = _held(rudder_s, rudder, before.first, stretch.last)
        else:
            joined.append(stretch)
    return [_trimmed(rudder_s, rudder, stretch, noise) for stretch in joined]


def _at_rest(rudder: Float, stretch: HeldRudder, noise: float) -> bool:
    """Whether the rudder ends where it began: one that moves slowly stays in a band for a while, too."""
    held = rudder[stretch.first : stretch.last + 1]
    part = max(held.size // 4, 1)
    crept = abs(float(np.median(held[-part:]) - np.median(held[:part])))
    return crept <= band(stretch.rudder, noise) / 2


def _trimmed(rudder_s: Float, rudder: Float, stretch: HeldRudder, noise: float) -> HeldRudder:
    """Begin and end a stretch with samples at its angle: the running mean lets the end of a movement in."""
    near = np.flatnonzero(
        np.abs(rudder[stretch.first : stretch.last + 1] - stretch.rudder) <= band(stretch.rudder, noise) / 2
    )
    if near.size < 2:
        return stretch
    return _held(rudder_s, rudder, stretch.first + int(near[0]), stretch.first + int(near[-1]))
