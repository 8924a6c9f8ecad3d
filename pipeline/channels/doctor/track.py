"""Positions against velocities: the way from fix to fix is the integral of the velocity, in length and in direction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kempf.pipeline.channels.doctor.faults import AXES, Fault, unit_faults
from kempf.pipeline.channels.doctor.log import VELOCITIES, Complex, Log, fix_noise
from kempf.pipeline.channels.doctor.motion import does_not_move
from kempf.pipeline.channels.doctor.outcome import STILL, CheckFigure, Outcome, untestable, worst
from kempf.pipeline.channels.doctor.robust_regression import fit, quantile
from kempf.pipeline.channels.robust_std import MAD_TO_STD
from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.schemas.units import SECOND_NS

#: Ratios of the two ways that are no fault, and angles between them, deg.
RATIOS, _ANGLES_DEG = (0.85, 1.18), (-6.0, 6.0)
#: Share of the body-fixed velocity across the bow that the fixes show.
_ACROSS = (0.3, 3.0)
#: Circular variance of the angles between them that is no fault.
_ASTRAY = 0.15
#: Windows: so many at most, over each other by three quarters; the way within each, in noises of a fix; so many at
#: least.
_MOST, _OVER, _CLEAR, _FEWEST = 240, 4.0, 30.0, 8
#: The way within a window, m, at least: noise of a fix that remembers what it was does not show from fix to fix.
_CLEAR_M = 5.0
_OVER_GROUND = ("speed_over_ground",)
#: The log is so many windows long at least.
_LEAST_WINDOWS = 2.5


def examine(log: Log, *, thorough: bool = True) -> list[Outcome]:
    """Compare the way between the fixes with the integral of every velocity over ground that the log has.

    Returns
    -------
    list of Outcome
        ``path_KIND`` (length) and ``bearing_KIND`` (direction) for each kind of velocity but the track itself;
        ``across_body`` for the drift of a body-fixed one.
    """
    track = log.track()
    if track is None:
        return []
    outcomes = []
    for kind in ("course", "earth", "body"):
        velocity = log.over_ground(kind)
        if velocity is None or velocity.time_utc_ns.size < _FEWEST:
            continue
        still = does_not_move(log)
        values = [velocity.value]
        if kind == "body":
            across = log.series["velocity_starboard"]
            mirrored = log.with_series({"velocity_starboard": Series(across.time_utc_ns, -across.value)})
            values += [other.value for other in [mirrored.over_ground(kind)] if other is not None]
            bow = np.exp(1j * log.series["heading"].at(velocity.time_utc_ns, np.inf))
            # what a place one metre ahead of the sensor moves more
            values.append(np.gradient(bow, velocity.time_utc_ns / SECOND_NS))
        ways = None if still else _ways(track, velocity.time_utc_ns, *values)
        channels = ("latitude", "longitude", *velocity.channels, *(("heading",) if kind == "body" else ()))
        pair = VELOCITIES[kind]
        speed = pair[:1] if kind == "course" else pair
        if ways is None:
            why = STILL if still else "the distance between the position fixes is too short"
            outcomes += [untestable(f"{check}_{kind}", channels, why) for check in ("path", "bearing")]
            continue
        length_channels = channels if kind == "body" else ("latitude", "longitude", *speed)
        # in a turn to one side only, a fix that is late looks turned
        step = np.diff(velocity.time_utc_ns) / SECOND_NS
        late = 1.0 + quantile(step, 0.5)
        one_sided = late * abs(quantile(np.diff(velocity.direction) / step, 0.5))
        outcomes += [_length(f"path_{kind}", length_channels, speed, ways), _direction(kind, channels, ways, one_sided)]
        if len(values) > 2:
            outcomes.append(_across(channels, ways))
    if not outcomes and "speed_over_ground" in log.series:
        outcomes += _without_course(log, track)
    return outcomes


def _ways(
    track: tuple[Nanoseconds, Complex], time: Nanoseconds, velocity: Complex, *others: Complex
) -> tuple[Complex, ...] | None:
    """Return the displacements by the fixes, by the velocity and by other ones, each shape (n,); None for too few."""
    start, end = max(int(track[0][0]), int(time[0])), min(int(track[0][-1]), int(time[-1]))
    span = (end - start) / SECOND_NS
    fast = quantile(np.abs(velocity), 0.75)
    gone = abs(np.diff(track[1])).sum() / max((track[0][-1] - track[0][0]) / SECOND_NS, 1e-9)
    # whichever of the two is in the wrong unit, the smaller speed makes the window long enough
    speed = max(min(fast, float(gone)), 1e-3)
    periods = [quantile(np.diff(t) / SECOND_NS, 0.5) for t in (track[0], time)]
    way = max(_CLEAR * fix_noise(track[1]), _CLEAR_M)
    window = max(way / speed, 4.0 * max(periods))
    if span < _LEAST_WINDOWS * window:
        return None
    count = min(int(_OVER * span / window), _MOST)
    # windows of that length, spread over the log
    begin = start + np.linspace(0, (span - window) * SECOND_NS, count).astype(np.int64)
    stop = begin + round(window * SECOND_NS)
    gap = max(3.0 * max(periods), 1.0)
    moved = _between(track[0], track[1], begin, stop, gap)
    step = np.diff(time) / SECOND_NS
    gone, *more = (_between(time, _summed(each, step), begin, stop, gap) for each in (velocity, *others))
    good = np.isfinite(moved) & np.isfinite(gone)
    good &= np.maximum(np.abs(moved), np.abs(gone)) > 0.5 * way
    return tuple(each[good] for each in (moved, gone, *more)) if np.count_nonzero(good) >= _FEWEST else None


def _summed(velocity: Complex, step: Float) -> Complex:
    return np.concatenate([[0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * step)])


def _between(time: Nanoseconds, place: Complex, begin: Nanoseconds, stop: Nanoseconds, gap: float) -> Complex:
    north, east = Series(time, place.real), Series(time, place.imag)
    moved: Complex = (north.at(stop, gap) - north.at(begin, gap)) + 1j * (east.at(stop, gap) - east.at(begin, gap))
    return moved


def _length(name: str, channels: tuple[str, ...], speed: tuple[str, ...], ways: tuple[Complex, ...]) -> Outcome:
    moved, gone = np.abs(ways[0]), np.abs(ways[1])
    good = (moved > 0.0) & (gone > 0.0)
    if np.count_nonzero(good) < _FEWEST:
        return untestable(name, channels, "position constant, or speed zero")
    return _length_outcome(name, channels, speed, np.log(gone[good] / moved[good]))


def _length_outcome(name: str, channels: tuple[str, ...], speed: tuple[str, ...], ratios: Float) -> Outcome:
    """Judge the logarithms of the ratios of the way by the velocity to the way by the fixes, shape (n,)."""
    middle = quantile(ratios, 0.5)
    spread = MAD_TO_STD * quantile(np.abs(ratios - middle), 0.5)
    ratio = float(np.exp(middle))
    # the windows overlap: a quarter of them is independent
    std = ratio * spread / np.sqrt(max(ratios.size / 4.0, 1.0))
    figure = CheckFigure("integrated speed over distance between fixes", ratio, max(std, 1e-4 * ratio), *RATIOS)
    quantity = "velocity" if len(speed) > 1 else speed[0].replace("_", " ")
    words = f"integrated {quantity} is {ratio:.3g} ± {std:.1g} (1 s.e.) times the distance between fixes"
    suspects = [
        *unit_faults(speed, "m/s"),
        *unit_faults(("latitude", "longitude"), "rad"),
        *((Fault("swap", ("latitude", "longitude")),) if {"latitude", "longitude"} <= set(channels) else ()),
        Fault("scale", speed, 1.0 / ratio, "scale", std / ratio**2, simplicity=3),
    ]
    if speed == _OVER_GROUND:
        # one logger writes both speeds, and in one unit
        both = unit_faults((*_OVER_GROUND, "speed_through_water"), "m/s")
        suspects += [replace(fault, simplicity=fault.simplicity + 1) for fault in both]
    return Outcome(name, channels, figure.state, words, (figure,), min(spread + abs(middle), 1.0), tuple(suspects))


def _direction(kind: str, channels: tuple[str, ...], ways: tuple[Complex, ...], one_sided: float) -> Outcome:
    moved, gone = ways[:2]
    turn = moved * np.conj(gone)
    unit = turn / np.maximum(np.abs(turn), 1e-300)
    mean = complex(np.mean(unit))
    angle = float(np.angle(mean))
    # the circular variance
    astray = 1.0 - abs(mean)
    off = np.angle(unit * np.exp(-1j * angle))
    own = MAD_TO_STD * quantile(np.abs(off), 0.5) / np.sqrt(max(off.size / 4.0, 1.0))
    std = float(np.hypot(own, one_sided))
    figures = (
        CheckFigure(
            "bearing between fixes minus direction of the velocity",
            np.rad2deg(angle),
            max(np.rad2deg(std), 0.1),
            *_ANGLES_DEG,
            "deg",
        ),
        CheckFigure("circular variance of that difference", astray, 0.02, 0.0, _ASTRAY),
    )
    words = (
        f"bearing between fixes minus direction of the velocity is {figures[0].value:+.1f} ± {figures[0].std:.1g} deg "
        f"(1 s.e.), with a circular variance of {astray:.2f}"
    )
    pair = VELOCITIES[kind]
    positions = ("latitude", "longitude")
    suspects = [
        Fault("swap", positions), Fault("sign", positions[:1]), Fault("sign", positions[1:]),
    ]  # fmt: skip
    if kind == "course":
        course = pair[1:]
        suspects += [
            Fault("sign", course),
            Fault("offset", course, np.pi / 2, "counted anticlockwise from east", simplicity=2),
            Fault("offset", course, angle, "turned", std, simplicity=2),
            *unit_faults(course, "rad"),
        ]
    else:
        suspects += [
            Fault("swap", pair), Fault("sign", pair[:1]), Fault("sign", pair[1:]),
            Fault("frame", pair, name=f"{'body' if kind == 'earth' else 'earth'}-fixed"), *AXES,
        ]  # fmt: skip
        if kind == "body":
            suspects += [Fault("offset", ("heading",), angle, "turned", std, simplicity=2), Fault("sign", ("heading",))]
    state = worst([figure.state for figure in figures])
    return Outcome(f"bearing_{kind}", channels, state, words, figures, min(astray, 1.0), tuple(suspects))


def _across(channels: tuple[str, ...], ways: tuple[Complex, ...]) -> Outcome:
    """Compare the way across the bow: a drift to the other side is as long, and its bearing in the mean as right.

    An antenna ahead of the sensor moves across the bow by itself as she turns.
    """
    moved, gone, mirrored, lever = ways
    ahead, across = 0.5 * (gone + mirrored), 0.5 * (gone - mirrored)
    bow = ahead / np.maximum(np.abs(ahead), 1e-300)
    columns = np.column_stack([np.imag(across * np.conj(bow)), np.abs(ahead), np.imag(lever * np.conj(bow))])
    # what goes with the way ahead is an angle between compass and sensor
    line = fit(columns, np.imag(moved * np.conj(bow)))
    if line is None:
        return untestable("across_body", channels, "position constant, or speed zero")
    slope, std = float(line.value[0]), float(line.std[0])
    figure = CheckFigure("way across the bow by the fixes over that by the velocity", slope, std, *_ACROSS)
    words = f"the fixes show {slope:.2f} ± {std:.2g} (1 s.e.) times the drift of the velocity across the bow"
    suspects = (
        Fault("sign", VELOCITIES["body"][1:]),
        *(Fault("sign", (name,)) for name in ("latitude", "longitude", "heading")),
    )
    return Outcome("across_body", channels, figure.state, words, (figure,), min(line.left_over, 1.0), suspects)


def _without_course(log: Log, track: tuple[Nanoseconds, Complex]) -> list[Outcome]:
    """Compare lengths alone where the log has a speed but no course."""
    speed = log.series["speed_over_ground"]
    channels = ("latitude", "longitude", "speed_over_ground")
    if does_not_move(log):
        return [untestable("path_course", channels, STILL)]
    ways = _ways(track, speed.time_utc_ns, speed.value.astype(np.complex128))
    if ways is None:
        return [untestable("path_course", channels, "the distance between the position fixes is too short")]
    return [_length("path_course", channels, ("speed_over_ground",), ways)]
