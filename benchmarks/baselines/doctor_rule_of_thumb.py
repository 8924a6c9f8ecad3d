"""What a careful user does by hand instead of the doctor: look at correlations and medians of pairs of channels.

No lags, no stream, no standard errors; a pair that looks wrong names both of its channels.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.doctor.log import Log, turning
from kempf.pipeline.channels.series import Series
from kempf.schemas.units import SECOND_NS

#: What looks wrong to the eye.
_ALIKE, _ANGLE_RAD, _TOGETHER = (0.7, 1.4), float(np.deg2rad(15.0)), 0.3
_STEP_S = 5.0


def suspected(log: Log) -> set[str]:
    """Channels of every pair that looks wrong."""
    start = max(int(one.time_utc_ns[0]) for one in log.series.values())
    end = min(int(one.time_utc_ns[-1]) for one in log.series.values())
    time = np.arange(start, end, round(_STEP_S * SECOND_NS))

    def at(one: Series) -> np.ndarray:
        return one.at(time, 30.0)

    found: set[str] = set()
    velocities = {kind: log.over_ground(kind) for kind in ("course", "earth", "body")}
    kind, velocity = next(((k, v) for k, v in velocities.items() if v is not None), ("", None))
    if log.has(("heading", "yaw_rate")):
        slope = _slope(at(turning(log.series["heading"])), at(log.series["yaw_rate"]))
        found |= set() if _ALIKE[0] < slope < _ALIKE[1] else {"heading", "yaw_rate"}
    if velocity is not None and "heading" in log.series and kind != "body":
        off = at(Series(velocity.time_utc_ns, velocity.direction)) - at(log.series["heading"])
        mean = np.angle(np.nanmean(np.exp(1j * off)))
        found |= set() if abs(mean) < _ANGLE_RAD else {"heading", *velocity.channels}
    track = log.velocity("track")
    if velocity is not None and track is not None:
        ratio = np.nanmedian(np.abs(velocity.value)) / np.nanmedian(np.abs(track.value))
        found |= set() if _ALIKE[0] < ratio < _ALIKE[1] else {*velocity.channels, "latitude", "longitude"}
        bearing = at(Series(velocity.time_utc_ns, velocity.direction)) - at(Series(track.time_utc_ns, track.direction))
        mean = np.nanmean(np.exp(1j * bearing))
        fine = abs(np.angle(mean)) < _ANGLE_RAD and abs(mean) > 0.5
        found |= set() if fine else {*velocity.channels, "latitude", "longitude"}
    if velocity is not None and "speed_through_water" in log.series:
        ratio = np.nanmedian(log.series["speed_through_water"].value) / np.nanmedian(np.abs(velocity.value))
        found |= set() if _ALIKE[0] < ratio < _ALIKE[1] else {"speed_through_water", velocity.channels[0]}
    for rudder in ("rudder_angle", "rudder_order"):
        if rudder in log.series and "yaw_rate" in log.series:
            together = _correlation(at(log.series[rudder]), at(log.series["yaw_rate"]))
            found |= {rudder, "yaw_rate"} if together < -_TOGETHER else set()
    if log.has(("rudder_angle", "rudder_order")):
        apart = np.nanmedian(at(log.series["rudder_order"]) - at(log.series["rudder_angle"]))
        found |= {"rudder_angle", "rudder_order"} if abs(apart) > _ANGLE_RAD else set()
    return found


def _slope(x: np.ndarray, y: np.ndarray) -> float:
    good = np.isfinite(x) & np.isfinite(y)
    return float(np.polyfit(x[good], y[good], 1)[0]) if np.count_nonzero(good) > 3 else 1.0


def _correlation(x: np.ndarray, y: np.ndarray) -> float:
    good = np.isfinite(x) & np.isfinite(y)
    return float(np.corrcoef(x[good], y[good])[0, 1]) if np.count_nonzero(good) > 3 else 0.0
