"""A segment on the common grid, as the paper's regression (11)-(14) wants it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.grid import make_grid
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.estimate.record.record import MEASUREMENTS, Record
from kempf.schemas.errors import DataRejected
from kempf.schemas.units import SECOND_NS

_MIN_PAIRS = 30


@dataclass(frozen=True, eq=False)
class Sampled:
    """Measurements and rudder at equal steps."""

    step_s: float
    #: Shape (n, 2). y_v of eq. (18), m/s, and y_r, rad/s; NaN across gaps.
    measured: Float
    #: Shape (n,). Mean rudder of the step that follows each instant, rad: the value which, held, does what the
    #: interpolated rudder does to second order. The value at the instant itself would feign a rudder lag of half a
    #: step.
    rudder: Float
    #: Mean speed; eq. (17) drops its variation.
    speed_m_s: float


def sample(record: Record, step_s: float | None) -> Sampled:
    """Put a record on a grid.

    Parameters
    ----------
    step_s : float or None
        Grid step, s; None takes the period of the GNSS, but no less than a tenth of a second.

    Raises
    ------
    DataRejected
        Fewer than 30 pairs of neighbouring instants hold every channel.
    """
    time_ns = np.round(record.time_s * SECOND_NS).astype(np.int64)
    series: dict[str, Series] = {"rudder": Series(time_ns, record.rudder_rad)}
    for i, name in enumerate(MEASUREMENTS):
        good = np.isfinite(record.measured[:, i])
        if good.any():
            series[name] = Series(time_ns[good], record.measured[good, i])
    step = max(series["lateral_speed"].period_s, 0.1) if step_s is None else step_s
    start = max(int(channel.time_utc_ns[0]) for channel in series.values())
    end = min(int(channel.time_utc_ns[-1]) for channel in series.values())
    grid = make_grid(series, start, end, step)
    yaw_rate = grid.columns["yaw_rate"] if "yaw_rate" in series else np.gradient(grid.columns["heading"], grid.step_s)
    rudder = grid.columns["rudder"]
    held = np.append(0.5 * (rudder[1:] + rudder[:-1]), rudder[-1])
    measured = np.column_stack([grid.columns["lateral_speed"], yaw_rate])
    whole = np.all(np.isfinite(measured), axis=1)
    pairs = int(np.count_nonzero(whole[1:] & whole[:-1]))
    if pairs < _MIN_PAIRS:
        raise DataRejected(
            "segment_too_short",
            f"The common grid of {step:g} s holds {pairs} pairs of whole samples, the regression needs {_MIN_PAIRS}.",
            "Choose a smaller step, or let the zigzag run for more legs.",
            {"pairs": pairs, "needed": _MIN_PAIRS, "step_s": step},
        )
    return Sampled(grid.step_s, measured, held, record.mean_speed_m_s)
