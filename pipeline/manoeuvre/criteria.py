"""The criteria of IMO resolution MSC.137(76), section 5.3, on a predicted manoeuvre, each with a probability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import radians

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.manoeuvre.covered import Beyond
from kempf.pipeline.manoeuvre.sailed import Manoeuvre
from kempf.pipeline.manoeuvre.turning_circle import PredictedCircle
from kempf.pipeline.manoeuvre.zigzag import PredictedZigzag
from kempf.pipeline.segment.particulars import SLOWEST_SHARE, Particulars
from kempf.pipeline.segment.zigzags.imo import overshoot_limits
from kempf.schemas.enumeration import listed

#: in ship lengths: 5.3.1 and 5.3.2
ADVANCE, TACTICAL_DIAMETER, INITIAL_TURNING = 4.5, 5.0, 2.5
#: 5.3.3, first overshoot of a 20/20 zigzag, deg
TWENTY = 25.0


@dataclass(frozen=True)
class Judged:
    """One criterion."""

    name: str
    #: In the unit of the figure; None where it depends on a length that is not known.
    limit: float | None
    unit: str
    #: Share of the ships that the data allow which fulfil it; None where it is not judged.
    probability: float | None
    #: Why it is not judged, or what has to be said of it; empty where nothing has.
    why: str = ""


def judge(
    manoeuvre: Manoeuvre,
    samples: Mapping[str, Float],
    drawn: int,
    vessel: Particulars,
    speed_m_s: float,
    extrapolated: Sequence[Beyond] = (),
) -> tuple[Judged, ...]:
    """Judge a manoeuvre by the criteria that apply to it.

    Parameters
    ----------
    samples : mapping of str to ndarray, shape (n,)
        Figures of the ships that sail it; NaN where one has none, which fulfils nothing.
    drawn : int
        How many ships were drawn, n or more: one that does not sail it fulfils nothing either.
    vessel : Particulars
        Of her profile; a model is judged as the ship that it is one of.
    speed_m_s : float
        Of the approach; the standard asks for nine tenths of the trial speed at least.
    extrapolated : sequence of Beyond, optional
        In what the manoeuvre goes beyond the logs, which is said beside the verdict.
    """
    criteria = _criteria(manoeuvre, vessel, speed_m_s)
    short, full, slow = vessel.too_short, _at_full_scale(vessel, speed_m_s), ""
    if vessel.too_slow(speed_m_s):
        slow = (
            f"at {speed_m_s:.3g} m/s, below {100 * SLOWEST_SHARE:.0f} % of the trial speed "
            f"{vessel.trial_speed_m_s:g} m/s, which the standard asks for"
        )
    outside = f"extrapolated in {listed([one.words for one in extrapolated])}" if extrapolated else ""
    unknown = "the length of the ship is not known: give it in the profile"
    return tuple(
        Judged(
            name,
            limit,
            unit,
            float(np.count_nonzero(samples[figure] <= limit) / drawn),
            "; ".join(filter(None, (outside, full, note, short, slow))),
        )
        if limit is not None
        else Judged(name, None, unit, None, short or unknown)
        for name, figure, limit, unit, note in criteria
    )


def _criteria(
    manoeuvre: Manoeuvre, vessel: Particulars, speed_m_s: float
) -> list[tuple[str, str, float | None, str, str]]:
    def lengths(factor: float) -> float | None:
        return None if vessel.length_m is None else factor * vessel.length_m

    if isinstance(manoeuvre, PredictedCircle):
        note = "" if manoeuvre.rudder_rad >= radians(34.9) else "the standard asks for 35 deg of rudder, or the most"
        return [
            ("advance", "advance_m", lengths(ADVANCE), "m", note),
            ("tactical diameter", "tactical_diameter_m", lengths(TACTICAL_DIAMETER), "m", note),
        ]
    if not isinstance(manoeuvre, PredictedZigzag):
        return []
    angles = tuple(round(float(np.degrees(a)), 6) for a in (manoeuvre.heading_rad, manoeuvre.rudder_rad))
    if angles == (10.0, 10.0):
        # the limits go with the seconds that a ship takes for her length: those of a model are not its ship's
        length = vessel.length_of_ship_m
        first, second = None, None
        if length is not None and not vessel.too_short:
            first, second = overshoot_limits(length, vessel.speed_of_ship(speed_m_s))
        return [
            ("initial turning", "initial_turning_m", lengths(INITIAL_TURNING), "m", ""),
            ("10/10 first overshoot", "overshoots_deg.0", first, "deg", ""),
            ("10/10 second overshoot", "overshoots_deg.1", second, "deg", ""),
        ]
    return [("20/20 first overshoot", "overshoots_deg.0", TWENTY, "deg", "")] if angles == (20.0, 20.0) else []


def _at_full_scale(vessel: Particulars, speed_m_s: float) -> str:
    if vessel.model_scale is None or vessel.length_of_ship_m is None:
        return ""
    return (
        f"judged at full scale, 1:{vessel.model_scale:g}: {vessel.length_of_ship_m:.4g} m long, "
        f"{vessel.speed_of_ship(speed_m_s):.3g} m/s"
    )
