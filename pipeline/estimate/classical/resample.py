"""A record at equal steps, as estimators that live in discrete time want it; a record itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kempf.pipeline.channels.grid import make_grid
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.estimate.record.record import MEASUREMENTS, Record
from kempf.schemas.errors import DataRejected
from kempf.schemas.units import SECOND_NS

_MIN_WHOLE = 60


def even(record: Record, step_s: float | None) -> Record:
    """Interpolate a record to equal steps; no value is invented across a gap.

    Parameters
    ----------
    step_s : float or None
        Step, s; None takes the period of the GNSS, but no less than a tenth of a second.

    Returns
    -------
    Record
        Instants one step apart. Where nothing measures the yaw rate, the slope of the heading stands for it: the
        methods in this package regress on a measured state.

    Raises
    ------
    DataRejected
        Fewer than 60 instants hold both lateral speed and yaw rate.
    """
    time_ns = np.round(record.time_s * SECOND_NS).astype(np.int64)
    series: dict[str, Series] = {}
    for i, name in enumerate(MEASUREMENTS):
        good = np.isfinite(record.measured[:, i])
        if good.any():
            series[name] = Series(time_ns[good], record.measured[good, i])
    step = max(series["lateral_speed"].period_s, 0.1) if step_s is None else step_s
    start = max(int(channel.time_utc_ns[0]) for channel in series.values())
    end = min(int(channel.time_utc_ns[-1]) for channel in series.values())
    grid = make_grid(series, start, end, step)
    measured = np.full((grid.time_utc_ns.size, len(MEASUREMENTS)), np.nan)
    for i, name in enumerate(MEASUREMENTS):
        if name in series:
            measured[:, i] = grid.columns[name]
    if "yaw_rate" not in series and measured.shape[0] > 1:
        measured[:, 1] = np.gradient(measured[:, 2], grid.step_s)
    whole = int(np.count_nonzero(np.all(np.isfinite(measured[:, :2]), axis=1)))
    if whole < _MIN_WHOLE:
        raise DataRejected(
            "segment_too_short",
            f"At steps of {step:g} s the segment holds {whole} instants with lateral speed and yaw rate, "
            f"{_MIN_WHOLE} are needed.",
            "Choose a smaller step, or let the zigzag run for more legs.",
            {"instants": whole, "needed": _MIN_WHOLE, "step_s": step},
        )
    # the inputs are known at every instant of the record, so nothing is bridged here that was not before
    seconds = grid.time_utc_ns / SECOND_NS

    def between(values: Float) -> Float:
        interpolated: Float = np.interp(seconds, record.time_s, values)
        return interpolated

    return replace(
        record,
        start_utc_ns=record.start_utc_ns + start,
        time_s=grid.seconds,
        speed_m_s=between(record.speed_m_s),
        rudder_rad=between(record.rudder_rad),
        measured=measured,
        heading_rad=between(record.heading_rad),
    )


def step_of(record: Record) -> float:
    """Return the step of an even record, s."""
    return float(record.time_s[1] - record.time_s[0])


def without_means(record: Record) -> Record:
    """Take the means off the measurements and the rudder: the usual remedy against what is constant.

    A constant force and a constant lateral current shift the means alone, as long as the speed is constant too.
    """
    return replace(
        record,
        rudder_rad=record.rudder_rad - np.mean(record.rudder_rad),
        measured=record.measured - np.array([_mean(column) for column in record.measured.T]),
    )


def _mean(column: Float) -> float:
    return float(np.nanmean(column)) if np.isfinite(column).any() else 0.0
