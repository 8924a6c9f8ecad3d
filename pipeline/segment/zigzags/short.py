"""Whether few legs are a short zigzag, or hand steering and course changes that look like one.

Three legs hold two switchings, which nearly always lie symmetric about something, and two legs only one, which agrees
with itself. So more is asked: round angles, as they are ordered for a trial, and of two legs that the second one is
held until the ship has swung back. On a new course the counter rudder is taken off when the swing stops. Four legs from
a course on which the ship was still turning are asked for round angles too.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.segment.rudder.local_fit import peak, value_and_rate
from kempf.pipeline.segment.rudder.measured import Signals
from kempf.pipeline.segment.rudder.nominal import HEADING_TOLERANCE, RUDDER_TOLERANCE, is_customary, measured_angles
from kempf.pipeline.segment.rudder.switching import Chain, Switching

#: Largest difference between the two rudder angles, as a share and at least in rad: both were ordered alike.
_ALIKE_SHARE = 0.04
_ALIKE_RAD = float(np.deg2rad(0.3))

#: Longest leg that may follow, as a share of the second: the rudder of the autopilot that takes over passes the angle.
_PASSING_SHARE = 0.5

#: How far past the opposite switching heading the ship may swing under the second leg, as a share of psi0.
_PAST_SHARE = 0.5


def is_trial(signals: Signals, chain: Chain, switching: Switching, window_s: float) -> bool:
    """Whether a zigzag of few legs was run as one.

    Parameters
    ----------
    signals : Signals
        Heading and rudder.
    chain : Chain
        The chain of legs.
    switching : Switching
        Part of it.
    window_s : float
        Half width of the local cubic, s.

    Returns
    -------
    bool
        True for more than three legs, and for more than four where the ship was still turning at K0. For fewer, where
        rudder and heading change are customary angles; for two, where moreover no other leg follows, the approach is
        steady, both rudder angles are alike, and the ship swung back past where the rudder was reversed, but no farther
        than in a zigzag.
    """
    if switching.last - switching.first > (3 if switching.start == "turning" else 2):
        return True
    psi0, delta0, late = measured_angles(chain, switching)
    if not (is_customary(delta0, 0.0, RUDDER_TOLERANCE) and is_customary(psi0, late, HEADING_TOLERANCE)):
        return False
    return switching.last - switching.first > 1 or _swung_back(signals, chain, switching, window_s)


def _swung_back(signals: Signals, chain: Chain, switching: Switching, window_s: float) -> bool:
    """Whether the second of two legs was held until the ship had swung back."""
    first, second = chain.legs[switching.first], chain.legs[switching.last]
    follows = chain.legs[switching.last + 1 :]
    if switching.start != "steady" or any(leg.duration_s > _PASSING_SHARE * second.duration_s for leg in follows):
        return False
    offset = abs(abs(first.rudder) - abs(second.rudder))
    if offset > max(_ALIKE_SHARE * (abs(first.rudder) + abs(second.rudder)) / 2, _ALIKE_RAD):
        return False
    ramp = chain.ramps[switching.last]
    if ramp is None:
        return False
    turned = peak(
        signals.heading_s, signals.heading, ramp.start_s, second.end_s, side=first.side, half_window_s=window_s
    )
    if turned is None:
        return False
    at_end = value_and_rate(signals.heading_s, signals.heading, min(second.end_s, signals.heading_s[-1]), window_s)[0]
    swung = first.side * (at_end - switching.base_heading)
    back = first.side * (float(chain.heading[switching.last]) - switching.base_heading)
    return bool(-(1.0 + _PAST_SHARE) * switching.heading_change <= swung <= back)
