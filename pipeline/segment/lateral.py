"""The lateral speed of one manoeuvre in a few numbers: eq. (18), its standard error, and the check on eq. (19)."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.lateral_speed import check_current, lateral_speed, noise_std

_NEEDED = ("speed_over_ground", "course_over_ground", "heading")
_FEWEST = 8


def lateral_summary(
    instruments: Instruments, start_utc_ns: int, end_utc_ns: int, base_heading_deg: float
) -> dict[str, Any]:
    """Compute the lateral speed over a manoeuvre and summarise it.

    Parameters
    ----------
    instruments : Instruments
        Series of the log.
    start_utc_ns, end_utc_ns : int
        Bounds of the manoeuvre.
    base_heading_deg : float
        Heading before it, deg.

    Returns
    -------
    dict
        JSON content: ``computed``; where it is True the number of values, rms, median standard error, largest drift
        angle and how many exceed 45 deg (no ship under way drifts so: course or heading is wrong there), the noise of
        each channel and the check on eq. (19), units in the keys; where it is False, ``why``.
    """
    cut = {
        name: series.between(start_utc_ns, end_utc_ns)
        for name in (*_NEEDED, "speed_through_water")
        if (series := instruments.get(name)) is not None
    }
    absent = [name for name in _NEEDED if name not in cut or len(cut[name]) < _FEWEST]
    if absent:
        return {"computed": False, "why": f"no {' and no '.join(absent)} in the segment"}
    noise = {name: noise_std(cut[name]) for name in _NEEDED}
    lateral = lateral_speed(
        *(cut[name] for name in _NEEDED),
        speed_std_m_s=noise["speed_over_ground"],
        course_std_rad=noise["course_over_ground"],
        heading_std_rad=noise["heading"],
    )
    good = np.isfinite(lateral.value_m_s)
    if not good.any():
        return {"computed": False, "why": "the heading is missing wherever the GNSS measured"}
    log = cut.get("speed_through_water")
    check = check_current(
        lateral,
        cut["heading"],
        log if log is not None and len(log) >= _FEWEST else None,
        _on_the_turn(np.deg2rad(base_heading_deg), float(cut["heading"].value[0])),
    )
    return {
        "computed": True,
        "n": int(np.count_nonzero(good)),
        "rms_m_s": float(np.sqrt(np.mean(lateral.value_m_s[good] ** 2))),
        "median_std_m_s": float(np.median(lateral.std_m_s[good])),
        "drift_beyond_45_deg": int(np.count_nonzero(np.abs(lateral.drift_rad[good]) > np.pi / 4)),
        "largest_drift_deg": float(np.rad2deg(np.max(np.abs(lateral.drift_rad[good])))),
        "noise_std": {
            "speed_over_ground_m_s": noise["speed_over_ground"],
            "course_over_ground_rad": noise["course_over_ground"],
            "heading_rad": noise["heading"],
        },
        "current_check": asdict(check),
    }


def _on_the_turn(base_rad: float, heading_rad: float) -> float:
    """Return the base heading on the turn of the circle that the unwrapped heading is on, rad."""
    turn = 2.0 * np.pi
    return float(base_rad + turn * np.round((heading_rad - base_rad) / turn))
