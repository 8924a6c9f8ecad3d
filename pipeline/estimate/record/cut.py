"""From the series of a log to the record of a segment: cut out, checked, aligned, with what there is to warn of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kempf.pipeline.channels.corners import with_corners
from kempf.pipeline.channels.doctor.log import Log
from kempf.pipeline.channels.gear_runs import with_straight_runs
from kempf.pipeline.channels.grid import LONGEST_SPEED_GAP_S, gap_limit_s
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.lateral_speed import LateralSpeed, lateral_speed, noise_std
from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.pipeline.channels.spikes import without_spikes
from kempf.pipeline.channels.standing import without_noise
from kempf.pipeline.channels.there_and_back import counted
from kempf.pipeline.channels.undelayed_speeds import UndelayedSpeeds, VelocitySlope, undelayed_speeds
from kempf.pipeline.estimate.record.channel_faults import EXAMINED, check_channels
from kempf.pipeline.estimate.record.checks import check_course, check_manoeuvre, check_sway, check_way
from kempf.pipeline.estimate.record.jumps import find_jumps
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.record.speed_error import SpeedError, rudder_of_speed_error
from kempf.pipeline.estimate.record.speed_readings import SpeedReadings
from kempf.pipeline.estimate.record.water_speed import water_speed
from kempf.schemas.errors import DataRejected
from kempf.schemas.units import SECOND_NS

_MIN_INSTANTS = 40
#: time beyond the segment over which the log is taken at least, s, and how many means that share no reading are enough
_BEYOND_S, _FEWEST_OF_LOG = 5.0, 12
#: a relative error of the speed is counted against no less than this
_SLOWEST_M_S = 0.1
_MIN_RUDDER_STD_RAD = np.deg2rad(0.2)


def make_record(instruments: Instruments, start_utc_ns: int, end_utc_ns: int) -> Record:
    """Cut one segment out of a log.

    The heading is a measurement of its own beside the yaw rate, whose integral it is: it separates a bias of the rate
    gyro from a turn, and replaces it where there is none.

    Parameters
    ----------
    instruments : Instruments
        Series of the log.
    start_utc_ns, end_utc_ns : int
        Bounds of the segment, UTC ns.

    Raises
    ------
    DataRejected
        A channel is missing, not finite, has a gap that cannot be bridged, stands still or contradicts another; the
        rudder or the ship did not move; `docs/bad_input.md` has every code.
    """
    as_delivered, on_time = instruments, undelayed_speeds(instruments, start_utc_ns, end_utc_ns)
    instruments = on_time.instruments
    warnings: list[str] = [*on_time.said, *_left_out(as_delivered, start_utc_ns, end_utc_ns)]
    heading = _need(instruments, "heading", start_utc_ns, end_utc_ns)
    rudder = _need(instruments, "rudder_angle", start_utc_ns, end_utc_ns)
    course = _need(instruments, "course_over_ground", start_utc_ns, end_utc_ns)
    ground_speed = _need(instruments, "speed_over_ground", start_utc_ns, end_utc_ns)
    heading_std, rudder_std = noise_std(heading), float(np.nan_to_num(noise_std(rudder)))
    lateral = lateral_speed(
        ground_speed,
        course,
        heading,
        speed_std_m_s=noise_std(ground_speed),
        course_std_rad=noise_std(course),
        heading_std_rad=heading_std,
    )
    yaw = _cut(instruments, "yaw_rate", start_utc_ns, end_utc_ns)
    if yaw is None:
        warnings.append("no yaw rate channel: the yaw rate is estimated through the heading")
    usable, remarks = check_channels(_window(as_delivered, start_utc_ns, end_utc_ns))
    yaw = yaw if usable else None
    warnings += remarks
    check_course(lateral)
    lateral = _without_jumps(lateral, warnings)
    moved = with_corners(with_straight_runs(without_noise(rudder, rudder_std), rudder_std), rudder_std)
    timed = [lateral.time_utc_ns, heading.time_utc_ns, moved.time_utc_ns, *([yaw.time_utc_ns] if yaw else [])]
    instants = np.unique(np.concatenate(timed))
    inside = (instants >= rudder.time_utc_ns[0]) & (instants <= rudder.time_utc_ns[-1])
    instants = instants[inside]
    log, mean_s = _cut_log(on_time, as_delivered, start_utc_ns, end_utc_ns)
    log = _without_spikes(log, lateral, warnings)
    slow = water_speed(log, heading, rudder, mean_s)
    speed = _speed(slow.series, instants)
    instants, speed = _trimmed(instants, speed, warnings)
    delta = moved.at(instants, gap_limit_s(rudder))
    _check(instants, delta, rudder)
    warnings += [*check_manoeuvre(rudder, heading), *check_way(speed)]
    warnings += check_sway(lateral, heading, rudder, yaw) if yaw is not None else ()
    measured = _measured(instants, lateral, yaw, heading)
    by_speed = rudder_of_speed_error(heading, rudder, instants, delta)
    noise = np.array([float(np.nanmedian(lateral.std_m_s)), noise_std(yaw) if yaw else np.nan, heading_std])
    return Record(
        start_utc_ns=int(instants[0]),
        time_s=(instants - instants[0]).astype(np.float64) / SECOND_NS,
        speed_m_s=speed,
        rudder_rad=delta,
        measured=measured,
        heading_rad=heading.at(instants, gap_limit_s(heading)),
        rudder_period_s=rudder.period_s,
        heading_period_s=heading.period_s,
        rudder_noise_rad_sqrt_s=np.full(instants.size, rudder_std * float(np.sqrt(rudder.period_s))),
        speed_error=SpeedError(by_speed / np.maximum(np.abs(speed), _SLOWEST_M_S), slow.error_std, slow.error_time_s),
        speed_readings=_readings(log, mean_s, instants),
        lateral=lateral,
        noise_start=noise,
        warnings=tuple(warnings),
        instant_errors=on_time.errors,
        lateral_by_late=_by_late(on_time.velocity, heading, instants, measured[:, 0]),
    )


def _by_late(velocity: VelocitySlope | None, heading: Series, instants: Nanoseconds, lateral: Float) -> Float | None:
    """Return `Record.lateral_by_late`: eq. (18) of the velocity's change, NaN where no lateral speed was measured."""
    if velocity is None:
        return None
    heads = heading.at(velocity.time_utc_ns, gap_limit_s(heading))
    column = np.zeros((instants.size, 1))
    _place(column, 0, instants, velocity.time_utc_ns, np.nan_to_num((velocity.slope * np.exp(-1j * heads)).imag))
    return np.where(np.isfinite(lateral), column[:, 0], np.nan)


def _measured(instants: Nanoseconds, lateral: LateralSpeed, yaw: Series | None, heading: Series) -> Float:
    """Lay the measurements out at their instants, shape (n, 3), the heading counted from its first value."""
    measured = np.full((instants.size, 3), np.nan)
    _place(measured, 0, instants, lateral.time_utc_ns, lateral.value_m_s)
    if np.count_nonzero(np.isfinite(measured[:, 0])) < _MIN_INSTANTS // 2:
        raise DataRejected(
            "no_lateral_speed",
            "GNSS velocity, heading and rudder are hardly ever there at the same time in this segment: eq. (18) gives "
            f"{np.count_nonzero(np.isfinite(measured[:, 0]))} values, {_MIN_INSTANTS // 2} are needed.",
            "Look at the channels' times in the log; a clock may be wrong.",
        )
    if yaw is not None:
        _place(measured, 1, instants, yaw.time_utc_ns, yaw.value)
    _place(measured, 2, instants, heading.time_utc_ns, heading.value)
    measured[:, 2] -= float(heading.value[0])
    return measured


def _cut(
    instruments: Instruments, channel: str, start_ns: int, end_ns: int, fewest: int = _MIN_INSTANTS // 2
) -> Series | None:
    series = instruments.get(channel)
    if series is None:
        return None
    part = series.between(start_ns, end_ns)
    wrong = int(np.count_nonzero(~np.isfinite(part.value)))
    if wrong:
        raise DataRejected(
            "not_finite",
            f"The segment's {channel} holds {wrong} of {len(part)} values that are no finite numbers.",
            "Ingest the log again: ingest refuses such values one by one and keeps the rest.",
            {"channel": channel, "values": len(part), "not_finite": wrong},
        )
    return part if len(part) >= fewest else None


def _window(instruments: Instruments, start_ns: int, end_ns: int) -> Log:
    """Return what the log itself has of a segment, for the channel doctor."""
    own = {name: _cut(instruments, name, start_ns, end_ns) for name in EXAMINED if name not in instruments.derived}
    return Log({name: series for name, series in own.items() if series is not None})


def _left_out(instruments: Instruments, start_ns: int, end_ns: int) -> list[str]:
    """Return what to warn of where readings of the segment leap away and back, and were left out."""
    counts = {
        name: int(np.count_nonzero((at >= start_ns) & (at <= end_ns))) for name, at in instruments.left_out.items()
    }
    return [counted(name, count) for name, count in counts.items() if count]


def _need(instruments: Instruments, channel: str, start_ns: int, end_ns: int) -> Series:
    part = _cut(instruments, channel, start_ns, end_ns)
    if part is None:
        raise DataRejected(
            "channel_missing",
            f"The segment has no usable {channel}: identification needs heading, rudder angle and GNSS velocity.",
            f"Log {channel}, or map it in the vessel profile if the log has it under another name.",
            {"channel": channel, "channels_present": sorted(instruments.series)},
        )
    return part


def _without_spikes(log: Series | None, lateral: LateralSpeed, warnings: list[str]) -> Series:
    """Return the speed log, else the forward part of the GNSS velocity."""
    if log is None:
        good = np.isfinite(lateral.forward_m_s)
        log = Series(lateral.time_utc_ns[good], lateral.forward_m_s[good])
        warnings.append("no water log: speed is GNSS speed along the bow, a current along the course biases it")
    log, spikes = without_spikes(log)
    if spikes:
        warnings.append(f"{spikes} spikes of the speed left out")
    return log


def _readings(log: Series, mean_s: float, instants: Nanoseconds) -> SpeedReadings:
    """Return what the log read from the first of the instants to the last."""
    own = log.between(int(instants[0]), int(instants[-1]))
    return SpeedReadings(own.seconds_since(int(instants[0])), own.value, mean_s)


def _speed(slow: Series, instants: Nanoseconds) -> Float:
    """Return the speed through the water at the instants, NaN in its gaps."""
    speed = slow.at(instants, LONGEST_SPEED_GAP_S)
    if np.nanmax(np.abs(speed), initial=0.0) < 0.05:
        raise DataRejected(
            "no_speed",
            "The ship does not move through the water in this segment: the model of eq. (16) needs V > 0.",
            "Check the speed channel and its unit, or choose a segment under way.",
        )
    return speed


def _cut_log(
    on_time: UndelayedSpeeds, as_delivered: Instruments, start_ns: int, end_ns: int
) -> tuple[Series | None, float]:
    """Return the speed log about the segment, None where it has too little; and what its values are means over, s."""
    name, margin = "speed_through_water", round(_BEYOND_S * SECOND_NS)
    delivered = _cut(as_delivered, name, start_ns - margin, end_ns + margin)
    sparse = on_time.instruments.series.get(name)
    if delivered is None or sparse is None or not on_time.log_mean_s > 0.0:
        return delivered, 0.0
    # means that share no reading are few: so that some stand before and behind the segment
    beyond = max(margin, round(2.0 * np.nan_to_num(sparse.period_s) * SECOND_NS))
    apart = _cut(on_time.instruments, name, start_ns - beyond, end_ns + beyond, _FEWEST_OF_LOG)
    return (delivered, 0.0) if apart is None else (apart, on_time.log_mean_s)


def _without_jumps(lateral: LateralSpeed, warnings: list[str]) -> LateralSpeed:
    jumps = find_jumps(lateral)
    count = int(np.count_nonzero(jumps.inside))
    if jumps.unresolved:
        warnings.append(
            f"the GNSS velocity jumps {jumps.unresolved} times as no ship can, and nothing shows which side is right: "
            "all of it is kept; look at the receiver"
        )
    if not count:
        return lateral
    warnings.append(f"{count} gross errors of lateral_speed left out before the fit: jumps of the GNSS velocity")
    sound = {
        name: np.where(jumps.inside, np.nan, getattr(lateral, name))
        for name in ("value_m_s", "std_m_s", "forward_m_s", "drift_rad")
    }
    return replace(lateral, **sound)


def _trimmed(instants: Nanoseconds, speed: Float, warnings: list[str]) -> tuple[Nanoseconds, Float]:
    """Cut the ends at which the speed is not known; a hole inside would hide what the rudder did there."""
    known = np.flatnonzero(np.isfinite(speed))
    cut = slice(int(known[0]), int(known[-1]) + 1) if known.size else slice(0, 0)
    if not np.all(np.isfinite(speed[cut])):
        apart = np.diff(instants[known]).max() / SECOND_NS
        raise DataRejected(
            "speed_gap",
            f"The speed has a gap of {apart:.0f} s inside the segment; up to {LONGEST_SPEED_GAP_S:.0f} s are bridged.",
            "Repeat the manoeuvre, or identify the part of it before or after the gap.",
            {"gap_s": float(apart)},
        )
    lost = (instants.size - known.size) / max(instants.size, 1)
    if lost > 0.02:
        warnings.append(f"the speed is not known over {100 * lost:.0f} % of the segment, at its ends: left out")
    return instants[cut], speed[cut]


def _place(measured: Float, column: int, instants: Nanoseconds, time: Nanoseconds, value: Float) -> None:
    rows = np.searchsorted(instants, time)
    inside = (rows < instants.size) & (time >= instants[0])
    inside[inside] = instants[rows[inside]] == time[inside]
    measured[rows[inside], column] = value[inside]


def _check(instants: Nanoseconds, delta: Float, rudder: Series) -> None:
    if instants.size < _MIN_INSTANTS:
        raise DataRejected(
            "segment_too_short",
            f"The segment holds {instants.size} instants, identification needs {_MIN_INSTANTS}.",
            "Log faster, or let the zigzag run for more legs.",
            {"instants": int(instants.size), "needed": _MIN_INSTANTS},
        )
    if not np.all(np.isfinite(delta)):
        worst = float(np.max(np.diff(rudder.time_utc_ns))) / SECOND_NS
        raise DataRejected(
            "rudder_gap",
            f"The rudder has a gap of {worst:.1f} s inside the segment; its course in between is not known.",
            "Repeat the manoeuvre, or identify the part of it before or after the gap.",
            {"gap_s": worst},
        )
    if float(np.std(delta)) < _MIN_RUDDER_STD_RAD:
        raise DataRejected(
            "no_excitation",
            f"The rudder moves by {np.rad2deg(np.std(delta)):.2f} deg rms only: too little to identify from.",
            "Sail a zigzag of at least 5 degrees of rudder.",
        )
