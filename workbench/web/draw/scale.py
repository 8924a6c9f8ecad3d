"""Axes: round numbers, and where they lie."""

from __future__ import annotations

from math import floor, log10


def ticks(low: float, high: float, most: int = 5) -> list[float]:
    """Return round numbers between two ends, at most so many; one number alone would be no scale, then it is one more.

    Examples
    --------
    >>> ticks(0.0, 1.0)
    [0.0, 0.5, 1.0]
    >>> ticks(-0.013, 0.02)
    [-0.01, 0.0, 0.01, 0.02]
    >>> ticks(-0.9, 0.95, 4), ticks(-4.9, 4.9, 4)
    ([-0.5, 0.0, 0.5], [-4.0, -2.0, 0.0, 2.0, 4.0])
    """
    span = high - low
    if not span > 0.0:
        return [low]
    ten = 10.0 ** floor(log10(span))
    steps = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0]
    place = next(k for k, s in enumerate(steps) if span / (s * ten) <= most - 1)
    found = _multiples(low, high, steps[place] * ten)
    return found if len(found) > 1 else _multiples(low, high, steps[place - 1] * ten)


def _multiples(low: float, high: float, step: float) -> list[float]:
    return [round(k * step, 12) for k in range(-floor(-low / step), floor(high / step + 1e-9) + 1)]
