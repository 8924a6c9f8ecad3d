"""Legs: stretches over which the rudder is held to one side, and chains of legs that alternate.

What the heading does meanwhile is judged in `switching`; when exactly the rudder started to move, in `ramps`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.robust_std import robust_std
from kempf.pipeline.channels.series import Float
from kempf.pipeline.segment.settings import SegmentSettings

#: Ratio of neighbouring rudder angles in the search; the search band covers the ratio three times over.
_LADDER = 1.15

#: Longest interruption of one leg, as a share of the whole leg.
_INTERRUPTION = 0.3

#: Rudder angles no farther apart than this are the same order, rad.
_SAME_RAD = float(np.deg2rad(0.3))

#: Smallest share of a leg's samples that lie in the band.
_INSIDE = 0.6


@dataclass(frozen=True)
class Leg:
    """The rudder held to one side."""

    #: first, last: First and last held sample of the rudder series.
    first: int
    last: int
    #: +1 starboard, -1 port.
    side: int
    #: Median of the held rudder, rad.
    rudder: float
    #: start_s, end_s: Instants of both samples, s.
    start_s: float
    end_s: float

    @property
    def duration_s(self) -> float:
        """Time for which the rudder is held, s."""
        return self.end_s - self.start_s


def noise_level(values: Float) -> float:
    """Estimate the standard deviation of the measurement noise from second differences, robustly.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Samples of a quantity that is held or moves steadily most of the time.

    Returns
    -------
    float
        Standard deviation in the unit of the values, at least half of their resolution; 0 for fewer than three.
    """
    if values.size < 3:
        return 0.0
    steps = np.abs(np.diff(values))
    moved = steps[steps > 1e-9]
    resolution = float(np.min(moved)) if moved.size else 0.0
    return max(float(robust_std(np.diff(values, 2)) / np.sqrt(6.0)), resolution / 2)


def _held_legs(time_s: Float, rudder: Float, amplitude: float, offset: float, band: float) -> list[Leg]:
    """Find the stretches over which the rudder is held near ``offset +- amplitude``."""
    deviation = rudder - offset
    inside = np.flatnonzero(np.abs(np.abs(deviation) - amplitude) <= band)
    if inside.size < 2:
        return []
    side = np.sign(deviation[inside]).astype(np.int64)
    legs: list[Leg] = []
    for group in np.split(inside, np.flatnonzero(np.diff(side)) + 1):
        if group.size < 2:
            continue
        for piece in _uninterrupted(time_s, group):
            first, last = int(piece[0]), int(piece[-1])
            if piece.size < 2 or piece.size < _INSIDE * (last - first + 1):
                continue
            legs.append(
                Leg(
                    first=first,
                    last=last,
                    side=int(np.sign(deviation[first])),
                    rudder=float(np.median(rudder[piece])),
                    start_s=float(time_s[first]),
                    end_s=float(time_s[last]),
                )
            )
    return legs


def _uninterrupted(time_s: Float, held: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Split held samples at their longest interruption until none is long for the leg it stands in."""
    pieces: list[NDArray[np.int64]] = []
    waiting = [held]
    while waiting:
        piece = waiting.pop()
        gaps = np.diff(time_s[piece])
        cut = int(np.argmax(gaps)) + 1 if gaps.size else 0
        if cut and gaps[cut - 1] > _INTERRUPTION * (time_s[piece[-1]] - time_s[piece[0]]) and piece.size > 2:
            waiting += [piece[cut:], piece[:cut]]
        else:
            pieces.append(piece)
    return pieces


def _linked(before: Leg, after: Leg) -> bool:
    """Whether the second leg follows the first by one movement of the rudder rather than after a pause."""
    return before.side != after.side and after.start_s - before.end_s <= max(before.duration_s, after.duration_s)


def _chains_of(legs: list[Leg], settings: SegmentSettings, noise: float) -> list[list[Leg]]:
    """Join legs that alternate, are held at the same angle on each side, and follow each other by one movement."""
    chains: list[list[Leg]] = []
    current: list[Leg] = []
    for leg in legs:
        if current and not _linked(current[-1], leg):
            chains.append(current)
            current = []
        current.append(leg)
    chains.append(current)
    return [part for chain in chains for part in _alike(chain, settings, noise) if len(part) > 1]


def _alike(chain: list[Leg], settings: SegmentSettings, noise: float) -> list[list[Leg]]:
    """Split a chain where a leg's rudder, or the time the rudder takes to move, differs from the others'."""
    if len(chain) < 2:
        return []
    angle = np.array([leg.rudder for leg in chain])
    side = np.array([leg.side for leg in chain])
    starboard, port = float(np.median(angle[side > 0])), float(np.median(angle[side < 0]))
    amplitude = (starboard - port) / 2
    fits = np.abs(angle - np.where(side > 0, starboard, port)) <= max(
        settings.rudder_scatter * amplitude, 2.5 * noise, _SAME_RAD
    )
    moving = np.array([b.start_s - a.end_s for a, b in pairwise(chain)])
    # the steering gear moves at one rate: a much longer movement holds a pause
    quick = moving <= 2.5 * np.median(moving) + min(leg.duration_s for leg in chain) / 4
    parts: list[list[Leg]] = [[]]
    for k, leg in enumerate(chain):
        if k and not (quick[k - 1] and fits[k] and fits[k - 1]):
            parts.append([])
        parts[-1].append(leg)
    return parts


def find_chains(time_s: Float, rudder: Float, settings: SegmentSettings) -> list[list[Leg]]:
    """Find all chains of alternating legs, whatever their rudder angle.

    Each angle of a ladder is tried with a wide band; the chains found are looked for again with a narrow band about the
    angles at which the rudder was in fact held.

    Parameters
    ----------
    time_s, rudder : ndarray, shape (n,)
        Samples, s and rad.
    settings : SegmentSettings
        Thresholds.

    Returns
    -------
    list of list of Leg
        Chains that may overlap each other, each one once.
    """
    noise = noise_level(rudder)
    slack = max(4.0 * noise, np.deg2rad(settings.held_slack_deg))
    low, high = np.deg2rad([settings.smallest_rudder_deg, settings.largest_rudder_deg])
    low = max(float(low), 4.0 * noise)  # a rudder that drowns in its noise cannot be seen to be held
    steps = int(np.ceil(np.log(high / low) / np.log(_LADDER))) if high > low else -1
    chains: dict[tuple[tuple[int, int], ...], list[Leg]] = {}
    for amplitude in low * _LADDER ** np.arange(steps + 1):
        rough = _held_legs(time_s, rudder, float(amplitude), 0.0, settings.search_band * float(amplitude))
        levels = {_levels(chain) for chain in _chains_of(rough, settings, noise)}
        for starboard, port in sorted(levels):
            half, offset = (starboard - port) / 2, (starboard + port) / 2
            band = min(max(settings.held_band * half, slack), settings.search_band * half)
            for chain in _chains_of(_held_legs(time_s, rudder, half, offset, band), settings, noise):
                chains.setdefault(tuple((leg.first, leg.last) for leg in chain), chain)
    return list(chains.values())


def _levels(chain: list[Leg]) -> tuple[float, float]:
    """Return the angles held to starboard and to port, rad, rounded so that equal ones are tried once."""
    return (
        round(float(np.median([leg.rudder for leg in chain if leg.side > 0])), 3),
        round(float(np.median([leg.rudder for leg in chain if leg.side < 0])), 3),
    )
