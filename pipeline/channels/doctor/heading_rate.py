"""Heading against yaw rate: the one is the integral of the other, and both tell of it at one instant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kempf.pipeline.channels.doctor.align import Alignment, align
from kempf.pipeline.channels.doctor.clocks import clock_figures, clock_outcome
from kempf.pipeline.channels.doctor.faults import UNITS, Fault
from kempf.pipeline.channels.doctor.log import Log, integral
from kempf.pipeline.channels.doctor.outcome import SURE, Figure, Outcome, untestable

#: Slopes that are no lie: rate-of-turn indicators are allowed 5 % (IMO A.526(13)), and the filters of many do worse.
SLOPES = (0.8, 1.25)
#: A ship that has turned through less than this shows nothing, rad.
_LEAST_TURN = float(np.deg2rad(6.0))
#: What is left over of two motions that go together.
_TOGETHER = 0.6
_CHANNELS = ("heading", "yaw_rate")


def examine(log: Log) -> list[Outcome]:
    """Compare the changes of the heading with the integral of the yaw rate, and the clocks of both.

    Returns
    -------
    list of Outcome
        ``heading_rate`` and ``heading_rate_clock``; empty without both channels.

    References
    ----------
    IMO resolution A.526(13) (1983): performance standards for rate-of-turn indicators.
    """
    if not log.has(_CHANNELS):
        return []
    heading, turned = log.series["heading"], integral(log.series["yaw_rate"])
    late = 1.0 + heading.period_s + turned.period_s
    found = align(heading, turned, (-late, late))
    if found is None or max(swing(heading.value), swing(turned.value)) < _LEAST_TURN:
        why = "the ship hardly turned, or the two hardly overlap"
        return [untestable(name, _CHANNELS, why) for name in ("heading_rate", "heading_rate_clock")]
    if swing(heading.value) == 0.0:
        # a compass that stands still is no lie that could be taken back
        return [
            replace(_turning(found), suspects=()),
            untestable("heading_rate_clock", _CHANNELS, "the heading stands still"),
        ]
    return [_turning(found), _clocks(log, found, (-late, late))]


def swing(value: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
    """Return how far values range, one in a hundred at either end left out."""
    low, high = np.percentile(value, [1.0, 99.0])
    return float(high - low)


def _turning(found: Alignment) -> Outcome:
    figure = Figure("turned by the rate for 1 turned by the heading", found.slope, found.slope_std, *SLOPES)
    words = f"the yaw rate adds up to {found.slope:.3g} +- {found.slope_std:.2g} times what the heading turns"
    suspects = [
        Fault("sign", ("yaw_rate",)),
        Fault("sign", ("heading",)),
        Fault("offset", ("heading",), np.pi / 2, "counted anticlockwise from east", simplicity=2),
        *(Fault("unit", ("yaw_rate",), factor, name) for name, factor in UNITS["rad/s"].items()),
        *(Fault("unit", ("yaw_rate",), -factor, f"{name}, with the wrong sign", simplicity=2)
          for name, factor in UNITS["rad/s"].items()),
        *(Fault("unit", ("heading",), factor, name) for name, factor in UNITS["rad"].items()),
    ]  # fmt: skip
    if abs(found.slope) > 4.0 * found.slope_std and found.left_over < 0.5:
        suspects.append(Fault("scale", ("yaw_rate",), 1.0 / found.slope, "scale", found.slope_std, simplicity=3))
    state = figure.state
    if found.left_over > _TOGETHER and figure.outside < 1.5 * SURE:
        state = "untestable"  # a slope through noise
    return Outcome("heading_rate", _CHANNELS, state, words, (figure,), found.left_over, tuple(suspects))


def _clocks(log: Log, found: Alignment, honest_s: tuple[float, float]) -> Outcome:
    figures = clock_figures(found, honest_s, log.series["heading"])
    return clock_outcome("heading_rate_clock", (("heading",), ("yaw_rate",)), found, figures)
