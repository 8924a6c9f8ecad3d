"""Whether a ship moves, when she is under way, and how much of her way may be a stream's.

Most checks compare motions. Of a ship that is moored or drifts they see noise and stream only, and are not made.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.doctor.log import SLOWEST_M_S, Complex, Log, Velocity
from kempf.pipeline.channels.doctor.robust_regression import quantile
from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.schemas.units import SECOND_NS

#: Components of a stream that is not known, one standard deviation: four of these are faster than any that ships are
#: tried in, and half of what the ship makes herself - in a faster one nobody tests her.
STREAM_STD_M_S, STREAM_SHARE = 0.6, 0.125
#: Slower than this, m/s, a boat may only drift, and all of her way be the stream's.
_DRIFTS_M_S = 2.0
#: A speed is a mean over so long, s: noise of a GNSS velocity, filtered or not, is gone by then, a manoeuvre is not.
_MEAN_S = 10.0
#: The slowest way that measured velocities show where no GNSS is concerned (tank, pond), m/s.
_SLOWEST_INDOORS_M_S = 0.02
#: Under way is faster than this share of the speed that she mostly makes; from rest on only once she has gathered so
#: much of it.
_UNDER_WAY, _GATHERED = 0.5, 0.7
_MOSTLY = 0.9


def at_sea(log: Log) -> bool:
    """Return whether a GNSS takes part: then streams are possible, and velocities have its noise."""
    return any(name in log.series for name in ("latitude", "longitude", "course_over_ground", "speed_over_ground"))


def stream_std(log: Log, speed_m_s: float) -> float:
    """Return the standard deviation of each component of an unknown stream, m/s.

    Parameters
    ----------
    speed_m_s : float
        That she makes over ground. A slow one may be nothing but the stream, unless a turning shaft or a log says that
        she makes way herself; in a tank or a pond there is none.
    """
    return STREAM_STD_M_S if may_drift(log, speed_m_s) else min(STREAM_STD_M_S, STREAM_SHARE * speed_m_s)


def may_drift(log: Log, speed_m_s: float) -> bool:
    """Return whether nothing says that a ship of that speed over ground makes way herself."""
    if speed_m_s > _DRIFTS_M_S or not at_sea(log):
        return False
    shaft, water = log.series.get("shaft_speed"), log.series.get("speed_through_water")
    turns = shaft is not None and quantile(np.abs(shaft.value), 0.5) > 0.0
    return not turns and (water is None or quantile(np.abs(water.value), 0.5) < 0.5 * speed_m_s)


def moves(velocity: Velocity, log: Log) -> bool:
    """Return whether a velocity is more than the noise of one that stands still."""
    slowest = SLOWEST_M_S if at_sea(log) else _SLOWEST_INDOORS_M_S
    return _mostly(velocity.time_utc_ns, velocity.value) > slowest


def makes_way(water: Series, log: Log) -> bool:
    """Return whether a log's speed through the water is more than the noise of one that stands still."""
    return _moving(water.time_utc_ns, water.value, log)


def does_not_move(log: Log) -> bool:
    """Return whether every speed that the log has says that she does not move; False where it has none."""
    known = False
    for time, value in _speeds(log):
        if _moving(time, value, log):
            return False
        known = True
    return known


def speed_of(log: Log) -> Series | None:
    """Return how fast she goes, m/s: the first of log, GNSS, velocities and fixes that moves; None where none does."""
    for time, value in _speeds(log):
        if _moving(time, value, log):
            return Series(time, np.abs(value))
    return None


def under_way(speed: Series | None, edges: Nanoseconds) -> NDArray[np.bool_]:
    """Return in which windows she makes so much way that the rudder acts, shape (n,).

    Parameters
    ----------
    speed : Series or None
        From `speed_of`; None where the log has none: then in all of them.
    edges : ndarray, shape (n + 1,)
        Of the windows, UTC ns.
    """
    if speed is None:
        return np.ones(max(edges.size - 1, 0), dtype=np.bool_)
    mostly = quantile(speed.value, _MOSTLY)
    at = speed.at(edges, np.inf)
    fast = ~(at < _UNDER_WAY * mostly)
    if speed.value[0] < _UNDER_WAY * mostly:
        gathered = int(np.argmax(speed.value >= _GATHERED * mostly))
        fast &= edges >= speed.time_utc_ns[gathered]
    mask: NDArray[np.bool_] = fast[1:] & fast[:-1]
    return mask


def _speeds(log: Log) -> Iterator[tuple[Nanoseconds, Float | Complex]]:
    """Yield what shows how fast she goes: log and GNSS, then velocities, those between fixes last."""
    for name in ("speed_through_water", "speed_over_ground"):
        speed = log.series.get(name)
        if speed is not None:
            yield speed.time_utc_ns, speed.value
    for kind, velocity in log.velocities():
        if kind != "course":
            yield velocity.time_utc_ns, velocity.value


def _moving(time: Nanoseconds, value: Float | Complex, log: Log) -> bool:
    slowest = SLOWEST_M_S if at_sea(log) else _SLOWEST_INDOORS_M_S
    return time.size > 0 and _mostly(time, value) > slowest


def _mostly(time: Nanoseconds, value: Float | Complex) -> float:
    """Return the speed of the means over a while that she mostly makes, m/s; 0 of an empty one."""
    if time.size < 2:
        return float(np.abs(value).max(initial=0.0))
    total = np.concatenate([[0.0], np.cumsum(value)])
    first = np.arange(time.size)
    behind = np.searchsorted(time, time + round(_MEAN_S * SECOND_NS), side="left")
    whole = behind < time.size if (behind < time.size).any() else np.ones(time.size, dtype=np.bool_)
    mean = np.abs((total[behind] - total[first]) / np.maximum(behind - first, 1))[whole]
    return quantile(mean, _MOSTLY)
