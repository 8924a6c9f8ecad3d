"""One compared run as columns: measured and predicted series in SI units, with the instants in UTC."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compare.comparison import ComparedRun
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.record.record import MEASUREMENTS
from kempf.schemas.motion_channel import MOTION
from kempf.schemas.units import SECOND_NS


def instants_utc_ns(run: GridRun) -> NDArray[np.int64]:
    """Return the instants of a run's grid, UTC nanoseconds, shape (n,)."""
    instants: NDArray[np.int64] = run.start_utc_ns + np.round(run.time_s * SECOND_NS).astype(np.int64)
    return instants


def first_heading(run: GridRun) -> float:
    """Return the true heading, rad, that the measured one is counted from."""
    known = np.isfinite(run.measured[:, MEASUREMENTS.index("heading")])
    from_first = run.measured[known, MEASUREMENTS.index("heading")]
    return float(np.median(run.heading_rad[known] - from_first)) if known.any() else 0.0


def run_series(run: ComparedRun) -> dict[str, Float | NDArray[np.int64]]:
    """Return a run and its prediction by column, each of shape (n,).

    Returns
    -------
    dict of str to ndarray
        ``time_utc_ns`` (whole nanoseconds), ``rudder_angle_rad`` (starboard positive), ``speed_through_water_m_s``; for
        ``yaw_rate`` (rad/s), ``heading`` (rad, true, not wrapped) and ``lateral_speed`` (m/s) what was measured, as
        ``yaw_rate_rad_s``, what was predicted, as ``yaw_rate_predicted_rad_s``, and, where the model has it, the
        standard deviation of the difference, as ``yaw_rate_std_rad_s``. NaN where nothing was measured or predicted.
    """
    record, prediction = run.residuals.filtered.run, run.predicted
    columns: dict[str, Float | NDArray[np.int64]] = {
        "time_utc_ns": instants_utc_ns(record),
        "rudder_angle_rad": record.rudder_rad,
        "speed_through_water_m_s": record.speed_m_s,
    }
    for name, channel in MOTION.items():
        i, unit = MEASUREMENTS.index(name), channel.suffix
        zero = first_heading(record) if name == "heading" else 0.0
        columns[f"{name}_{unit}"] = record.measured[:, i] + zero
        columns[f"{name}_predicted_{unit}"] = prediction.predicted[:, i] + zero
        if np.isfinite(prediction.std[:, i]).any():
            columns[f"{name}_std_{unit}"] = prediction.std[:, i]
    return columns
