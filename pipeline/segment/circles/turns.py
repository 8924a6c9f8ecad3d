"""Turns: where the heading goes one way through a large angle. The rudder is not looked at here.

A voyage holds few of them, so that what is costly is done about them only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float

#: The heading is followed in steps of this size, and a turn is over where it has gone back by two, rad.
_STEP_RAD = float(np.deg2rad(5.0))

#: Of a longer record only so many samples are looked at: turns of a voyage last longer than their distance.
_ENOUGH = 200_000


@dataclass(frozen=True)
class Turn:
    """One way of the heading, between two reversals."""

    #: start_s, end_s: Between the straight courses or reversals before and behind it, to within 5 deg of heading, s.
    start_s: float
    end_s: float
    #: Heading change, starboard positive, rad.
    change: float


def find_turns(heading_s: Float, heading: Float, smallest_rad: float) -> list[Turn]:
    """Find all turns of a heading.

    Parameters
    ----------
    heading_s, heading : ndarray, shape (n,)
        Instants, s, and unwrapped heading, rad.
    smallest_rad : float
        Smallest change that counts.

    Returns
    -------
    list of Turn
        In order of time.
    """
    if heading_s.size < 2:
        return []
    thinned = slice(None, None, max(heading_s.size // _ENOUGH, 1))
    heading_s, heading = heading_s[thinned], heading[thinned]
    level = np.floor(heading / _STEP_RAD)
    moved = np.concatenate([[0], np.flatnonzero(np.diff(level)) + 1, [level.size - 1]])
    turns: list[Turn] = []
    begin = farthest = int(moved[0])
    way = 0.0
    for k in moved.tolist():
        ahead = float(level[k] - level[farthest])
        if way == 0.0:
            if abs(level[k] - level[begin]) >= 2:
                way, farthest = float(np.sign(level[k] - level[begin])), k
        elif way * ahead > 0:
            farthest = k
        elif way * ahead <= -2:
            turns.append(_turn(heading_s, heading, begin, farthest))
            begin, farthest, way = farthest, k, -way
    turns.append(_turn(heading_s, heading, begin, int(moved[-1]) if way == 0.0 else max(farthest, begin)))
    return [turn for turn in turns if abs(turn.change) >= smallest_rad]


def _turn(heading_s: Float, heading: Float, first: int, last: int) -> Turn:
    """Return a turn without the straight courses before and behind it."""
    way = np.sign(heading[last] - heading[first])
    turned = way * (heading[first : last + 1] - heading[first])
    at_first, at_last = np.flatnonzero(turned <= _STEP_RAD), np.flatnonzero(turned >= turned[-1] - _STEP_RAD)
    if at_last[0] > at_first[-1]:
        first, last = first + int(at_first[-1]), first + int(at_last[0])
    return Turn(float(heading_s[first]), float(heading_s[last]), float(heading[last] - heading[first]))


def regions(turns: list[Turn], begin_s: float, end_s: float) -> list[tuple[float, float]]:
    """Return the parts of a record about its turns, with their own length before and behind; those that meet join.

    Parameters
    ----------
    turns : list of Turn
        In order of time.
    begin_s, end_s : float
        Bounds of the record, s.

    Returns
    -------
    list of (start, end)
        Instants, s, in order of time and without overlap.
    """
    joined: list[tuple[float, float]] = []
    for turn in turns:
        span = turn.end_s - turn.start_s
        start, end = max(turn.start_s - span, begin_s), min(turn.end_s + span, end_s)
        if joined and start <= joined[-1][1]:
            joined[-1] = (min(start, joined[-1][0]), max(end, joined[-1][1]))
        else:
            joined.append((start, end))
    return joined
