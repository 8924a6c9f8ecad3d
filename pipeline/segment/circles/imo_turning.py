"""The turning criteria of IMO resolution MSC.137(76), section 5.3.1, on one turning circle."""

from __future__ import annotations

from dataclasses import dataclass

from kempf.pipeline.segment.circles.turning_circle import MeasuredCircle
from kempf.pipeline.segment.particulars import SLOWEST_SHARE, Particulars

#: Rudder at which the standard is judged, deg, and by how much less may have been held, as a share of it.
_RUDDER_DEG, _LESS = 35.0, 0.06

#: Largest figures allowed, ship's lengths.
_LIMITS = {"advance": ("advance_m", 4.5), "tactical diameter": ("tactical_diameter_m", 5.0)}


@dataclass(frozen=True)
class TurningCriterion:
    """One criterion and how the turning circle did."""

    #: ``advance`` or ``tactical diameter``.
    name: str
    #: Measured, in ship's lengths; None where it or the length is missing.
    value_lengths: float | None
    #: Largest allowed, in ship's lengths.
    limit_lengths: float
    #: None where the criterion is not applicable.
    passed: bool | None
    #: Why it is not applicable; empty where it is.
    why: str


def judge_circle(circle: MeasuredCircle, ship: Particulars) -> tuple[TurningCriterion, ...]:
    """Judge a turning circle by the criteria.

    Parameters
    ----------
    circle : MeasuredCircle
        The manoeuvre.
    ship : Particulars
        Of her profile.

    Returns
    -------
    tuple of TurningCriterion
        Of the advance and the tactical diameter.

    References
    ----------
    IMO MSC.137(76), 5.3.1; MSC/Circ.1053.
    """
    obstacle = _obstacle(circle, ship)
    judged = []
    for name, (figure, limit) in _LIMITS.items():
        measured = circle.measured.figures[figure]
        value = None if measured.value is None or not ship.length_m else measured.value / ship.length_m
        why = obstacle or (measured.why if value is None else "")
        judged.append(TurningCriterion(name, value, limit, None if why or value is None else value <= limit, why))
    return tuple(judged)


def _obstacle(circle: MeasuredCircle, ship: Particulars) -> str:
    """Return why the trial is none in the sense of the standard, or an empty text."""
    speed = circle.measured.approach_speed_m_s
    reasons = {
        "the approach was not steady": circle.quality.start != "steady",
        f"the standard asks for {_RUDDER_DEG:g} deg of rudder, {circle.delta0_measured_deg:.1f} were held": (
            circle.delta0_measured_deg < (1.0 - _LESS) * _RUDDER_DEG
        ),
        "the length of the ship is not known": not ship.length_m,
        ship.too_short: bool(ship.too_short),
        # written so that a speed that is not recorded is no obstacle
        f"the approach speed of {speed:.1f} m/s is below {100 * SLOWEST_SHARE:.0f} % of the trial speed": (
            ship.too_slow(speed)
        ),
    }
    return next((why for why, holds in reasons.items() if holds), "")
