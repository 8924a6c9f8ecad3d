"""The mean yaw rate over a while, from the heading, and how steady it was.

The compass is taken rather than the rate gyro: the bias of a gyro is as large as the residual rate of a stable ship.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.segment.local_fit import value_and_rate
from kempf.pipeline.segment.measured import Signals

#: Parts into which the while is divided.
_PARTS = 4


@dataclass(frozen=True)
class MeanYawRate:
    """A mean yaw rate."""

    #: Starboard positive, rad/s.
    value: float
    #: Its standard error, from the rates of four parts, rad/s.
    std: float
    #: By how much the rate of the last part exceeds the one of the first, rad/s.
    change: float


def mean_yaw_rate(signals: Signals, start_s: float, end_s: float) -> MeanYawRate:
    """Measure the mean yaw rate between two instants.

    Parameters
    ----------
    signals : Signals
        Heading and rudder.
    start_s, end_s : float
        From when to when, s; within the record.

    Returns
    -------
    MeanYawRate
        NaN where the heading is not recorded.
    """
    border = np.linspace(start_s, end_s, _PARTS + 1)
    window = (end_s - start_s) / (4 * _PARTS)
    heading = np.array([value_and_rate(signals.heading_s, signals.heading, float(t), window)[0] for t in border])
    rates = np.diff(heading) / np.diff(border)
    return MeanYawRate(
        float(heading[-1] - heading[0]) / (end_s - start_s),
        float(np.std(rates, ddof=1) / np.sqrt(_PARTS)),
        float(rates[-1] - rates[0]),
    )
