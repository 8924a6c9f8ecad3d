"""The zigzag criteria of IMO resolution MSC.137(76), section 5.3.3, on one zigzag.

Overshoots beyond the nominal heading are judged, the larger of the two readings: a late helmsman does not help a ship.
"""

from __future__ import annotations

from dataclasses import dataclass

from kempf.pipeline.segment.particulars import SLOWEST_SHARE, Particulars
from kempf.pipeline.segment.zigzags.zigzag import Zigzag


@dataclass(frozen=True)
class Criterion:
    """One criterion and how the zigzag did."""

    #: ``10/10 first overshoot``, ``10/10 second overshoot`` or ``20/20 first overshoot``.
    name: str
    #: Measured overshoot beyond the nominal heading; None where its peak was not reached.
    value_deg: float | None
    #: Largest overshoot allowed; None where length or speed is missing.
    limit_deg: float | None
    #: None where the criterion is not applicable.
    passed: bool | None
    #: Why it is not applicable; empty where it is.
    why: str


def overshoot_limits(length_m: float, speed_m_s: float) -> tuple[float, float]:
    """Return the limits of the first and the second overshoot of a 10/10 zigzag, deg.

    Parameters
    ----------
    length_m : float
        Length between perpendiculars, at full scale.
    speed_m_s : float
        Test speed, at full scale.

    Returns
    -------
    first : float
        10 deg below ``L/V = 10 s``, 20 deg from 30 s, ``5 + L/V / 2`` between.
    second : float
        25 deg below, 40 deg from 30 s, ``17.5 + 0.75 L/V`` between.

    Examples
    --------
    >>> overshoot_limits(160.0, 8.0)
    (15.0, 32.5)
    """
    ratio = length_m / speed_m_s
    if ratio < 10.0:
        return 10.0, 25.0
    return (20.0, 40.0) if ratio >= 30.0 else (5.0 + 0.5 * ratio, 17.5 + 0.75 * ratio)


def judge(zigzag: Zigzag, ship: Particulars) -> tuple[Criterion, ...]:
    """Judge a zigzag by the criteria.

    Parameters
    ----------
    zigzag : Zigzag
        The manoeuvre.
    ship : Particulars
        L/V takes the speed measured in the approach, and the trial speed where none was measured.

    Returns
    -------
    tuple of Criterion
        Two for a 10/10, one for a 20/20; one that says why nothing applies for any other.

    References
    ----------
    IMO MSC.137(76), 5.3.3; MSC/Circ.1053.
    """
    angles = (zigzag.psi0_deg, zigzag.delta0_deg)
    measured = zigzag.speed.approach_m_s if zigzag.speed is not None else None
    speed = measured or ship.trial_speed_m_s
    names: tuple[str, ...] = ("20/20 first overshoot",)
    limits: tuple[float, ...] = (25.0,)
    if angles == (10.0, 10.0):
        names = ("10/10 first overshoot", "10/10 second overshoot")
        if not ship.length_of_ship_m or not speed:
            why = f"the {'length' if not ship.length_m else 'speed'} of the ship is not known"
            return tuple(Criterion(name, _overshoot(zigzag, k), None, None, why) for k, name in enumerate(names))
        limits = overshoot_limits(ship.length_of_ship_m, ship.speed_of_ship(speed))
    elif angles != (20.0, 20.0):
        why = f"the standard knows 10/10 and 20/20 zigzags, this is a {angles[0]:g}/{angles[1]:g} one"
        return (Criterion("overshoot", _overshoot(zigzag, 0), None, None, why),)
    obstacle = _obstacle(zigzag, ship, measured)
    return tuple(
        _criterion(zigzag, k, name, limit, obstacle) for k, (name, limit) in enumerate(zip(names, limits, strict=True))
    )


def _criterion(zigzag: Zigzag, number: int, name: str, limit: float, obstacle: str) -> Criterion:
    value = _overshoot(zigzag, number)
    why = obstacle or ("the manoeuvre was broken off before this overshoot" if value is None else "")
    return Criterion(name, value, limit, None if why or value is None else value <= limit, why)


def _overshoot(zigzag: Zigzag, number: int) -> float | None:
    return zigzag.overshoots[number].beyond_nominal_deg if number < len(zigzag.overshoots) else None


def _obstacle(zigzag: Zigzag, ship: Particulars, measured_m_s: float | None) -> str:
    """Return why the trial is none in the sense of the standard, or an empty text."""
    if zigzag.quality.start != "steady":
        return "the approach was not steady"
    if not ship.length_m:
        return "the length of the ship is not known"
    if ship.too_short:
        return ship.too_short
    if measured_m_s is not None and ship.too_slow(measured_m_s):
        return (
            f"the approach speed of {measured_m_s:.1f} m/s is below {100 * SLOWEST_SHARE:.0f} % of the trial speed "
            f"{ship.trial_speed_m_s:g} m/s"
        )
    return ""
