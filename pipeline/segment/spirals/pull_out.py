"""Pull-outs: out of a steady turn the rudder is put amidships and held while the yaw rate dies down to what remains.

A ship that is stable on a straight course comes to the same rate from either side; one that is not goes on turning to
the side that she came from.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import nan, pi
from typing import Literal

import numpy as np

from kempf.pipeline.segment.figure import MeasuredFigure
from kempf.pipeline.segment.rudder.held_rudder import HeldRudder
from kempf.pipeline.segment.rudder.measured import Signals
from kempf.pipeline.segment.rudder.nominal import RUDDER_TOLERANCE, nominal_angle
from kempf.pipeline.segment.rudder.ramps import measure_ramp
from kempf.pipeline.segment.rudder.yaw_rate import MeanYawRate, mean_yaw_rate, settling_rate
from kempf.pipeline.segment.settings import SegmentSettings
from kempf.schemas.side import Side

#: What a pair of pull-outs says about the ship on a straight course.
Verdict = Literal["unstable", "no instability seen", "not judged"]

#: Smallest heading change of the turn before, rad.
_SMALLEST_TURN_RAD = pi / 3

#: Largest rudder that is about amidships, as a share of the turn's and at least, rad.
_AMIDSHIPS_SHARE, _AMIDSHIPS_RAD = 0.2, float(np.deg2rad(2.0))

#: Largest change of the yaw rate over the while in which it counts as steady, as a share of it: in the turn and behind.
_STEADY_TURN, _STEADY_END = 0.2, 0.1

#: How long the rudder is held amidships, in times of a heading change of 90 deg at the rate of the turn: at least, and
#: as far as it is looked at.
_SHORTEST, _LONGEST = 0.5, 8.0

#: Part of the turn at whose end its rate is taken.
_LAST_PART = 1.0 / 3.0

#: Largest error of the rate to which she comes, as a share of the turn's, with which it counts as known.
_KNOWN = 1.0 / 3.0

#: Share of the rates of the turns that has to be seen where it is left.
_SEEN = 0.5

#: Why a ship is not judged.
_ALONE = "A pull-out to one side says nothing of her stability: it takes one to each side."
_TOO_SHORT = "The rate was far from a steady one when the rudder left amidships: hold it there longer."

#: Smallest difference of both residual rates that counts, in standard errors and as a share of the rate of the turns.
_APART_ERRORS, _APART_SHARE = 3.0, 0.05


@dataclass(frozen=True)
class PullOut:
    """One pull-out."""

    #: One of {"starboard", "port"}. Side of the turn before it.
    side: Side
    #: delta0_deg, delta0_measured_deg: Rudder of the turn, as it was most likely ordered and as it was held, deg.
    delta0_deg: float
    delta0_measured_deg: float
    #: Rudder afterwards, starboard positive, deg.
    rudder_after_deg: float
    #: Heading where the rudder leaves the turn's angle, 0 to 360 deg.
    base_heading_deg: float
    #: start_utc_ns, end_utc_ns: From where the rudder starts to move back until it leaves amidships again.
    start_utc_ns: int
    end_utc_ns: int
    #: ``initial_yaw_rate_deg_s``, ``residual_yaw_rate_deg_s``: starboard positive.
    figures: Mapping[str, MeasuredFigure]
    #: Of the pull-out to the other side that belongs to it; None where there is none.
    partner_start_utc_ns: int | None
    #: One of {"unstable", "no instability seen", "not judged"}. What both say of the ship.
    verdict: Verdict
    #: What a person should know, one sentence each.
    reasons: tuple[str, ...]


def pull_out(signals: Signals, turn: HeldRudder, after: HeldRudder, settings: SegmentSettings) -> PullOut | None:
    """Describe the pull-out between two held rudder angles.

    Parameters
    ----------
    signals : Signals
        Heading and rudder.
    turn, after : HeldRudder
        The rudder held in the turn, and the next one.
    settings : SegmentSettings
        Thresholds.

    Returns
    -------
    PullOut or None
        None where it is none: the turn was not steady or less than 60 deg, the rudder did not go to about midships by
        one movement, or it was not held there until the rate had become steady, showed to what it comes, or had fallen
        to a half.

    References
    ----------
    IMO MSC/Circ.1053, pull-out manoeuvre; ITTC 7.5-04-02-01; ISO 13643-2.
    """
    begin_s, last_s = max(turn.start_s, float(signals.heading_s[0])), min(after.end_s, float(signals.heading_s[-1]))
    one_movement = begin_s < turn.end_s < after.start_s < last_s
    if not (one_movement and _to_amidships(turn.rudder, after.rudder, settings)):
        return None
    initial = _steady_rate(signals, turn, begin_s)
    if initial is None:
        return None
    quarter_s = pi / 2 / abs(initial.value)
    end_s = min(last_s, after.start_s + _LONGEST * quarter_s)
    in_time = after.start_s - turn.end_s <= _SHORTEST * quarter_s <= end_s - after.start_s
    if not in_time or signals.longest_gap_s(turn.end_s, end_s) > settings.gap_share * quarter_s:
        return None
    residual = settling_rate(signals, after.start_s, end_s)
    known = residual.on_the_way and residual.comes_to_std <= _KNOWN * abs(initial.value)
    settled = known or abs(residual.last.change) <= _STEADY_END * abs(initial.value)
    if not settled and residual.last.value / initial.value > 0.5:
        return None
    ramp = measure_ramp(
        signals.rudder_s,
        signals.rudder,
        after.first,
        held_after=after.rudder,
        held_before=turn.rudder,
        earliest=turn.first,
        noise=signals.rudder_noise,
    )
    start_s = turn.end_s if ramp is None else ramp.start_s
    why = "the rate was still changing when the rudder left midships"
    measured = abs(float(np.rad2deg(turn.rudder)))
    left, left_std = np.rad2deg(residual.comes_to), np.rad2deg(residual.comes_to_std)
    return PullOut(
        side="starboard" if turn.rudder > 0 else "port",
        delta0_deg=nominal_angle(measured, 0.0, RUDDER_TOLERANCE),
        delta0_measured_deg=measured,
        rudder_after_deg=float(np.rad2deg(after.rudder)),
        base_heading_deg=float(np.rad2deg(np.interp(start_s, signals.heading_s, signals.heading))) % 360.0,
        start_utc_ns=signals.utc_ns(start_s),
        end_utc_ns=signals.utc_ns(end_s),
        figures={
            "initial_yaw_rate_deg_s": MeasuredFigure.of(
                float(np.rad2deg(initial.value)), float(np.rad2deg(initial.std))
            ),
            "residual_yaw_rate_deg_s": MeasuredFigure.of(float(left) if settled else nan, float(left_std), why),
        },
        partner_start_utc_ns=None,
        verdict="not judged",
        reasons=() if settled else (f"{why[0].upper()}{why[1:]}.",),
    )


def _to_amidships(before: float, after: float, settings: SegmentSettings) -> bool:
    """Whether the rudder goes from the angle of a turn, rad, to about amidships."""
    over = abs(before) >= np.deg2rad(settings.smallest_rudder_deg)
    return bool(over and abs(after) <= max(_AMIDSHIPS_SHARE * abs(before), _AMIDSHIPS_RAD))


def _steady_rate(signals: Signals, turn: HeldRudder, begin_s: float) -> MeanYawRate | None:
    """Return the rate at the end of a turn to the rudder's side; None where it is small or not steady."""
    end = mean_yaw_rate(signals, turn.end_s - _LAST_PART * (turn.end_s - begin_s), turn.end_s)
    whole = mean_yaw_rate(signals, begin_s, turn.end_s)
    turned = float(np.sign(turn.rudder)) * whole.value * (turn.end_s - begin_s)
    # written so that NaN fails
    steady = abs(end.change) <= _STEADY_TURN * abs(end.value)
    return end if steady and turned >= _SMALLEST_TURN_RAD else None


def paired(pull_outs: Sequence[PullOut]) -> list[PullOut]:
    """Join pull-outs that follow each other out of turns to both sides, and judge each pair.

    Parameters
    ----------
    pull_outs : sequence of PullOut
        Of one log, in order of time.

    Returns
    -------
    list of PullOut
        The same, each one of a pair with its partner and the verdict.
    """
    judged = [replace(one, reasons=(*one.reasons, _ALONE)) for one in pull_outs]
    k = 0
    while k + 1 < len(judged):
        one, other = judged[k], judged[k + 1]
        if one.side == other.side:
            k += 1
            continue
        verdict = _verdict(one, other)
        for at, (this, its_partner) in enumerate(((one, other), (other, one)), start=k):
            more = (_TOO_SHORT,) if verdict == "not judged" and _unsure(this) else ()
            judged[at] = replace(
                this,
                partner_start_utc_ns=its_partner.start_utc_ns,
                verdict=verdict,
                reasons=(*pull_outs[at].reasons, *more),
            )
        k += 2
    return judged


def _unsure(one: PullOut) -> bool:
    """Whether the rate that is left is why a pair is not judged; one that was broken off says so itself."""
    left, turned = one.figures["residual_yaw_rate_deg_s"], one.figures["initial_yaw_rate_deg_s"].value or 0.0
    return left.value is not None and _APART_ERRORS * float(np.sqrt(2.0)) * left.std >= _SEEN * 2.0 * abs(turned)


def _verdict(one: PullOut, other: PullOut) -> Verdict:
    starboard, port = (one, other) if one.side == "starboard" else (other, one)
    right, left = (p.figures["residual_yaw_rate_deg_s"] for p in (starboard, port))
    if right.value is None or left.value is None:
        return "not judged"
    turned = [abs(p.figures["initial_yaw_rate_deg_s"].value or 0.0) for p in (one, other)]
    apart = max(_APART_ERRORS * float(np.hypot(right.std, left.std)), _APART_SHARE * sum(turned) / 2)
    if apart >= _SEEN * sum(turned):
        return "not judged"
    return "unstable" if right.value - left.value > apart else "no instability seen"
