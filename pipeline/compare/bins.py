"""Groups of instants: by phase, side, run, and by what the ship did."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compare.group import group
from kempf.pipeline.predict.run_residuals import Samples

#: bins of what has a sign, to either side of nothing; bins of the speed
_HALF, _SPEEDS, _COURSES = 3, 5, 8
#: the rudder counts as amidships within this share of its largest angle
_AMIDSHIPS = 0.1
_PHASES = ("approach", "execute", "yaw_build_up", "overshoot", "counter_rudder", "steady_yaw")


def by_phase(samples: Samples) -> dict[str, Any]:
    """Return a group for each phase that there is, in the order of a leg."""
    return {name: group(samples, samples.phase == name) for name in _PHASES if np.any(samples.phase == name)}


def by_side(samples: Samples) -> dict[str, Any]:
    """Return a group for the rudder to starboard, to port, and amidships."""
    rudder = samples.rudder_rad
    small = _AMIDSHIPS * float(np.max(np.abs(rudder)))
    sides = {"starboard": rudder > small, "port": rudder < -small, "amidships": np.abs(rudder) <= small}
    return {name: group(samples, inside) for name, inside in sides.items() if inside.any()}


def by_run(samples: Samples) -> dict[str, Any]:
    """Return a group for each run."""
    return {str(name): group(samples, samples.run == name) for name in dict.fromkeys(samples.run.tolist())}


def by_bin(samples: Samples) -> dict[str, list[dict[str, Any]]]:
    """Return groups by bins of lateral speed, yaw rate, rudder, heading and speed; ``low`` and ``high`` in ``unit``.

    The outermost bins are open (None); those of the heading are sectors of the compass round N, NE, ...
    """
    degrees = float(np.rad2deg(1.0))
    asked: tuple[tuple[str, Float, str, Callable[[Float], Float]], ...] = (
        ("lateral_speed", samples.lateral_speed_m_s, "m/s", _symmetric),
        ("yaw_rate", degrees * samples.yaw_rate_rad_s, "deg/s", _symmetric),
        ("rudder", degrees * samples.rudder_rad, "deg", _symmetric),
        ("speed", samples.speed_m_s, "m/s", _spanning),
    )
    found = {}
    for name, value, unit, edges_of in asked:
        inner = edges_of(value)
        place = np.searchsorted(inner, value, side="right")
        bounds = [None, *inner.tolist(), None]
        found[name] = [
            {"low": bounds[k], "high": bounds[k + 1], "unit": unit, **group(samples, place == k)}
            for k in range(len(bounds) - 1)
            if np.any(place == k)
        ]
    sector = 360.0 / _COURSES
    place = (np.floor((degrees * samples.heading_rad) / sector + 0.5) % _COURSES).astype(np.int64)
    found["heading"] = [
        {"low": (k - 0.5) * sector % 360.0, "high": (k + 0.5) * sector, "unit": "deg", **group(samples, place == k)}
        for k in range(_COURSES)
        if np.any(place == k)
    ]
    return found


def _round(value: float) -> float:
    """Return a number with two significant digits."""
    return float(f"{value:.2g}")


def _symmetric(value: Float) -> Float:
    """Return inner edges of bins symmetric about nothing."""
    width = _round(float(np.percentile(np.abs(value), 99.0)) / _HALF)
    inner: Float = width * np.arange(1.0 - _HALF, _HALF)
    return inner if width > 0.0 else np.zeros(0)


def _spanning(value: Float) -> Float:
    """Return inner edges of bins over what occurs."""
    low, high = np.percentile(value, [1.0, 99.0])
    inner: Float = np.unique([float(f"{x:.3g}") for x in np.linspace(low, high, _SPEEDS + 1)[1:-1]])
    return inner
