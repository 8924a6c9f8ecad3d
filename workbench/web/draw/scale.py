"""Axes: round numbers, and where they lie."""

from __future__ import annotations

from math import floor, log10


def ticks(low: float, high: float, most: int = 5) -> list[float]:
    """Return round numbers between two ends, at most so many.

    Examples
    --------
    >>> ticks(0.0, 1.0)
    [0.0, 0.5, 1.0]
    >>> ticks(-0.013, 0.02)
    [-0.01, 0.0, 0.01, 0.02]
    """
    span = high - low
    if not span > 0.0:
        return [low]
    ten = 10.0 ** floor(log10(span))
    step = next(s * ten for s in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0) if span / (s * ten) <= most - 1)
    first = -floor(-low / step)
    return [round(k * step, 12) for k in range(first, floor(high / step + 1e-9) + 1)]
