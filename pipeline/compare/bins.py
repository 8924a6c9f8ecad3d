"""Groups of instants: by phase, side, run, and by what the ship did."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float, Mask
from kempf.pipeline.compare.group import group
from kempf.pipeline.predict.run_residuals import Samples

#: bins of what has a sign, to either side of nothing; bins of the speed
_HALF, _SPEEDS, _COURSES = 3, 5, 8
#: the rudder counts as amidships within this share of its largest angle
_AMIDSHIPS = 0.1
_PHASES = ("approach", "execute", "yaw_build_up", "overshoot", "counter_rudder", "steady_yaw")


@dataclass(frozen=True, eq=False)
class Bin:
    """Instants at which something was within bounds."""

    #: low, high: None where it is open.
    low: float | None
    high: float | None
    unit: str
    #: Shape (N,).
    inside: Mask

    @property
    def words(self) -> str:
        """Its bounds in words."""
        if self.low is None or self.high is None:
            return f"below {self.high:g} {self.unit}" if self.low is None else f"above {self.low:g} {self.unit}"
        return f"{self.low:g} to {self.high:g} {self.unit}"


def phases(samples: Samples) -> dict[str, Mask]:
    """Return the instants of each phase that there is, shape (N,) each, in the order of a leg."""
    masks = {name: samples.phase == name for name in _PHASES}
    return {name: inside for name, inside in masks.items() if inside.any()}


def sides(samples: Samples) -> dict[str, Mask]:
    """Return the instants with the rudder to starboard, to port, and amidships, shape (N,) each."""
    rudder = samples.rudder_rad
    small = _AMIDSHIPS * float(np.max(np.abs(rudder)))
    masks = {"starboard": rudder > small, "port": rudder < -small, "amidships": np.abs(rudder) <= small}
    return {name: inside for name, inside in masks.items() if inside.any()}


def runs(samples: Samples) -> dict[str, Mask]:
    """Return the instants of each run, shape (N,) each."""
    return {str(name): samples.run == name for name in dict.fromkeys(samples.run.tolist())}


def bins(samples: Samples) -> dict[str, list[Bin]]:
    """Return bins of lateral speed, yaw rate, rudder, speed and heading, none of them empty.

    The outermost are open; those of the heading are sectors of the compass round N, NE, ...
    """
    degrees = float(np.rad2deg(1.0))
    quantities: tuple[tuple[str, Float, str, Callable[[Float], Float]], ...] = (
        ("lateral_speed", samples.lateral_speed_m_s, "m/s", _symmetric),
        ("yaw_rate", degrees * samples.yaw_rate_rad_s, "deg/s", _symmetric),
        ("rudder", degrees * samples.rudder_rad, "deg", _symmetric),
        ("speed", samples.speed_m_s, "m/s", _spanning),
    )
    by_quantity = {}
    for name, value, unit, edges_of in quantities:
        inner = edges_of(value)
        place = np.searchsorted(inner, value, side="right")
        bounds = [None, *inner.tolist(), None]
        by_quantity[name] = [Bin(bounds[k], bounds[k + 1], unit, place == k) for k in range(len(bounds) - 1)]
    sector = 360.0 / _COURSES
    place = (np.floor((degrees * samples.heading_rad) / sector + 0.5) % _COURSES).astype(np.int64)
    by_quantity["heading"] = [
        Bin((k - 0.5) * sector % 360.0, (k + 0.5) * sector, "deg", place == k) for k in range(_COURSES)
    ]
    return {
        name: [interval for interval in intervals if interval.inside.any()] for name, intervals in by_quantity.items()
    }


def grouped(samples: Samples, of: dict[str, Mask]) -> dict[str, Any]:
    """Return a group for each of some sets of instants, see `kempf.pipeline.compare.group.group`."""
    return {name: group(samples, inside) for name, inside in of.items()}


def binned(samples: Samples, of: dict[str, list[Bin]]) -> dict[str, list[dict[str, Any]]]:
    """Return groups by bins, with ``low`` and ``high`` in ``unit``."""
    return {
        name: [
            {"low": interval.low, "high": interval.high, "unit": interval.unit, **group(samples, interval.inside)}
            for interval in intervals
        ]
        for name, intervals in of.items()
    }


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
