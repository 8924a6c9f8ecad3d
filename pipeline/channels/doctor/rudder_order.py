"""Rudder order against rudder angle: the rudder comes to where it was ordered, within the time its gear takes."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.doctor.faults import Fault
from kempf.pipeline.channels.doctor.log import Log
from kempf.pipeline.channels.doctor.outcome import CheckFigure, Outcome, untestable, worst
from kempf.pipeline.channels.doctor.robust_regression import fit, reach
from kempf.pipeline.channels.grid import gap_limit_s
from kempf.schemas.units import SECOND_NS

_CHANNELS = ("rudder_order", "rudder_angle")
_SLOPES, _OFFSETS_DEG = (0.7, 1.4), (-5.0, 5.0)
#: Hard over to the other side takes at most 28 s (SOLAS II-1/29): half of it is the most that the angle lags by.
_LAGS_S = (-1.5, 14.0)
_SHIFTS = np.arange(-30.0, 30.5, 0.5)
_LEAST = float(np.deg2rad(2.0))


def examine(log: Log, *, thorough: bool = True) -> list[Outcome]:
    """Compare rudder order and rudder angle.

    Returns
    -------
    list of Outcome
        ``rudder_order_angle``; empty without both channels.

    References
    ----------
    SOLAS chapter II-1 regulation 29: 35 degrees on one side to 30 on the other in 28 s.
    """
    if not log.has(_CHANNELS):
        return []
    name = "rudder_order_angle"
    order, angle = (log.series[channel] for channel in _CHANNELS)
    if max(reach(order.value), reach(angle.value)) < _LEAST:
        return [untestable(name, _CHANNELS, "the rudder was hardly used")]
    best: tuple[float, float] | None = None
    for shift in _SHIFTS:
        put = order.at(angle.time_utc_ns - round(shift * SECOND_NS), gap_limit_s(order))
        good = np.isfinite(put)
        if np.count_nonzero(good) < 40 or np.ptp(put[good]) == 0.0:
            continue
        left = 1.0 - float(np.corrcoef(put[good], angle.value[good])[0, 1]) ** 2
        if best is None or left < best[0]:
            best = (left, float(shift))
    if best is None or best[0] > 0.75:
        return [untestable(name, _CHANNELS, "rudder order and rudder angle are not correlated")]
    put = order.at(angle.time_utc_ns - round(best[1] * SECOND_NS), gap_limit_s(order))
    line = fit(np.column_stack([put, np.ones_like(put)]), angle.value)
    if line is None:
        return [untestable(name, _CHANNELS, "the channels hardly overlap in time")]
    slope, offset = float(line.value[0]), float(line.value[1])
    # the rudder on its way between two orders is neither lag nor fault
    slope_std = float(np.hypot(line.std[0], 0.05 * abs(slope)))
    figures = (
        CheckFigure("rudder angle over rudder order", slope, slope_std, *_SLOPES),
        CheckFigure(
            "rudder angle at zero order",
            np.rad2deg(offset),
            np.rad2deg(line.std[1]) + 0.5,
            *_OFFSETS_DEG,
            "deg",
        ),
        CheckFigure("lag of the rudder angle behind the order", best[1], 0.5, *_LAGS_S, "s"),
    )
    words = (
        f"the rudder angle is {slope:.2f} ± {slope_std:.1g} (1 s.e.) times the order {figures[1].value:+.1f} deg and "
        f"lags by {best[1]:.1f} s"
    )
    suspects = [
        *(Fault("sign", (channel,)) for channel in _CHANNELS),
        *(Fault("unit", (channel,), 180.0 / np.pi, "rad taken for deg") for channel in _CHANNELS),
    ]
    if abs(slope) > 4.0 * slope_std:
        suspects += [
            Fault("offset", ("rudder_order",), offset / slope, "zero elsewhere", float(line.std[1]) / abs(slope)),
            Fault("offset", ("rudder_angle",), -offset, "zero elsewhere", float(line.std[1])),
        ]
    # half the gear's usual time is left where a clock is set right
    suspects += [
        Fault("latency", ("rudder_angle",), best[1] - 1.0, "late", 1.0, spread="assumed"),
        Fault("latency", ("rudder_order",), 1.0 - best[1], "early", 1.0, spread="assumed"),
    ]
    state = worst([figure.state for figure in figures])
    return [Outcome(name, _CHANNELS, state, words, figures, min(best[0], 1.0), tuple(suspects))]
