"""Course against heading on average: how far an instrument is turned out of its line, stream and drift allowed for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from kempf.pipeline.channels.doctor.faults import Fault
from kempf.pipeline.channels.doctor.heading_course import DRIFT_RAD
from kempf.pipeline.channels.doctor.log import Complex, Log, Velocity, turning
from kempf.pipeline.channels.doctor.motion import may_drift, moves, stream_std
from kempf.pipeline.channels.doctor.outcome import STILL, SURE, CheckFigure, Outcome, untestable
from kempf.pipeline.channels.doctor.robust_regression import posterior, quantile
from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.robust_std import MAD_TO_STD
from kempf.pipeline.channels.series import Float, Series
from kempf.schemas.units import SECOND_NS

#: Leeway of a ship under way, one standard deviation, rad, and the deviation of a compass that is no gross fault.
_LEEWAY_RAD, _DEVIATION_DEG = float(np.deg2rad(2.0)), 5.0
#: Readings are averaged by sectors of heading, and by whether she turns to port, not, or to starboard: this many
#: sectors, the share of the greatest rate that counts as turning, and the error that one average keeps however many
#: readings it has - leeway and helm of that heading - as a share of the speed.
_SECTORS, _TURNING, _SECTOR_STD = 36, 0.3, 0.05
#: The same of one second, which averages out.
_SECOND_STD = 0.3
#: Where the fit leaves more than this share of the velocity, heading and course do not go together at all.
_TOGETHER = 0.5
_FEWEST = 12
#: Times that the axis of the way is put right.
_ROUNDS = 3
#: A way is one from this share of the speed on; beyond this standard error of its angle, rad, it may be a stream's.
_LEAST_WAY, _SURE_WAY = 0.3, 1.0 / SURE
#: Stretches of the log that have to show the angle each, and by what share of it they may differ.
_STRETCHES, _ASTRAY = 3, 0.5


def examine(log: Log, *, thorough: bool = True) -> list[Outcome]:
    """Find the angle between the bow and the velocity through the water, as the velocity over ground shows it.

    Seen from the bow, the velocity over ground is a constant A (the way she makes), plus a stream C that turns
    backwards as she turns, plus a drift S r that goes with the yaw rate: w = A + C exp(-i psi) + S r. The angle of A
    is how far heading or course are turned. Legs on several headings separate A and C; where they do not, what is
    known of streams beforehand is part of the standard error.

    Returns
    -------
    list of Outcome
        ``legs_KIND`` for each kind of velocity, see `VELOCITIES`.
    """
    heading = log.series.get("heading")
    if heading is None:
        return []
    return [_compare(log, kind, heading, velocity) for kind, velocity in log.velocities(track=thorough)]


def _compare(log: Log, kind: str, heading: Series, velocity: Velocity) -> Outcome:
    name, channels = f"legs_{kind}", ("heading", *velocity.channels)
    if not moves(velocity, log):
        return untestable(name, channels, STILL)
    if velocity.blurred(heading):
        return untestable(name, channels, "the position fixes are too coarse to resolve the turns")
    way = _way(log, kind, heading, velocity)
    if way is None or way.why_not:
        return untestable(name, channels, "too few readings under way" if way is None else way.why_not)
    angle, std = way.angle, float(np.hypot(way.own_std, _LEEWAY_RAD))
    quantity = "angle of the velocity from the bow" if kind == "body" else "course minus heading"
    figure = CheckFigure(
        quantity, float(np.rad2deg(angle)), float(np.rad2deg(std)), -_DEVIATION_DEG, _DEVIATION_DEG, "deg"
    )
    words = f"{quantity} is {figure.value:+.1f} ± {figure.std:.1f} deg (1 s.e.) with current and drift removed"
    if figure.state == "disagree" and not _repeated(log, kind, heading, velocity, angle):
        return untestable(name, channels, f"{words}, but not in every stretch of the log")
    suspects = [Fault("offset", ("heading",), angle, "turned", std)]
    if kind == "course":
        suspects.append(Fault("offset", channels[2:], -angle, "turned", std))
    elif kind in ("earth", "body"):
        suspects += [
            Fault("swap", velocity.channels),
            Fault("frame", velocity.channels, name=f"{'body' if kind == 'earth' else 'earth'}-fixed"),
            *(Fault("sign", (channel,)) for channel in velocity.channels),
        ]
    else:
        suspects += [Fault("swap", velocity.channels), *(Fault("sign", (channel,)) for channel in velocity.channels)]
    return Outcome(name, channels, figure.state, words, (figure,), way.left_over, tuple(suspects))


@dataclass(frozen=True)
class _Way:
    """The way that a ship makes herself, seen from the bow."""

    #: angle, own_std: Of it, with what noise and an unknown stream make of it, rad.
    angle: float
    own_std: float
    #: Size of what is left of the velocity over the size of it.
    left_over: float
    #: Why it says nothing of the mounting; empty where it does.
    why_not: str


def _way(log: Log, kind: str, heading: Series, velocity: Velocity) -> _Way | None:
    """Return the way A, None for too few readings under way."""
    sectors = _seen_from_the_bow(kind, heading, velocity)
    if sectors is None:
        return None
    relative, bow, rate, duration = sectors
    speed = quantile(np.abs(relative), 0.5)
    fast = max(quantile(np.abs(rate), 0.95), 1e-6)
    prior = np.array([np.inf, np.inf, *[stream_std(log, speed)] * 2, *[DRIFT_RAD * speed / fast] * 2])
    noise = speed * np.hypot(_SECTOR_STD, _SECOND_STD / np.sqrt(duration))
    # speed that she loses and gathers again is no stream: along the way it adds to the error, across it does not
    along = np.hypot(noise, _varies(np.abs(relative)))
    axis = float(np.angle(np.sum(relative)))
    for _ in range(_ROUNDS):
        seen_so = relative * np.exp(-1j * axis)
        observed, noises = np.concatenate([seen_so.real, seen_so.imag]), np.concatenate([along, noise])
        fitted = posterior(_columns(bow + axis, rate), observed, noises, prior)
        ahead, across = fitted.value[:2]
        axis += float(np.arctan2(across, ahead))
    way = max(float(np.hypot(ahead, across)), 1e-12)
    # of A's standard errors, the part across A
    own = float(np.hypot(fitted.std[1] * ahead / way, fitted.std[0] * across / way)) / way
    why_not = ""
    if way < _LEAST_WAY * speed or fitted.left_over > _TOGETHER:
        why_not = "heading and direction of the velocity are not correlated"
    elif own > _SURE_WAY:
        why_not = "the way that she makes herself cannot be distinguished from a stream"
    return _Way(float(np.angle(np.exp(1j * axis))), own, fitted.left_over, why_not)


def _repeated(log: Log, kind: str, heading: Series, velocity: Velocity, angle: float) -> bool:
    """Return whether each stretch of the log that determines the angle shows it, and two at least if she may drift."""
    start, end = int(velocity.time_utc_ns[0]), int(velocity.time_utc_ns[-1])
    edges = np.linspace(start, end, _STRETCHES + 1).astype(np.int64)
    shown = 0
    for first, last in pairwise(edges):
        part = (velocity.time_utc_ns >= first) & (velocity.time_utc_ns <= last)
        if not part.any():
            continue
        own = replace(velocity, time_utc_ns=velocity.time_utc_ns[part], value=velocity.value[part],
                      direction=velocity.direction[part])  # fmt: skip
        way = _way(log, kind, heading, own)
        if way is None or way.why_not:
            continue
        off = float(np.angle(np.exp(1j * (way.angle - angle))))
        if abs(off) > max(_ASTRAY * abs(angle), 2.0 * float(np.hypot(way.own_std, _LEEWAY_RAD))):
            return False
        shown += 1
    return shown > 1 or not may_drift(log, quantile(np.abs(velocity.value), 0.5))


def _varies(speed: Float) -> float:
    """Return the standard deviation of speeds, from their median size beside the median, m/s."""
    return MAD_TO_STD * quantile(np.abs(speed - quantile(speed, 0.5)), 0.5)


def _columns(bow: Float, rate: Float) -> Float:
    """Return the columns of A, C and S (real, imaginary part) for the real parts above the imaginary parts."""
    one, none, cos, sin = np.ones_like(bow), np.zeros_like(bow), np.cos(bow), np.sin(bow)
    real = np.column_stack([one, none, cos, sin, rate, none])
    imaginary = np.column_stack([none, one, -sin, cos, none, rate])
    return np.concatenate([real, imaginary])


def _seen_from_the_bow(kind: str, heading: Series, velocity: Velocity) -> tuple[Complex, Float, Float, Float] | None:
    """Return the velocity relative to the bow, heading, yaw rate and duration (s) by sectors, each shape (n,)."""
    rate = turning(heading)
    bow = heading.at(velocity.time_utc_ns, gap_limit_s(heading))
    turn = rate.at(velocity.time_utc_ns, max(gap_limit_s(rate), 3.0)) if len(rate) > 1 else np.full(bow.shape, np.nan)
    good = velocity.under_way & np.isfinite(bow) & np.isfinite(turn)
    if np.count_nonzero(good) < _FEWEST:
        return None
    time, bow, turn = velocity.time_utc_ns[good], bow[good], turn[good]
    relative = velocity.value[good] * (1.0 if kind == "body" else np.exp(-1j * bow))
    fast = quantile(np.abs(turn), 0.95)
    side = np.where(np.abs(turn) > _TURNING * fast, np.sign(turn), 0.0) + 1.0
    sector = np.floor(np.mod(bow, 2 * np.pi) / (2 * np.pi / _SECTORS)).astype(np.int64) * 3 + side.astype(np.int64)
    order = np.argsort(sector, kind="stable")
    starts = np.flatnonzero(np.concatenate([[True], np.diff(sector[order]) > 0]))
    count = np.diff(np.append(starts, sector.size))
    mean = np.asarray(np.add.reduceat(relative[order], starts), dtype=np.complex128) / count
    ahead = np.angle(np.add.reduceat(np.exp(1j * bow)[order], starts))
    turned: Float = np.add.reduceat(turn[order], starts) / count
    kept = count >= max(_FEWEST // 4, sector.size // 500)
    lasted = count * float(np.median(np.diff(time))) / SECOND_NS
    return (mean[kept], ahead[kept], turned[kept], lasted[kept]) if kept.any() else None
