"""Which round angle was ordered, given the one measured."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.segment.rudder.switching import Chain, Switching

#: Angles at which zigzags are customarily run, deg (IMO 10/10 and 20/20, ITTC 7.5-02-06-01, tank programmes).
CUSTOMARY_DEG: tuple[float, ...] = (1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0)

#: Tolerances as a share of the ordered angle: of the rudder, and of the heading at which it is switched.
RUDDER_TOLERANCE = 0.06
HEADING_TOLERANCE = 0.07

#: Delay of a helmsman and his gear that lets the heading run past the ordered psi0, as a share of a leg.
_DELAY_SHARE = 0.025


def measured_angles(chain: Chain, switching: Switching) -> tuple[float, float, float]:
    """Return what was measured of both ordered angles.

    Parameters
    ----------
    chain : Chain
        The chain of legs.
    switching : Switching
        The zigzag in it.

    Returns
    -------
    tuple of float
        psi0, delta0, and how far psi0 may exceed the order because the rudder starts late, deg.
    """
    legs = chain.legs[switching.first : switching.last + 1]
    starboard = float(np.median([leg.rudder for leg in legs if leg.side > 0]))
    port = float(np.median([leg.rudder for leg in legs if leg.side < 0]))
    rate = float(np.mean(np.abs(chain.yaw_rate[switching.first + 1 : switching.last + 1])))
    spacing = float(np.median(np.diff([leg.start_s for leg in legs])))
    psi0, delta0, late = np.rad2deg([switching.heading_change, (starboard - port) / 2, rate * _DELAY_SHARE * spacing])
    return float(psi0), float(delta0), float(late)


def nominal_angle(measured_deg: float, late_deg: float, relative: float, expected_deg: float | None = None) -> float:
    """Return the angle that was most likely ordered.

    A customary angle is preferred while it lies within the tolerance; else the nearest whole degree, or half degree
    below 3 deg.

    Parameters
    ----------
    measured_deg : float
        Measured angle, positive.
    late_deg : float
        How far the measured angle may exceed the ordered one because the rudder starts late.
    relative : float
        Tolerance otherwise, as a share of the ordered angle.
    expected_deg : float, optional
        An angle that is preferred while it lies within twice the tolerance: psi0 mostly equals delta0.

    Returns
    -------
    float
        Ordered angle, deg.

    Examples
    --------
    >>> nominal_angle(10.7, late_deg=1.0, relative=0.06)
    10.0
    >>> nominal_angle(11.9, late_deg=1.0, relative=0.06)
    12.0
    """
    slack = {angle: max(relative * angle, 0.25) for angle in CUSTOMARY_DEG}
    if expected_deg is not None:
        wide = 2.0 * max(relative * expected_deg, 0.25)
        if -wide <= measured_deg - expected_deg <= wide + late_deg:
            return expected_deg
    fitting = [a for a in CUSTOMARY_DEG if -slack[a] <= measured_deg - a <= slack[a] + late_deg]
    if fitting:
        return min(fitting, key=lambda a: abs(measured_deg - a))
    if measured_deg < 3.0:
        return max(round(measured_deg * 2.0) / 2.0, 0.5)
    return float(round(measured_deg))


def nominal_angles(psi0_deg: float, delta0_deg: float, late_deg: float) -> tuple[float, float]:
    """Return the pair of angles that was most likely ordered.

    A compass shows psi0 far better than a feedback shows the order of the rudder, which is often some per cent off: a
    customary psi0 is not given up for a delta0 beside it, and delta0 is the same angle as far as it can be.

    Parameters
    ----------
    psi0_deg, delta0_deg, late_deg : float
        Of `measured_angles`.

    Returns
    -------
    tuple of float
        psi0 and delta0, deg.

    Examples
    --------
    >>> nominal_angles(20.8, 21.4, 0.9), nominal_angles(10.4, 20.1, 0.9), nominal_angles(12.2, 12.1, 0.5)
    ((20.0, 20.0), (10.0, 20.0), (12.0, 12.0))
    """
    rudder = nominal_angle(delta0_deg, 0.0, RUDDER_TOLERANCE)
    expected = rudder if rudder in CUSTOMARY_DEG else None
    heading = nominal_angle(psi0_deg, late_deg, HEADING_TOLERANCE, expected)
    if heading not in CUSTOMARY_DEG:
        return nominal_angle(psi0_deg, late_deg, HEADING_TOLERANCE, rudder), rudder
    if rudder not in CUSTOMARY_DEG and abs(delta0_deg - heading) <= 2.0 * RUDDER_TOLERANCE * heading:
        return heading, heading
    return heading, rudder


def is_customary(measured_deg: float, late_deg: float, relative: float) -> bool:
    """Whether the measured angle is one of the customary ones, with the tolerances of `nominal_angle`.

    Parameters
    ----------
    measured_deg, late_deg, relative : float
        See `nominal_angle`.

    Returns
    -------
    bool
        True where `nominal_angle` finds one of `CUSTOMARY_DEG` within its tolerance.
    """
    return any(
        -max(relative * a, 0.25) <= measured_deg - a <= max(relative * a, 0.25) + late_deg for a in CUSTOMARY_DEG
    )
