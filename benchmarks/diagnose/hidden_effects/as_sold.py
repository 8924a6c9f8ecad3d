"""Instruments as sold: a receiver that smooths, noise that remembers, a log that averages, a rudder a little off.

What is measured at an instant is then no longer the truth of that instant with white noise. The figures are those of
ordinary equipment: receivers smooth the velocity over about a second (boats' finer ones less), logs give the mean of
several seconds, the rudder's feedback is adjusted to a few per cent.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.simulate.instruments import InstrumentRecord
from kempf.schemas.units import SECOND_NS

Float = NDArray[np.float64]

#: Time constant of the receiver's velocity, and time over which its noise and that of gyro and compass remember, s.
_SMOOTHED_S, _REMEMBERS_S = 0.8, {"gnss": 5.0, "yaw_rate": 1.0, "heading": 3.0}
#: Time over which the log averages, s, and by how much the rudder's feedback is off.
_AVERAGED_S, RUDDER_OFF = 5.0, 0.02
#: A boat's are quicker by so much.
_QUICKER = 0.4


def as_sold(record: InstrumentRecord, clean: InstrumentRecord, *, quick: bool) -> InstrumentRecord:
    """Return what an instrument as it is sold says.

    Parameters
    ----------
    record, clean : InstrumentRecord
        With white noise and with none, at the same instants.
    quick : bool
        Whether it is a boat's.
    """
    time_s = (record.measured_utc_ns - record.measured_utc_ns[0]) / SECOND_NS
    factor = _QUICKER if quick else 1.0

    def smoothed(column: Float) -> Float:
        return _first_order(column, time_s, factor * _SMOOTHED_S)

    def remembering(noisy: Float, true: Float, of: str) -> Float:
        return true + _coloured(noisy - true, time_s, factor * _REMEMBERS_S[of])

    values, true = dict(record.values), clean.values
    match record.instrument.name:
        case "gnss":
            parts = []
            for along in (np.cos, np.sin):
                noisy, exact = (_component(v, along) for v in (values, true))
                parts.append(smoothed(remembering(noisy, exact, "gnss")))
            values["speed_over_ground_m_s"] = np.hypot(*parts)
            values["course_over_ground_rad"] = np.arctan2(parts[1], parts[0]) % (2.0 * np.pi)
        case "yaw_rate":
            values["yaw_rate_rad_s"] = remembering(values["yaw_rate_rad_s"], true["yaw_rate_rad_s"], "yaw_rate")
        case "heading":
            exact = np.unwrap(true["heading_rad"])
            noise = np.mod(values["heading_rad"] - exact + np.pi, 2.0 * np.pi) - np.pi
            values["heading_rad"] = remembering(exact + noise, exact, "heading") % (2.0 * np.pi)
        case "log":
            column = values["speed_through_water_m_s"]
            values["speed_through_water_m_s"] = _averaged(column, time_s, factor * _AVERAGED_S)
        case "rudder":
            values["rudder_angle_rad"] = (1.0 + RUDDER_OFF) * values["rudder_angle_rad"]
        case _:
            return record
    return replace(record, values=values)


def _component(values: dict[str, Float], along: Callable[[Float], Float]) -> Float:
    return values["speed_over_ground_m_s"] * along(values["course_over_ground_rad"])


def _first_order(column: Float, time_s: Float, tau_s: float) -> Float:
    found = column.copy()
    kept = np.exp(-np.diff(time_s) / tau_s)
    for k in range(1, column.size):
        found[k] = kept[k - 1] * found[k - 1] + (1.0 - kept[k - 1]) * column[k]
    return found


def _coloured(white: Float, time_s: Float, tau_s: float) -> Float:
    """Return noise of the same variance that remembers, a first-order process."""
    found = white.copy()
    kept = np.exp(-np.diff(time_s) / tau_s)
    for k in range(1, white.size):
        found[k] = kept[k - 1] * found[k - 1] + np.sqrt(1.0 - kept[k - 1] ** 2) * white[k]
    return found


def _averaged(column: Float, time_s: Float, window_s: float) -> Float:
    """Return the mean of the last so many seconds at every instant."""
    total = np.concatenate([[0.0], np.cumsum(column)])
    first = np.searchsorted(time_s, time_s - window_s, side="right")
    last = np.arange(1, column.size + 1)
    result: Float = (total[last] - total[first]) / (last - first)
    return result
