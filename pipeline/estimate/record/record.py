"""What an estimator is given: one segment as instants, inputs and measurements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.instant_errors import IN_THE_LOG, InstantErrors
from kempf.pipeline.channels.lateral_speed import LateralSpeed
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.speed_error import SpeedError
from kempf.pipeline.estimate.record.speed_readings import SpeedReadings

#: columns of `Record.measured`
MEASUREMENTS = ("lateral_speed", "yaw_rate", "heading")


@dataclass(frozen=True, eq=False)
class Instants:
    """One segment as a likelihood takes it, every measurement at its own instant."""

    #: Shape (n,). Instants at which something was measured, the rudder was read or turned a corner.
    time_s: Float
    #: speed_m_s, rudder_rad: Shape (n,). Inputs, interpolated linearly; the rudder between its readings and the corners
    #: that these show, the speed after its noise was taken out.
    speed_m_s: Float
    rudder_rad: Float
    #: Shape (n,). Intensity of the error of the rudder's readings at the instants, rad s^0.5.
    rudder_noise_rad_sqrt_s: Float
    #: What is left of the noise of the speed, and which rudder acts like it.
    speed_error: SpeedError
    #: Shape (n, 3). Columns `MEASUREMENTS` in m/s, rad/s, rad; NaN where not measured at that instant. The heading is
    #: counted from its first value.
    measured: Float
    #: Shape (n,). True heading interpolated to the instants, not counted from anything; NaN in its gaps.
    heading_rad: Float
    #: Shape (3,). Noise level of each measurement to start from, in its unit.
    noise_start: Float

    @property
    def mean_speed_m_s(self) -> float:
        """Mean speed through the water, m/s."""
        return float(np.mean(self.speed_m_s))

    @property
    def shake_rad_sqrt_s(self) -> Float:
        """Intensity of the errors of rudder and speed together, as if the rudder made them, rad s^0.5, shape (n,)."""
        result: Float = np.hypot(self.rudder_noise_rad_sqrt_s, self.speed_error.intensity_rad_sqrt_s)
        return result

    @property
    def used(self) -> tuple[bool, bool, bool]:
        """Which of `MEASUREMENTS` there are."""
        has = np.any(np.isfinite(self.measured), axis=0)
        return bool(has[0]), bool(has[1]), bool(has[2])


@dataclass(frozen=True, eq=False)
class Record(Instants):
    """One segment as it was cut out of a log."""

    #: UTC of ``time_s`` = 0.
    start_utc_ns: int
    #: What ``speed_m_s`` was smoothed from.
    speed_readings: SpeedReadings
    #: Median time between readings of the rudder; in between its course is a guess, a straight line.
    rudder_period_s: float
    #: The same of the heading, which eq. (18) interpolates to the readings of the velocity.
    heading_period_s: float
    #: Eq. (18) with its standard errors.
    lateral: LateralSpeed
    warnings: tuple[str, ...]
    #: What is not known of the instants at which the instruments measured.
    instant_errors: InstantErrors = IN_THE_LOG
    #: Shape (n,). What a second more of lateness takes from the lateral speed, m/s^2, where that was measured; None of
    #: a velocity that is not late.
    lateral_by_late: Float | None = None
