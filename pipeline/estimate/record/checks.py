"""Whether a segment is a manoeuvre that can be identified from, before any estimator sees it.

The rudder is put over, the ship answers, she makes way ahead. Whether instruments contradict each other is asked in
`kempf.pipeline.estimate.record.channel_faults`.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.lateral_speed import LateralSpeed, noise_std
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.estimate.record.channel_faults import FARTHEST_RAD
from kempf.pipeline.estimate.record.moves import moves, swing
from kempf.schemas.enumeration import counted
from kempf.schemas.errors import DataRejected

#: executes that a record must hold: the first turns her one way, the second shows how she comes back
_EXECUTES = 2
#: no rudder of a ship is put over so far, rad
_FARTHEST_RUDDER_RAD = 1.5
#: a rudder that moves within less than this is none that turns a ship ten times as far
_FAINT_RUDDER_RAD = float(np.deg2rad(2.0))
_SWING_PER_RUDDER = 10.0
#: a ship that makes less than this share of her usual speed has stopped, and so much of the time she may
_STOPPED_SHARE = 0.1
_STOPPED_M_S = 0.05
_STOPPED_TIME = 0.02
#: what yaw rate and rudder leave over of the lateral speed, in its noise, below which it says nothing of its own
_NOTHING_OF_ITS_OWN = 1.03


def check_manoeuvre(rudder: Series, heading: Series) -> tuple[str, ...]:
    """Ask whether the rudder was put over and the ship came back.

    Parameters
    ----------
    rudder, heading : Series
        Of the segment, rad.

    Returns
    -------
    tuple of str
        Warnings.

    Raises
    ------
    DataRejected
        ``rudder_unit``, ``too_few_executes``.
    """
    farthest, range_rad = float(np.percentile(np.abs(rudder.value), 99.0)), swing(rudder.value)
    if farthest > _FARTHEST_RUDDER_RAD:
        raise DataRejected(
            "rudder_unit",
            f"The rudder reaches {np.rad2deg(farthest):.0f} deg, no rudder is put over beyond "
            f"{np.rad2deg(_FARTHEST_RUDDER_RAD):.0f}: degrees were taken for radians.",
            "Write `unit: deg` for rudder_angle in the vessel profile.",
            {"rudder_rad": farthest},
        )
    turned = swing(heading.value)
    if range_rad < _FAINT_RUDDER_RAD and turned > _SWING_PER_RUDDER * range_rad:
        raise DataRejected(
            "rudder_unit",
            f"The rudder moves within {np.rad2deg(range_rad):.2f} deg only, yet the heading swings over "
            f"{np.rad2deg(turned):.0f} deg: radians were taken for degrees, or something else turns her.",
            "Write `unit: rad` for rudder_angle in the vessel profile if the log counts radians; else sail a zigzag of "
            "at least 5 degrees of rudder.",
            {"rudder_range_rad": range_rad, "heading_range_rad": turned},
        )
    executes = moves(rudder.value)
    if executes < _EXECUTES:
        raise DataRejected(
            "too_few_executes",
            f"The rudder is put over {counted(executes, 'time')} in this segment, identification "
            f"needs {_EXECUTES}: one turn alone does not distinguish damping from rudder force.",
            "Sail a zigzag of at least two legs, or take a longer part of the log.",
            {"executes": executes, "needed": _EXECUTES},
        )
    if moves(heading.value) < _EXECUTES:
        return (
            "the ship has not swung back under the opposite rudder: too short in her own time, or turned by something "
            "else than the rudder; sail a zigzag of more legs",
        )
    return ()


def check_course(lateral: LateralSpeed) -> None:
    """Ask whether the ship goes where her bow points, give or take drift and stream, as eq. (18) needs.

    Raises
    ------
    DataRejected
        ``course_not_along_heading``.
    """
    drift = np.abs(lateral.drift_rad[np.isfinite(lateral.drift_rad)])
    usual = float(np.median(drift)) if drift.size else 0.0
    if usual > FARTHEST_RAD:
        raise DataRejected(
            "course_not_along_heading",
            f"The course over ground lies {np.rad2deg(usual):.0f} deg off the heading in the median; a ship under way "
            f"ahead stays within {np.rad2deg(FARTHEST_RAD):.0f}.",
            "Check unit, sign and offset of heading and course_over_ground in the vessel profile, and whether she went "
            "astern; in a stream as fast as the ship, repeat at higher speed.",
            {"median_angle_rad": usual},
        )


def check_way(speed_m_s: Float) -> tuple[str, ...]:
    """Ask whether the ship makes way ahead all the time, as eq. (16) needs.

    Parameters
    ----------
    speed_m_s : ndarray, shape (n,)
        Speed through the water over the segment, finite.

    Returns
    -------
    tuple of str
        Warnings.

    Raises
    ------
    DataRejected
        ``speed_negative``, ``no_speed``.
    """
    usual = float(np.median(speed_m_s))
    if usual < -_STOPPED_M_S:
        raise DataRejected(
            "speed_negative",
            f"The speed through the water is {usual:.2f} m/s in the median; eq. (16) holds for a ship that goes ahead.",
            "Turn the sign of speed_through_water in the vessel profile if she went ahead (`positive: port` turns the "
            "sign of any channel), or choose a segment ahead.",
            {"median_speed_m_s": usual},
        )
    stopped = float(np.mean(speed_m_s < max(_STOPPED_M_S, _STOPPED_SHARE * usual)))
    if stopped > _STOPPED_TIME:
        raise DataRejected(
            "no_speed",
            f"The ship makes no way through the water in {100 * stopped:.0f} % of this segment (median "
            f"{usual:.2f} m/s): the model of eq. (16) needs V > 0.",
            "Check the speed channel and its unit, or choose a segment under way.",
            {"median_speed_m_s": usual, "share": stopped},
        )
    if stopped > 0.0:
        return ("the speed through the water falls to nothing for a moment: look for dropouts of the log",)
    return ()


def check_sway(lateral: LateralSpeed, heading: Series, rudder: Series, yaw_rate: Series) -> tuple[str, ...]:
    """Ask whether the lateral speed says anything that yaw rate and rudder do not say already.

    Where it does not, the columns of the sway equation, of a11 v, a12 V r and b1 V delta, are collinear.
    A stream, constant or fixed in the earth frame, is allowed for.

    Parameters
    ----------
    lateral : LateralSpeed
        Eq. (18).
    heading, rudder, yaw_rate : Series
        Of the segment.

    Returns
    -------
    tuple of str
        Warnings.
    """
    time = lateral.time_utc_ns
    K, r, delta = (series.at(time, gap_limit_s(series)) for series in (heading, yaw_rate, rudder))
    columns = np.column_stack([r, delta, np.ones(time.size), np.cos(K), np.sin(K)])
    good = np.isfinite(columns).all(axis=1) & np.isfinite(lateral.value_m_s)
    y = lateral.value_m_s[good]
    if y.size < 4 * columns.shape[1]:
        return ()
    fitted = columns[good] @ np.linalg.lstsq(columns[good], y, rcond=1e-9)[0]
    left = float(np.sqrt(np.sum((y - fitted) ** 2) / (y.size - columns.shape[1])))
    noise = noise_std(Series(time[good], y))
    if left > _NOTHING_OF_ITS_OWN * noise + 1e-9 * swing(y):
        return ()
    return (
        f"lateral speed, yaw rate and rudder are collinear: the last two leave over {left:.2g} m/s of the first, whose "
        f"noise is {noise:.2g} m/s; a11, a12 and b1 are hardly distinguished, sail a second zigzag of other angles",
    )
