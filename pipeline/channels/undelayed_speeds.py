"""The speeds of a log at the instants that they belong to: what receiver and log smoothed is undone (decision 0045).

Receivers smooth the velocity over ground, and speed logs show the mean of their last seconds. Both are late, which a
fit takes for sway and for weaker damping: to a boat that answers in a second, a second is much.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.channels.averaging import readings_averaged
from kempf.pipeline.channels.doctor.log import Complex, Log
from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.instant_errors import InstantErrors, instant_errors, said_of
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.lateness import Lateness, velocity_lateness
from kempf.pipeline.channels.series import Nanoseconds, Series
from kempf.schemas.units import SECOND_NS

#: time before and after a segment in which its instruments are looked at, s
_AROUND_S = 1800
#: standard errors of a lateness above which it is undone, and may be there; periods: finer than its readings no
#: velocity is known
_SURE, _POSSIBLE, _FINEST = 2.326, 1.645, 0.2


@dataclass(frozen=True, eq=False)
class VelocitySlope:
    """How fast a velocity changes from one reading to the next: what a second more of lateness takes from it."""

    #: Shape (n,). Of the readings.
    time_utc_ns: Nanoseconds
    #: shown, slope: Shape (n,). The velocity, towards north plus i times towards east, m/s, and its change since the
    #: reading before, m/s^2; 0 behind a gap.
    shown: Complex
    slope: Complex


@dataclass(frozen=True, eq=False)
class UndelayedSpeeds:
    """A log whose speeds are not late."""

    #: The very same where nothing was late.
    instruments: Instruments
    #: A sentence for each speed that was, and for instants that are not known.
    said: tuple[str, ...]
    #: What is not known of the instants, with what is not known of a lateness, whether it was undone or not.
    errors: InstantErrors
    #: Of a velocity that may be late; None of one that is not.
    velocity: VelocitySlope | None = None
    #: Time over which each value of the speed log is a mean, about its instant, s; 0 where it is of the instant.
    log_mean_s: float = 0.0


def undelayed_speeds(instruments: Instruments, start_utc_ns: int, end_utc_ns: int) -> UndelayedSpeeds:
    """Return a log with speeds that are not late, for one of its segments.

    Parameters
    ----------
    start_utc_ns, end_utc_ns : int
        Bounds of the segment, UTC ns.
    """
    around = _AROUND_S * SECOND_NS
    near = {
        name: series.between(start_utc_ns - around, end_utc_ns + around) for name, series in instruments.series.items()
    }
    # what holds values that are no numbers is refused later, by name
    own = {name: series for name, series in near.items() if len(series) > 1 and np.all(np.isfinite(series.value))}
    changed: dict[str, Series] = {}
    sentences = []
    # of a velocity that was turned out of the ship's frame it is not known what was smoothed
    late = _velocity_lateness(own) if "velocity_forward" not in own else None
    late_std_s, slope, mean_s = 0.0, None, 0.0
    if late is not None:
        speed, course = own["speed_over_ground"], own["course_over_ground"]
        slope = velocity_slope(speed, course)
        size = f"{late.late_s:.2g} ± {late.std_s:.1g} s (1 s.e.) late beside the fixes"
        if late.late_s > _SURE * late.std_s:
            late_std_s = late.std_s
            changed |= unsmoothed(speed, course, late.late_s)
            sentences.append(f"the GNSS velocity is {size}, as where it is smoothed: undone")
        else:
            # it may not be late at all, and is off by so much where it is
            late_std_s = late.late_s
            sentences.append(
                f"the GNSS velocity may be {size}: too little to be undone, and among what is not known of its instants"
            )
    log = own.get("speed_through_water")
    many = readings_averaged(log) if log is not None else 1.0
    if log is not None and many > 1.0:
        changed["speed_through_water"], mean_s = apart(log, many), many * log.period_s
        sentences.append(f"the speed log shows means over {mean_s:.2g} s: taken at their middle, one after the other")
    whole = replace(instruments, series={**instruments.series, **changed}) if changed else instruments
    errors = instant_errors(instruments.instant_std_s, late_std_s, instruments.found, instruments.row_s)
    return UndelayedSpeeds(whole, (*sentences, *said_of(instruments.instant_std_s)), errors, slope, mean_s)


def _velocity_lateness(series: dict[str, Series]) -> Lateness | None:
    """Return by how much the velocity over ground is late beside the fixes; None where nothing shows that it may be."""
    log = Log(series)
    track, velocity = log.track(), log.velocity("course")
    if track is None or velocity is None:
        return None
    lateness = velocity_lateness(track, velocity)
    least = _FINEST * series["course_over_ground"].period_s
    return lateness if lateness is not None and lateness.late_s > max(_POSSIBLE * lateness.std_s, least) else None


def unsmoothed(speed: Series, course: Series, late_s: float) -> dict[str, Series]:
    """Return speed and course over ground of a velocity that a filter of first order has made late.

    Parameters
    ----------
    speed, course : Series
        m/s and rad, unwrapped.
    late_s : float
        By how much, s.

    Notes
    -----
    A receiver that goes from fix to fix has y_k = y_{k-1} + (w_k - y_{k-1}) / (1 + tau / T), tau being its lateness and
    T the time between two fixes; so w_k = y_k + tau (y_k - y_{k-1}) / T.
    """
    before = velocity_slope(speed, course)
    value = before.shown + late_s * before.slope
    known = np.isin(course.time_utc_ns, before.time_utc_ns)
    return {
        "speed_over_ground": Series(before.time_utc_ns, np.abs(value)),
        "course_over_ground": Series(before.time_utc_ns, course.value[known] + np.angle(value * np.conj(before.shown))),
    }


def velocity_slope(speed: Series, course: Series) -> VelocitySlope:
    """Return how fast a velocity over ground changes.

    Parameters
    ----------
    speed, course : Series
        m/s and rad, unwrapped.
    """
    beside = speed.at(course.time_utc_ns, gap_limit_s(speed))
    known = np.isfinite(beside)
    time, shown = course.time_utc_ns[known], beside[known] * np.exp(1j * course.value[known])
    step = np.diff(time) / SECOND_NS
    slope = np.zeros(time.size, dtype=np.complex128)
    slope[1:] = np.where(step <= gap_limit_s(course), np.diff(shown) / step, 0.0)
    return VelocitySlope(time, shown, slope)


def apart(log: Series, many: float) -> Series:
    """Return means that share no reading, each at the middle of its time.

    Parameters
    ----------
    many : float
        Over how many readings each value is a mean.
    """
    every = int(np.ceil(many))
    middle = round(0.5 * (many - 1.0) * log.period_s * SECOND_NS)
    return Series(log.time_utc_ns[::every] - middle, log.value[::every])
