"""A heading that leaps where the ship does not turn: a compass that was set, or one that lost its satellites."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.doctor.faults import Fault, unit_faults
from kempf.pipeline.channels.doctor.log import Log, integral
from kempf.pipeline.channels.doctor.motion import does_not_move
from kempf.pipeline.channels.doctor.outcome import STILL, CheckFigure, Outcome, untestable
from kempf.pipeline.channels.doctor.robust_regression import quantile
from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.series import Float, Series
from kempf.schemas.instants import written
from kempf.schemas.units import SECOND_NS

#: The heading of so many readings, and of so long, s, is compared with that of as many before.
_READINGS, _LEAST_S = 3, 2.5
#: Beyond a leap of so much nothing but the compass itself is to blame, deg: a late heading or a gyro that is a tenth
#: off makes a third of it in a ship's hardest turn, and compasses of models measured on a pond leap by up to 5 deg.
_LEAST_DEG = 6.0
#: A leap is so many times what the two differ by all but one time in twenty.
_TIMES, _MOSTLY = 4.0, 0.95
_CHANNELS = ("heading", "yaw_rate")


def examine(log: Log, *, thorough: bool = True) -> list[Outcome]:
    """Find the largest leap of the heading against the integral of the yaw rate.

    One in radians taken for degrees leaps by 6.28 deg whenever the ship passes north.

    Returns
    -------
    list of Outcome
        ``heading_leap``; empty without both channels.
    """
    if not log.has(_CHANNELS):
        return []
    if does_not_move(log):
        return [untestable("heading_leap", _CHANNELS, STILL)]
    heading = log.series["heading"]
    if _in_radians(heading.value):
        words = "the heading runs from 0 to 6.28 deg and begins again"
        figure = CheckFigure(
            "leap of the heading",
            float(np.rad2deg(np.max(np.abs(np.diff(heading.value))))),
            0.01,
            0.0,
            _LEAST_DEG,
            "deg",
        )
        suspects = tuple(unit_faults(("heading",), "rad"))
        return [Outcome("heading_leap", _CHANNELS, "disagree", words, (figure,), 1.0, suspects)]
    turned = integral(log.series["yaw_rate"])
    left = heading.value - turned.at(heading.time_utc_ns, gap_limit_s(turned))
    leaps = _leaps(heading, left)
    if leaps.size == 0 or not np.isfinite(leaps).any():
        return [untestable("heading_leap", _CHANNELS, "too few readings of heading and yaw rate together")]
    sizes = np.abs(np.nan_to_num(leaps))
    k = int(np.argmax(sizes))
    usual = quantile(sizes[np.isfinite(leaps)], _MOSTLY)
    allowed = max(_LEAST_DEG, _TIMES * float(np.rad2deg(usual)))
    figure = CheckFigure("leap of the heading", float(np.rad2deg(sizes[k])), 0.1, 0.0, allowed, "deg")
    if figure.state != "disagree":
        words = "the heading does not leap while the ship is steady"
        return [Outcome("heading_leap", _CHANNELS, "agree", words, (figure,), alone=True)]
    at = int(heading.time_utc_ns[k])
    size = f"{np.rad2deg(leaps[k]):+.1f} deg"
    words = f"the heading leaps by {size} at {written(at)}, which the yaw rate does not show"
    fault = Fault("leap", ("heading",), float(leaps[k]), start_utc_ns=at)
    return [Outcome("heading_leap", _CHANNELS, "disagree", words, (figure,), 1.0, (fault,))]


def _in_radians(heading: Float) -> bool:
    """Return whether a heading passes north as one does that is in radians and was taken for degrees."""
    turn = float(np.deg2rad(2.0 * np.pi))
    return float(np.ptp(heading)) < 1.01 * turn and float(np.max(np.abs(np.diff(heading)), initial=0.0)) > 0.95 * turn


def _leaps(heading: Series, left: Float) -> Float:
    """Return by how much the medians before and from each reading on differ, rad; NaN across gaps and at the ends."""
    count = max(_READINGS, round(_LEAST_S / max(heading.period_s, 1e-3)))
    if left.size < 2 * count + 1:
        return np.zeros(0)
    median = np.median(np.lib.stride_tricks.sliding_window_view(left, count), axis=1)
    time = heading.time_utc_ns
    spans = (time[2 * count - 1 :] - time[: 1 - 2 * count]) / SECOND_NS
    leaps = np.full(left.size, np.nan)
    across = spans > 2.0 * count * gap_limit_s(heading)
    leaps[count : left.size - count + 1] = np.where(across, np.nan, median[count:] - median[:-count])
    return leaps
