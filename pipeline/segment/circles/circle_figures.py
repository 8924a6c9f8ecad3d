"""The figures of a measured turning circle with their intervals, corrected for a stream where it can be seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from math import nan, pi

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.segment.circles.circle_drift import CircleDrift, circle_drift, current_by_log, is_current
from kempf.pipeline.segment.circles.turn_track import TurnTrack
from kempf.pipeline.segment.circles.turning_figures import STEADY_FROM_RAD, TurningFigures, steady_span, turning_figures
from kempf.pipeline.segment.figure import MeasuredFigure

#: Standard error of an integrated distance, as a share of it: the scale of the speed. Of a free-running model whose
#: positions were logged beside her velocities the two differ by 2 to 4 %.
_SPEED_SCALE = 0.02

#: Parts into which the steady turn is divided to see how steady it was.
_PARTS = 4

_FROM_EXECUTE = ("advance_m", "transfer_m", "tactical_diameter_m", "time_to_90_s", "time_to_180_s")
_LENGTHS = ("advance_m", "transfer_m", "tactical_diameter_m")
_STEADY = ("steady_diameter_m", "steady_yaw_rate_deg_s", "steady_drift_deg", "speed_loss_percent")


@dataclass(frozen=True)
class CircleFigures:
    """What a turning circle measures."""

    #: By the names of `TurningFigures`, and ``steady_diameter_of_track_m`` where there are positions.
    figures: Mapping[str, MeasuredFigure]
    #: over_ground, less_drift: The same over ground and less the drift of the circle, whichever ``figures`` has; empty
    #: where the drift is not known.
    over_ground: Mapping[str, float | None]
    less_drift: Mapping[str, float | None]
    #: What the track was made of; "heading alone" where there is none.
    track: str
    #: By how much the circle drifts over ground; None where that could not be seen.
    drift: CircleDrift | None
    #: Whether it was taken off as of a current.
    corrected: bool
    #: Mean speed of the approach, as the figures have it, m/s; NaN where none is recorded.
    approach_speed_m_s: float
    #: Change of the recorded speed over the approach, percent of its mean; NaN where there is no approach.
    approach_speed_trend_percent: float
    #: What a person should know, one sentence each.
    reasons: tuple[str, ...]


def circle_figures(
    track: TurnTrack,
    *,
    execute_s: float | None,
    execute_std_s: float,
    begin_s: float,
    course_std_rad: float,
) -> CircleFigures:
    """Measure a turning circle.

    Parameters
    ----------
    track : TurnTrack
        From the approach to the end, over ground.
    execute_s : float or None
        When the rudder starts to move, s; None where that is not recorded: then only what is steady is measured.
    execute_std_s : float
        Standard error of it, s.
    begin_s : float
        When the turn begins: at the execute, or where it is recorded from, s.
    course_std_rad : float
        Scatter of the heading in the approach, rad; NaN where there is none.

    Returns
    -------
    CircleFigures

    Notes
    -----
    The interval of what is measured from the execute holds the instant of the execute, the scatter of the approach's
    heading, the noise of the positions and the uncertainty of the stream, each by difference quotients. The interval of
    what is steady is the scatter of four parts of the steady turn, and what the uncertainty of a current does that the
    water log shows of less than whole turns.
    """
    reasons: list[str] = []
    source = track.source
    if source == "heading alone":
        reasons.append("No positions and no speed are recorded: only rates and times are measured.")
    begin = min(max(begin_s, float(track.time_s[0])), float(track.time_s[-2]))
    before = track.time_s <= begin
    course = float(np.mean(track.heading_rad[before]))
    through_water = source == "speed through the water and heading"
    drift = None if source == "heading alone" or through_water else circle_drift(track, begin, course)
    by_passages = drift is not None
    if drift is None and source != "heading alone" and not through_water:
        drift = current_by_log(track, begin, course)
    if by_passages:
        agreed = drift is not None and drift.seen and is_current(drift, track, begin)
    else:
        agreed = drift is not None and drift.seen_by_log
    freed = track if drift is None else track.without(drift.north_m_s, drift.east_m_s)
    corrected = freed if agreed else track
    over_ground, less_drift, corrected_figures = (
        turning_figures(*_columns(path), begin) for path in (track, freed, corrected)
    )
    if through_water:
        reasons.append("The track is made of the water log's speed along the heading: the drift angle is left out.")
    elif source != "heading alone" and drift is None:
        reasons.append("The figures are over ground: less than 600 deg were turned, and no water log shows a current.")
    elif drift is not None:
        reasons.append(_said_of(drift, agreed=agreed, by_passages=by_passages))
    if track.bridged_share > 0:
        reasons.append(f"The course over ground was impossible in {100 * track.bridged_share:.1f} % of the record.")
    spread = _steady_spread(corrected, begin, course, corrected_figures)
    uncertain = 0.0 if drift is None or (by_passages and drift.seen and not agreed) else drift.std_m_s
    nudged = _nudges(corrected, uncertain, begin, execute_std_s, course_std_rad)
    figures: dict[str, MeasuredFigure] = {}
    values = asdict(corrected_figures)
    for name in _FROM_EXECUTE:
        figures[name] = _from_execute(name, values[name], nudged, track, execute_s)
    short = "the heading changed by less than a whole turn"
    for name in _STEADY:
        missing = "not recorded" if abs(corrected_figures.heading_change_deg) >= np.rad2deg(STEADY_FROM_RAD) else short
        # over whole turns a current averages out of what is steady, over less it does not
        by_current = [] if by_passages or not uncertain else nudged[-2:]
        halves = [(getattr(high, name) - getattr(low, name)) / 2.0 for low, high in by_current]
        figures[name] = MeasuredFigure.of(values[name], float(np.hypot(spread[name], np.linalg.norm(halves))), missing)
    if not np.isfinite(course_std_rad):
        figures["speed_loss_percent"] = MeasuredFigure.of(nan, nan, "the approach was not steady or is not recorded")
    if source == "positions":
        figures["steady_diameter_of_track_m"] = _fitted_diameter(corrected, begin, course, short)
    return CircleFigures(
        figures=figures,
        over_ground={} if drift is None else _named(over_ground),
        less_drift={} if drift is None else _named(less_drift),
        track=source,
        drift=drift,
        corrected=agreed,
        approach_speed_m_s=float(np.mean(corrected.speed_m_s[before])),
        approach_speed_trend_percent=_trend_percent(track.time_s[before], track.speed_m_s[before]),
        reasons=tuple(reasons),
    )


def _said_of(drift: CircleDrift, *, agreed: bool, by_passages: bool) -> str:
    """Say what became of a drift that passages of the same headings show, or of a current that the water log does."""
    towards_deg = float(np.rad2deg(np.arctan2(drift.east_m_s, drift.north_m_s))) % 360.0
    size = f"{drift.size_m_s:.3g} m/s towards {towards_deg:.0f} deg"
    if agreed and not by_passages:
        return f"The water log shows a current of {size}: it is taken off."
    if agreed:
        return f"The circle drifts by {size}, and so does the water, as the water log shows: it is taken off."
    if by_passages and drift.seen:
        return f"The circle drifts by {size}; no water log shows a current: the figures are over ground."
    what = "The circle drifts by" if by_passages else "By the water log the current is"
    return f"{what} less than {2.0 * drift.std_m_s:.2g} m/s: the figures are over ground."


def _columns(track: TurnTrack) -> tuple[Float, Float, Float, Float, Float, Float]:
    return track.time_s, track.north_m, track.east_m, track.heading_rad, track.speed_m_s, track.drift_rad


def _nudges(
    track: TurnTrack, stream_std_m_s: float, execute_s: float, execute_std_s: float, course_std_rad: float
) -> list[tuple[TurningFigures, TurningFigures]]:
    """Return the figures with each uncertain input one standard error lower and higher."""

    def figures(shift_s: float = 0.0, course: float = 0.0, north: float = 0.0, east: float = 0.0) -> TurningFigures:
        moved = track.without(north, east) if north or east else track
        if course:
            heading = moved.heading_rad + np.where(moved.time_s <= execute_s, course, 0.0)
            moved = replace(moved, heading_rad=heading)
        at = min(max(execute_s + shift_s, float(track.time_s[0])), float(track.time_s[-2]))
        return turning_figures(*_columns(moved), at)

    pairs = []
    if np.isfinite(execute_std_s):
        pairs.append((figures(shift_s=-execute_std_s), figures(shift_s=execute_std_s)))
    if np.isfinite(course_std_rad):
        pairs.append((figures(course=-course_std_rad), figures(course=course_std_rad)))
    if stream_std_m_s > 0:
        std = stream_std_m_s
        pairs += [(figures(north=-std), figures(north=std)), (figures(east=-std), figures(east=std))]
    return pairs


def _from_execute(
    name: str,
    value: float,
    nudged: list[tuple[TurningFigures, TurningFigures]],
    track: TurnTrack,
    execute_s: float | None,
) -> MeasuredFigure:
    if execute_s is None:
        return MeasuredFigure.of(nan, nan, "the execute is not recorded")
    if name in _LENGTHS and track.source == "heading alone":
        return MeasuredFigure.of(nan, nan, "no positions and no speed are recorded")
    if name in _LENGTHS and track.source == "speed through the water and heading":
        return MeasuredFigure.of(value, nan, "the drift angle is not measured, and its error not known")
    variance = sum(((getattr(high, name) - getattr(low, name)) / 2.0) ** 2 for low, high in nudged)
    if name in _LENGTHS and np.isfinite(track.distance_std_m):
        variance += track.distance_std_m**2
    elif name in _LENGTHS:
        variance += (_SPEED_SCALE * value) ** 2
    return MeasuredFigure.of(value, float(np.sqrt(variance)), "not reached")


def _steady_spread(track: TurnTrack, execute_s: float, course: float, figures: TurningFigures) -> dict[str, float]:
    """Return the standard errors of what is steady, by name, from its values in four parts of the steady turn."""
    parts = _parts(track, execute_s, course)
    if parts is None:
        return dict.fromkeys(_STEADY, nan)
    rate, speed, drift = parts.T
    approach = track.speed_m_s[track.time_s <= execute_s]
    share = 1.0 - figures.speed_loss_percent / 100.0
    moving = bool(np.mean(speed) > 0 and np.mean(approach) > 0)
    loss = np.hypot(_error(speed) / np.mean(speed), np.std(approach) / np.mean(approach)) if moving else nan
    return {
        "steady_diameter_m": _error(2.0 * speed / rate),
        "steady_yaw_rate_deg_s": float(np.rad2deg(_error(rate))),
        "steady_drift_deg": float(np.rad2deg(_error(drift))),
        "speed_loss_percent": 100.0 * share * float(loss),
    }


def _error(values: Float) -> float:
    return float(np.std(values, ddof=1) / np.sqrt(values.size))


def _parts(track: TurnTrack, execute_s: float, course: float) -> Float | None:
    """Return yaw rate, speed and drift in each part of the steady turn, SI, shape (4, 3)."""
    after = track.time_s >= execute_s
    time_s = track.time_s[after]
    change = track.heading_rad[after] - course
    side = 1.0 if change[-1] >= 0 else -1.0
    start, end = steady_span(time_s, side * change)
    if not end > start:
        return None
    border = np.linspace(start, end, _PARTS + 1)
    rows = []
    for low, high in pairwise(border.tolist()):
        t = np.linspace(low, high, 50)
        turned = side * (np.interp(high, time_s, change) - np.interp(low, time_s, change))
        means = [float(np.mean(np.interp(t, track.time_s, c))) for c in (track.speed_m_s, track.drift_rad)]
        rows.append([turned / (high - low), *means])
    return np.array(rows, dtype=np.float64)


def _fitted_diameter(track: TurnTrack, execute_s: float, course: float, short: str) -> MeasuredFigure:
    """Lay a circle through the positions of the steady turn; the standard error is their scatter about it."""
    after = track.time_s >= execute_s
    change = track.heading_rad[after] - course
    start, end = steady_span(track.time_s[after], np.sign(change[-1]) * change)
    inside = (track.time_s >= start) & (track.time_s <= end)
    if np.count_nonzero(inside) < 8:
        return MeasuredFigure.of(nan, nan, short)
    north, east = track.north_m[inside], track.east_m[inside]
    north, east = north - np.mean(north), east - np.mean(east)
    # the circle's equation is linear in its centre and in radius squared less centre squared (Kasa 1976)
    basis = np.column_stack([2.0 * north, 2.0 * east, np.ones(north.size)])
    solved = np.linalg.lstsq(basis, north**2 + east**2, rcond=None)[0]
    radius = float(np.sqrt(solved[2] + solved[0] ** 2 + solved[1] ** 2))
    away = np.hypot(north - solved[0], east - solved[1]) - radius
    # a diameter is off by twice what its radius is; an arc of less than a whole turn holds its centre less well
    arc = min(abs(float(np.ptp(track.heading_rad[inside]))) / (2.0 * pi), 1.0)
    return MeasuredFigure.of(2.0 * radius, 2.0 * float(np.std(away)) / arc**2, short)


def _trend_percent(time_s: Float, speed: Float) -> float:
    if time_s.size < 5 or not np.mean(speed) > 0:
        return nan
    slope = float(np.polyfit(time_s - time_s[0], speed, 1)[0])
    return 100.0 * slope * float(time_s[-1] - time_s[0]) / float(np.mean(speed))


def _named(figures: TurningFigures) -> dict[str, float | None]:
    return {name: value if np.isfinite(value) else None for name, value in asdict(figures).items()}
