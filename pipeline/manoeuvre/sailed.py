"""What one ship did in one manoeuvre: figures to compare, a curve to draw, how far out she went."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.manoeuvre import motion
from kempf.pipeline.manoeuvre.ship import SailedTrack, Ship

#: rows that a curve is thinned to
_DRAWN = 400


@dataclass(frozen=True)
class Reach:
    """How far out a manoeuvre, or a log, goes; NaN where it is not known."""

    #: Largest |v / V|, as an angle, rad.
    drift_rad: float
    #: Largest |r| L / V.
    yaw_rate: float
    #: Largest |rudder|, rad.
    rudder_rad: float
    #: slowest_m_s, fastest_m_s: Forward speed.
    slowest_m_s: float
    fastest_m_s: float


@dataclass(frozen=True, eq=False)
class Sailed:
    """What one ship did."""

    #: By name; a list of figures of one name has numbers behind it, ``overshoots_deg.0``. NaN where there is none.
    figures: Mapping[str, float]
    #: Shape (n, k). What is drawn of it; the columns are the manoeuvre's own.
    curve: Float
    reach: Reach


class Manoeuvre(Protocol):
    """What can be sailed."""

    @property
    def name(self) -> str:
        """As the command line has it."""

    def sailed(self, ship: Ship) -> Sailed | None:
        """Sail it; None where she is no ship: she runs away, or never comes to where the manoeuvre ends."""


def reach_of(track: SailedTrack, length_m: float) -> Reach:
    """Return how far out a track goes."""
    forward, lateral = track.column(motion.FORWARD), track.column(motion.LATERAL)
    return Reach(
        float(np.max(np.arctan2(np.abs(lateral), forward))),
        float(np.max(np.abs(track.column(motion.RATE)) * length_m / forward)),
        float(np.max(np.abs(track.column(motion.RUDDER)))),
        float(np.min(forward)),
        float(np.max(forward)),
    )


def thinned(columns: Float) -> Float:
    """Return a curve with few rows, the first and the last among them."""
    n = columns.shape[0]
    kept: Float = columns[np.unique(np.linspace(0, n - 1, min(n, _DRAWN)).round().astype(int))]
    return kept
