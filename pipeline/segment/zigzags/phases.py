"""The phases of a zigzag, and its overshoots, measured on the heading between one execute and the next."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.segment.rudder.local_fit import value_and_rate
from kempf.pipeline.segment.rudder.measured import Signals
from kempf.pipeline.segment.zigzags.zigzag import PhaseName

#: Points at which the yaw rate of a leg is looked at.
_POINTS = 41

#: Share of the leg's largest yaw rate from which the yaw counts as steady.
_STEADY = 0.9


def leg_phases(
    signals: Signals,
    *,
    start_s: float,
    held_s: float,
    peak_s: float | None,
    end_s: float,
    side: int,
    window_s: float,
    first: bool,
) -> list[tuple[PhaseName, float, float]]:
    """Divide one leg into its phases.

    Parameters
    ----------
    signals : Signals
        Heading and rudder.
    start_s, held_s : float
        Execute, and when the rudder arrives, s.
    peak_s : float or None
        When the heading turns back; None where it does not within the leg.
    end_s : float
        The next execute, or the end of the zigzag, s.
    side : int
        Side of the rudder, +1 starboard.
    window_s : float
        Half width of the local cubic, s.
    first : bool
        Whether the leg starts from the approach.

    Returns
    -------
    list of (name, start, end)
        Without gap or overlap from ``start_s`` to ``end_s``, none of them empty.
    """
    held = min(held_s, end_s)
    grid = np.linspace(start_s, end_s, _POINTS)
    rate = side * np.array([value_and_rate(signals.heading_s, signals.heading, t, window_s)[1] for t in grid])
    rate = np.nan_to_num(rate, nan=0.0)
    steady = end_s
    if float(np.max(rate)) > 0:
        steady = float(grid[int(np.argmax(rate >= _STEADY * np.max(rate)))])
    swung = held if first else max(held, min(end_s if peak_s is None else peak_s, end_s))
    steady = max(steady, swung)
    build: PhaseName = "yaw_build_up" if first else "counter_rudder"
    parts: list[tuple[PhaseName, float, float]] = [
        ("execute", start_s, held),
        ("overshoot", held, swung),
        (build, swung, steady),
        ("steady_yaw", steady, end_s),
    ]
    return [part for part in parts if part[2] > part[1]]
