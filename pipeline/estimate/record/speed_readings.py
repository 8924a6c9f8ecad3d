"""What the speed log of a segment read, its noise in it: whoever regresses on the speed needs errors that are its own.

The speed that the filters take has its noise smoothed away, by what turning costs among others. A regression on it
takes what the smoothing left for signal, and its errors for smaller than they are.
"""

from __future__ import annotations

from dataclasses import dataclass

from kempf.pipeline.channels.series import Float


@dataclass(frozen=True, eq=False)
class SpeedReadings:
    """Readings of the speed through the water, over ground along the bow where there is no log."""

    #: Shape (m,). Instants from the beginning of the segment, s.
    time_s: Float
    #: Shape (m,). Without spikes.
    speed_m_s: Float
    #: Time over which each is a mean, about its instant, s; 0 where it is of the instant.
    mean_s: float = 0.0
