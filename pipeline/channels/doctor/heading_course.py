"""Course against heading: a ship goes where her bow points, but for drift in a turn, leeway and stream.

Here the turning is compared - its sense, its amount, its time. Whether the two point the same way on average is asked
in `kempf.pipeline.channels.doctor.misalignment`.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.doctor.align import LONGEST_S, align
from kempf.pipeline.channels.doctor.clocks import clock_figures, clock_outcome
from kempf.pipeline.channels.doctor.faults import AXES, BOW_AND_COURSE, Fault, unit_faults
from kempf.pipeline.channels.doctor.log import Log, Velocity, fastest_turn
from kempf.pipeline.channels.doctor.motion import moves, stream_std
from kempf.pipeline.channels.doctor.outcome import STILL, SURE, CheckFigure, Outcome, untestable
from kempf.pipeline.channels.doctor.robust_regression import quantile, reach
from kempf.pipeline.channels.series import Series

#: Slope of the course's changes on the heading's: drift in the quick turns of a zigzag lets the course swing further.
SLOPES = (0.5, 2.0)
#: A body-fixed velocity does not turn with the heading; in a turn its drift angle comes and goes.
_BODY_SLOPES = (-0.5, 0.5)
#: Largest drift angle in a turn, rad: ships in their tightest circle make about 20 degrees.
DRIFT_RAD = 0.45
_LEAST_TURN = float(np.deg2rad(20.0))
#: How far before the point about which the bow turns an antenna is mounted, in ship lengths.
_LEADS = 0.25
#: What is left over of two motions that go together; else a steady turn shows a slope, if so far at least, rad.
_TOGETHER, _STEADY_TURN = 0.6, 1.5


def examine(log: Log, *, thorough: bool = True) -> list[Outcome]:
    """Compare the turning of the bow with that of every velocity that the log has.

    Returns
    -------
    list of Outcome
        ``heading_KIND`` and ``heading_KIND_clock`` for each kind of velocity, see `VELOCITIES`.

    References
    ----------
    Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., section 2.5: course, heading
    and crab angle.
    """
    outcomes: list[Outcome] = []
    heading = log.series.get("heading")
    if heading is not None:
        for kind, velocity in log.velocities(track=thorough):
            outcomes += _compare(log, kind, heading, velocity, thorough=thorough)
    return outcomes


def _compare(log: Log, kind: str, heading: Series, velocity: Velocity, *, thorough: bool) -> list[Outcome]:
    names = [f"heading_{kind}", *([f"heading_{kind}_clock"] if thorough else [])]
    channels = ("heading", *velocity.channels)
    if not moves(velocity, log):
        return [untestable(name, channels, STILL) for name in names]
    way = velocity.under_way
    direction = Series(velocity.time_utc_ns[way], velocity.direction[way])
    turned = max(reach(heading.value), reach(direction.value)) if len(direction) else 0.0
    if turned < _LEAST_TURN:
        return [untestable(name, channels, "the ship hardly turned while under way") for name in names]
    speed = quantile(np.abs(velocity.value[way]), 0.5)
    if velocity.blurred(heading):
        return [untestable(name, channels, "the position fixes are too coarse to resolve the turns") for name in names]
    own = _own_lag(log, heading, speed)
    late = 1.0 + heading.period_s + direction.period_s
    # the antenna may be ahead of the point about which she turns: then the course leads
    honest = (-late - _LEADS * own, late + own)
    both = align(heading, direction, honest, circle=True, longest_s=LONGEST_S if thorough else 0.0)
    steady = both is not None and both.varying > _TOGETHER
    if both is None or (steady and both.turned < _STEADY_TURN):
        why = "the channels hardly overlap in time" if both is None else "the two motions are not correlated"
        return [untestable(name, channels, why) for name in names]
    slope, own_std = (both.whole, both.whole_std) if steady else (both.slope, both.slope_std)
    std = float(np.hypot(own_std, 0.5 * stream_std(log, speed) / speed))
    low, high = _BODY_SLOPES if kind == "body" else SLOPES
    figure = CheckFigure("change of direction of the velocity over change of heading", slope, std, low, high)
    words = f"the {_WORDS[kind]} changes by {slope:.2f} ± {std:.2g} (1 s.e.) times the change of heading"
    state = figure.state
    if both.left_over > _TOGETHER and figure.outside < 1.5 * SURE:
        state = "untestable"  # a slope through noise
    turn = Outcome(names[0], channels, state, words, (figure,), both.left_over, _suspects(kind, velocity.channels))
    if kind == "body" or not thorough:
        return [turn]
    figures = clock_figures(both, honest, heading, own)
    also = (BOW_AND_COURSE,) if kind == "course" else ()
    return [turn, clock_outcome(names[1], (("heading",), velocity.channels), both, figures, also)]


_WORDS = {
    "course": "course over ground",
    "earth": "direction of the earth-fixed velocity",
    "body": "direction of the body-fixed velocity",
    "track": "bearing between position fixes",
}


def _own_lag(log: Log, heading: Series, speed: float) -> float:
    """Return by how much the course may lag behind the heading because she drifts in a turn, s."""
    # the bow turns about a point no farther ahead than the ship is long
    return DRIFT_RAD / max(fastest_turn(heading), 1e-6) if log.length_m is None else log.length_m / speed


def _suspects(kind: str, channels: tuple[str, str]) -> tuple[Fault, ...]:
    ninety = np.pi / 2
    faults = [
        Fault("sign", ("heading",)),
        Fault("offset", ("heading",), ninety, "counted anticlockwise from east", simplicity=2),
        *unit_faults(("heading",), "rad"),
        *AXES,
    ]
    if kind == "course":
        course = (channels[1],)
        faults += [
            Fault("sign", course),
            Fault("offset", course, ninety, "counted anticlockwise from east", simplicity=2),
            *unit_faults(course, "rad"),
            BOW_AND_COURSE,
        ]
    elif kind == "track":
        faults += [Fault("swap", channels), Fault("sign", channels[:1]), Fault("sign", channels[1:])]
    else:
        faults += [Fault("frame", channels, name=f"{'body' if kind == 'earth' else 'earth'}-fixed")]
        faults += [Fault("swap", channels), Fault("sign", channels[:1]), Fault("sign", channels[1:])]
    return tuple(faults)
