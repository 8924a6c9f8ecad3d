"""Lateral speed from GNSS and heading, eqs. (18)-(19) of the paper, with its standard error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.robust_std import robust_std
from kempf.pipeline.channels.rounding import rounding_std
from kempf.pipeline.channels.series import Float, Nanoseconds, Series


@dataclass(frozen=True, eq=False)
class LateralSpeed:
    """The lateral speed over ground of one segment at the instants of the GNSS."""

    #: Shape (n,). Instants of the GNSS velocity.
    time_utc_ns: Nanoseconds
    #: Shape (n,). y_v of eq. (18), m/s, starboard positive; NaN where the heading has a gap.
    value_m_s: Float
    #: Shape (n,). Standard error from the noise of speed, course and heading, m/s.
    std_m_s: Float
    #: Shape (n,). The longitudinal counterpart V_gps cos(COG - K), m/s.
    forward_m_s: Float
    #: Shape (n,). COG - K in (-pi, pi], rad.
    drift_rad: Float


@dataclass(frozen=True)
class CurrentCheck:
    """The check on eq. (19): what the heading-dependent part of the current does to y_v."""

    #: current_speed_m_s, current_direction_rad: Mean current over the segment from forward GNSS speed less log speed,
    #: and where it flows to; NaN without a log. On a heading that does not swing only the part along it is seen.
    current_speed_m_s: float
    current_direction_rad: float
    #: V_cur sin(K_cur - K_0), the constant that V_T absorbs, m/s.
    constant_m_s: float
    #: Largest |V_cur cos(K_cur - K_0) psi| of the segment: what V_T does not absorb, m/s.
    heading_term_m_s: float
    #: That term over the median standard error of y_v; well below 1 the segment lies well to the stream.
    heading_term_over_noise: float


def lateral_speed(
    speed_over_ground: Series,
    course_over_ground: Series,
    heading: Series,
    *,
    speed_std_m_s: float,
    course_std_rad: float,
    heading_std_rad: float,
) -> LateralSpeed:
    """Compute y_v = V_gps sin(COG - K), eq. (18), at the instants of the course.

    The heading is interpolated to those instants; the three noises are taken as independent, to first order::

        var(y_v) = sin^2(beta) var(V) + V^2 cos^2(beta) (var(COG) + var(K)),   beta = COG - K

    Parameters
    ----------
    speed_over_ground, course_over_ground : Series
        GNSS velocity, m/s and rad.
    heading : Series
        True heading, rad, unwrapped.
    speed_std_m_s, course_std_rad, heading_std_rad : float
        Noise of one reading of each, see `noise_std`.
    """
    time = course_over_ground.time_utc_ns
    speed = speed_over_ground.at(time, gap_limit_s(speed_over_ground))
    drift = course_over_ground.value - heading.at(time, gap_limit_s(heading))
    sine, cosine = np.sin(drift), np.cos(drift)
    variance = (sine * speed_std_m_s) ** 2 + (speed * cosine) ** 2 * (course_std_rad**2 + heading_std_rad**2)
    return LateralSpeed(
        time_utc_ns=time,
        value_m_s=speed * sine,
        std_m_s=np.sqrt(variance),
        forward_m_s=speed * cosine,
        drift_rad=np.arctan2(sine, cosine),
    )


def noise_std(series: Series) -> float:
    """Estimate the white noise of one reading from third differences.

    Third differences remove the ship's smooth motion; their median absolute deviation ignores spikes. For white noise
    var(d3) = 20 var(noise).

    Returns
    -------
    float
        Standard deviation in the series' unit; NaN for fewer than 8 values.
    """
    if len(series) < 8:
        return float("nan")
    difference = np.diff(series.value, n=3)
    white = float(robust_std(difference - np.median(difference)) / np.sqrt(20.0))
    # a coarse channel that moves little repeats itself: its rounding is noise all the same
    return max(white, rounding_std(series))


def check_current(
    lateral: LateralSpeed, heading: Series, speed_through_water: Series | None, base_heading_rad: float
) -> CurrentCheck:
    """Check how well the segment lies to the stream, eq. (19).

    y_v = V_0 sin(drift) + V_cur sin(K_cur - K_0 - psi): to first order the constant V_cur sin(K_cur - K_0), which V_T
    absorbs, less V_cur cos(K_cur - K_0) psi, which vanishes when K_0 lies across the stream. The current is the one
    that explains forward GNSS speed less log speed while the heading swings; the lateral speed is left out, because
    sway and heading swing together and their product does not average out.

    Parameters
    ----------
    heading : Series
        Heading, rad, unwrapped.
    speed_through_water : Series or None
        Log speed, m/s; without it the current is unknown and all results are NaN.
    base_heading_rad : float
        K_0, rad.
    """
    unknown = CurrentCheck(*([float("nan")] * 5))
    if speed_through_water is None:
        return unknown
    time = lateral.time_utc_ns
    psi = heading.at(time, gap_limit_s(heading))
    log = speed_through_water.at(time, gap_limit_s(speed_through_water))
    surplus = lateral.forward_m_s - log
    good = np.isfinite(surplus) & np.isfinite(psi)
    if not good.any():
        return unknown
    # Along the bow the ship's own drift does not show: surplus = V_N cos K + V_E sin K, and K swings.
    bow = np.column_stack([np.cos(psi[good]), np.sin(psi[good])])
    current_north, current_east = np.linalg.lstsq(bow, surplus[good], rcond=1e-6)[0]
    speed = float(np.hypot(current_north, current_east))
    direction = float(np.arctan2(current_east, current_north))
    swing = float(np.max(np.abs(psi[good] - base_heading_rad)))
    term = abs(speed * np.cos(direction - base_heading_rad)) * swing
    return CurrentCheck(
        current_speed_m_s=speed,
        current_direction_rad=direction % (2 * np.pi),
        constant_m_s=float(speed * np.sin(direction - base_heading_rad)),
        heading_term_m_s=float(term),
        heading_term_over_noise=float(term / np.median(lateral.std_m_s[good])),
    )
