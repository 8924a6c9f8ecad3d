"""A manoeuvre that is only planned, as the filter takes it: sailed by a model, measured by the ship's instruments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.filters.ekf import ROWS
from kempf.pipeline.estimate.record.grid_run import GridRun, current_row
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.manoeuvre import motion
from kempf.pipeline.manoeuvre.ship import SailedTrack, Ship
from kempf.pipeline.model.dynamics import N_INPUT, SPEED_ERROR_GAIN
from kempf.pipeline.model.rudder_line import RudderLine
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.symbols import CHANNEL_SYMBOLS

#: of straight course before the first order, in lengths
_APPROACH = 5.0
#: of water under a keel that feels no bottom, in draughts
_DEEP = 100.0
#: states that a run begins with, `kempf.pipeline.estimate.filtered.RunFilter.free`
_STATES = 8
_CHANNEL = {symbol: 2 + k for k, symbol in enumerate(CHANNEL_SYMBOLS)}
_OF_RUN = 2 + len(CHANNEL_SYMBOLS)


def planned(track: SailedTrack, ship: Ship, like: GridRun, spec: ModelSpec) -> GridRun:
    """Return a manoeuvre as it would be read, with nothing measured yet: every measurement that would be made is 0.

    In calm, deep water, as `kempf.pipeline.manoeuvre` sails; channels, rates and noise are those of a run that was
    sailed.

    Parameters
    ----------
    track : SailedTrack
        Sailed by ``ship``.
    like : GridRun
        Of the same vessel.
    spec : ModelSpec
        For the frame of the current.
    """
    step, waters = like.step_s, ship.waters
    lead = step * np.ceil(_APPROACH * waters.own_time_s / step)
    time = track.column(motion.TIME)
    n = int(np.floor((lead + time[-1]) / step)) + 1
    fine: Float = step / ROWS * np.arange(ROWS * (n - 1) + 1, dtype=np.float64)

    def laid(which: int) -> Float:
        column: Float = np.interp(fine - lead, time, track.column(which))
        return column

    forward, lateral, rudder, heading = (
        laid(which) for which in (motion.FORWARD, motion.LATERAL, motion.RUDDER, motion.HEADING)
    )
    inputs = np.zeros((fine.size, N_INPUT))
    inputs[:, 0], inputs[:, 1] = forward, rudder
    conditions = {
        "U": np.hypot(forward, lateral),
        "gamma": np.arctan2(lateral, forward),
        "n": np.full(fine.size, like.approach_per_s),
        "h": np.full(fine.size, _DEEP * waters.draught_m),
    }
    for symbol, column in conditions.items():
        if CHANNEL_SYMBOLS[symbol] in like.channels:
            inputs[:, _CHANNEL[symbol]] = column
    inputs[:, _OF_RUN], inputs[:, _OF_RUN + 1], inputs[:, _OF_RUN + 2] = heading, fine, like.load
    # what an error of the speed does in a steady turn, see `kempf.pipeline.estimate.record.speed_error`
    inputs[:, SPEED_ERROR_GAIN] = rudder / np.maximum(forward, 0.1 * waters.approach_m_s)
    again = np.arange(n) % like.measured.shape[0]
    return replace(
        like,
        name="planned",
        inputs=inputs,
        rudder_line=RudderLine.through(lead + time, track.column(motion.RUDDER), fine),
        rudder_noise=np.full(n, float(np.median(like.rudder_noise))),
        measured=np.where(np.isfinite(like.measured[again]), 0.0, np.nan),
        offset_s=like.offset_s[again],
        current_row=current_row(spec, heading[::ROWS]),
        heading_rad=heading[::ROWS],
        approach_m_s=waters.approach_m_s,
        lateral_by_late=None,
    )


def as_predicted(filtered: RunFilter, point: Point) -> GridRun:
    """Return a planned run with what a model predicts of every measurement, without noise, wind and current."""
    run = filtered.run
    free = filtered.free(point.hull, point.values, np.zeros(_STATES))
    return replace(run, measured=np.where(np.isfinite(run.measured), free, np.nan))
