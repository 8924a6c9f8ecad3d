"""The common time grid of one segment: every channel interpolated to shared instants, nothing invented across a gap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.schemas.units import SECOND_NS

#: Longest distance of two values of the speed, s: a log slower than this changes little in between.
LONGEST_SPEED_GAP_S = 60.0


@dataclass(frozen=True, eq=False)
class Grid:
    """Channels of one segment on shared instants."""

    #: Shape (n,).
    time_utc_ns: Nanoseconds
    #: Distance of the instants, s.
    step_s: float
    #: Shape (n,). SI values by name; NaN where the channel has a gap.
    columns: dict[str, Float]

    @property
    def seconds(self) -> Float:
        """Time since the first instant, s, shape (n,)."""
        since: Nanoseconds = self.time_utc_ns - self.time_utc_ns[0]
        return since.astype(np.float64) / SECOND_NS


def gap_limit_s(series: Series) -> float:
    """Return the longest distance of two values that still counts as sampled, s.

    Three median periods, and never under 1 s: a single lost sentence of a 5 Hz compass is no gap.
    """
    return max(3.0 * series.period_s, 1.0)


def make_grid(series: dict[str, Series], start_ns: int, end_ns: int, step_s: float) -> Grid:
    """Interpolate channels to a common grid.

    Angles in a `Series` are unwrapped, so linear interpolation is right for them; an instrument's own instants have
    been settled before (`kempf.pipeline.channels.instruments`).

    Parameters
    ----------
    series : dict of str to Series
        Channels by name.
    start_ns, end_ns : int
        Bounds, UTC ns, both included where the step allows.
    step_s : float
        Grid step, s.
    """
    step_ns = round(step_s * SECOND_NS)
    time = np.arange(start_ns, end_ns + 1, step_ns, dtype=np.int64)
    columns = {name: channel.at(time, gap_limit_s(channel)) for name, channel in series.items()}
    return Grid(time, step_ns / SECOND_NS, columns)
