"""How far out the logs go that a model was identified from, and what of a prediction lies beyond them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, isfinite, nan

import numpy as np

from kempf.pipeline.channels.running_mean import running_mean
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.manoeuvre.sailed import Reach

#: of the instants lie within what counts as covered; a reach further out by less than this share is none
_WITHIN, _BESIDE = 99.0, 1.05
#: readings are averaged over this part of the time in which she sails her own length
_PART = 0.3


@dataclass(frozen=True)
class Beyond:
    """One quantity in which a prediction goes beyond the logs."""

    #: ``drift``, ``yaw_rate``, ``rudder`` or ``speed``.
    quantity: str
    #: predicted, covered: Range of both, in ``unit``; magnitudes from 0 but for the speed.
    predicted: tuple[float, float]
    covered: tuple[float, float]
    unit: str

    @property
    def words(self) -> str:
        """The quantity in words."""
        return {"drift": "drift angle", "yaw_rate": "yaw rate"}.get(self.quantity, self.quantity)

    @property
    def sentence(self) -> str:
        """Say it."""
        if self.quantity == "speed":
            (a, b), (c, d) = self.predicted, self.covered
            return f"speed from {a:.3g} to {b:.3g} m/s, the logs cover {c:.3g} to {d:.3g} m/s"
        words = {"drift": "drift angle", "yaw_rate": "yaw rate r L / V", "rudder": "rudder"}[self.quantity]
        unit = f" {self.unit}" if self.unit else ""
        there = f"cover {self.covered[1]:.3g}{unit}" if isfinite(self.covered[1]) else "do not show it"
        return f"{words} up to {self.predicted[1]:.3g}{unit}, the logs {there}"


def covered(runs: Sequence[GridRun], scale_m: float) -> Reach:
    """Return how far out manoeuvres go.

    Parameters
    ----------
    runs : sequence of GridRun
        Lateral speed counted from that of the approach, where the current's part in it is.
    scale_m : float
        See `kempf.pipeline.manoeuvre.ship.Waters`.
    """
    reaches = [_of(run, scale_m) for run in runs]
    return Reach(
        float(np.nanmax([reach.drift_rad for reach in reaches]))
        if any(np.isfinite(reach.drift_rad) for reach in reaches)
        else nan,
        float(np.nanmax([reach.yaw_rate for reach in reaches]))
        if any(np.isfinite(reach.yaw_rate) for reach in reaches)
        else nan,
        max(reach.rudder_rad for reach in reaches),
        min(reach.slowest_m_s for reach in reaches),
        max(reach.fastest_m_s for reach in reaches),
    )


def _of(run: GridRun, scale_m: float) -> Reach:
    speed = run.speed_m_s
    own = scale_m / max(run.approach_m_s, 0.05)
    width = max(1, round(_PART * own / run.step_s))
    lateral, rate = (_smooth(run.measured[:, i], width) for i in (0, 1))
    if rate is None and np.isfinite(run.measured[:, 2]).mean() > 0.5:
        heading = _smooth(run.measured[:, 2], width)
        rate = np.gradient(heading, run.step_s) if heading is not None else None
    first = max(1, round(0.5 * own / run.step_s))
    moving = np.maximum(speed, 0.05)

    def largest(course: Float | None) -> float:
        return nan if course is None else float(np.percentile(np.abs(course), _WITHIN))

    return Reach(
        largest(None if lateral is None else np.arctan2(lateral - np.median(lateral[:first]), moving)),
        largest(None if rate is None else rate * run.ship.length_m / moving),
        float(np.percentile(np.abs(run.rudder_rad), _WITHIN)),
        float(np.percentile(speed, 100.0 - _WITHIN)),
        float(np.percentile(speed, _WITHIN)),
    )


def _smooth(column: Float, width: int) -> Float | None:
    known = np.isfinite(column)
    if known.mean() < 0.3:
        return None
    at = np.arange(column.size)
    return running_mean(np.interp(at, at[known], column[known]), width)


def beyond(predicted: Reach, logs: Reach) -> tuple[Beyond, ...]:
    """Return in what a prediction goes beyond the logs."""
    exceeded = []
    for quantity, there, here, unit in (
        ("drift", degrees(predicted.drift_rad), degrees(logs.drift_rad), "deg"),
        ("yaw_rate", predicted.yaw_rate, logs.yaw_rate, ""),
        ("rudder", degrees(predicted.rudder_rad), degrees(logs.rudder_rad), "deg"),
    ):
        if not there <= _BESIDE * here:
            exceeded.append(Beyond(quantity, (0.0, there), (0.0, here), unit))
    if predicted.slowest_m_s * _BESIDE < logs.slowest_m_s or predicted.fastest_m_s > _BESIDE * logs.fastest_m_s:
        sailed = (predicted.slowest_m_s, predicted.fastest_m_s)
        exceeded.append(Beyond("speed", sailed, (logs.slowest_m_s, logs.fastest_m_s), "m/s"))
    return tuple(exceeded)
